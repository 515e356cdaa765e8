import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from atg_fg.core.errors import InvalidInputError
from atg_fg.inference.elimination.discrete_model import DiscreteModel, ModelFactor
from atg_fg.storage.uai import read_evidence, read_model, write_evidence, write_model

#: Three variables; f(X0, X1) and g(X2), the latter with a table that is not 0 to 1.
TEXT = """MARKOV
3
2 3 2
2
2 0 1
1 2

6
 1 2 3
 4 5 6.5
2
 0 1e2
"""


@st.composite
def models(draw):
    cardinalities = tuple(draw(st.lists(st.integers(1, 4), max_size=5)))
    factors = []
    for _ in range(draw(st.integers(0, 4))):
        scope = tuple(draw(st.permutations(range(len(cardinalities)))))[: draw(st.integers(0, 3))]
        shape = tuple(cardinalities[variable] for variable in scope)
        table = draw(hnp.arrays(np.float64, shape, elements=st.floats(0, allow_infinity=False)))
        factors.append((scope, table))
    return DiscreteModel(cardinalities, tuple(factors), draw(st.sampled_from(["MARKOV", "BAYES"])))


def test_the_last_variable_of_a_scope_is_the_fastest():
    model = read_model(TEXT)
    assert (model.kind, model.cardinalities) == ("MARKOV", (2, 3, 2))
    assert [factor.scope for factor in model.factors] == [(0, 1), (2,)]
    assert model.factors[0].table.tolist() == [[1, 2, 3], [4, 5, 6.5]]
    assert model.factors[1].table.tolist() == [0, 100]


def test_a_scope_that_is_not_ascending_keeps_its_order():
    model = read_model("BAYES 2 2 3 1 2 1 0 6 1 2 3 4 5 6")
    assert model.kind == "BAYES"
    assert model.factors[0].scope == (1, 0)
    assert model.factors[0].table.tolist() == [[1, 2], [3, 4], [5, 6]]


@pytest.mark.parametrize("between", [" ", "\n", "\t", "\r\n", " \n\n  "])
def test_the_layout_of_lines_does_not_matter(between):
    model = read_model(between.join(TEXT.split()))
    assert write_model(model) == write_model(read_model(TEXT))


def test_a_model_without_variables_or_factors_is_one():
    assert read_model("MARKOV 0 0").factors == ()
    assert read_model("MARKOV 1 7 0").cardinalities == (7,)


def test_an_empty_scope_holds_a_single_number():
    (factor,) = read_model("MARKOV 1 2 1 0 1 0.25").factors
    assert factor.scope == ()
    assert factor.table.shape == ()
    assert float(factor.table) == 0.25


@given(models())
def test_what_is_written_is_read_again_to_the_last_bit(model):
    text = write_model(model)
    again = read_model(text)
    assert (again.kind, again.cardinalities) == (model.kind, model.cardinalities)
    for (scope, table), (old_scope, old_table) in zip(again.factors, model.factors, strict=True):
        assert scope == old_scope
        np.testing.assert_array_equal(table, old_table)
    assert write_model(again) == text
    assert "-" not in text.replace("e-", "")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("MARKOV", "MARKOFF", "line 1: kind of model: 'MARKOFF'; expected MARKOV or BAYES"),
        ("MARKOV", "markov", "line 1: kind of model: 'markov'"),
        ("MARKOV", "# a comment\nMARKOFF", "line 2: kind of model: 'MARKOFF'"),
        ("2 3 2\n", "2 0 2\n", "line 3: cardinality of variable 1: '0'; expected a whole number of at least 1"),
        ("2 3 2\n", "2 3.0 2\n", "line 3: cardinality of variable 1: '3.0'"),
        ("2 0 1", "2 0 3", "line 5: variable in the scope of factor 0: '3'; expected a whole number from 0 to 2"),
        ("2 0 1", "2 0 -1", "line 5: variable in the scope of factor 0: '-1'"),
        ("2 0 1", "2 0 0", "line 5: variable in the scope of factor 0: '0'; expected variables that are all different"),
        ("2 0 1", "4 0 1", "line 5: size of the scope of factor 0: '4'; expected a whole number from 0 to 3"),
        ("\n6\n", "\n5\n", "line 8: size of the table of factor 0: '5'; expected 6"),
        ("\n6\n", "\n99999999999\n", "line 8: size of the table of factor 0: '99999999999'; expected 6"),
        ("5 6.5", "-5 6.5", "line 10: table of factor 0: '-5'; expected a finite number of at least 0"),
        ("5 6.5", "nan 6.5", "line 10: table of factor 0: 'nan'"),
        ("5 6.5", "5 inf", "line 10: table of factor 0: 'inf'"),
        ("5 6.5", "5 1e999", "line 10: table of factor 0: '1e999'"),
        ("5 6.5", "five 6.5", "line 10: table of factor 0: 'five'"),
        ("5 6.5", "5 6_5", "line 10: table of factor 0: '6_5'"),
        ("5 6.5", "5 ٣", "line 10: table of factor 0: '٣'"),
        ("1e2\n", "", "the text ends in the table of factor 1, after 1 of its values; expected 2"),
        ("2 3 2\n", "2 3 1_0\n", "line 3: cardinality of variable 2: '1_0'"),
        (TEXT, "", "the text ends after 0 words; expected the kind of model, MARKOV or BAYES"),
        (TEXT, "MARKOV 1000000000000 2", "the text ends after 3 words; expected the cardinality of variable 1"),
        (TEXT, "MARKOV 1 2 1000000000000 0", "the text ends after 5 words; expected the size of the scope of factor 1"),
        (TEXT, "MARKOV " + "9" * 5000, "…'; expected a whole number of at least 0"),
    ],
)
def test_what_is_wrong_with_a_model_is_said_with_its_place(old, new, says):
    with pytest.raises(InvalidInputError) as refusal:
        read_model(TEXT.replace(old, new), "graph.uai")
    assert str(refusal.value).startswith("graph.uai: ")
    assert says in str(refusal.value)


def test_every_truncated_model_is_refused():
    words = TEXT.split()
    for length in range(len(words)):
        with pytest.raises(InvalidInputError, match="the text ends"):
            read_model(" ".join(words[:length]))


def test_a_table_is_refused_before_memory_is_taken_for_it():
    cardinalities = " ".join(["1000"] * 20)
    scope = " ".join(map(str, range(20)))
    with pytest.raises(InvalidInputError, match="the text ends in the table of factor 0, after 2 of its values"):
        read_model(f"MARKOV 20 {cardinalities} 1 20 {scope} {1000**20} 1 2")


def test_a_scope_of_more_axes_than_arrays_have_is_refused():
    with pytest.raises(
        InvalidInputError, match=r"size of the scope of factor 0: '65'; expected a whole number .* to 64"
    ):
        read_model(f"MARKOV 65 {'1 ' * 65} 1 65 {' '.join(map(str, range(65)))} 1 1")


@pytest.mark.parametrize(
    ("cardinalities", "scope", "table", "says"),
    [
        ((2, 0), (0,), [1, 1], "variable 1: cardinality 0"),
        ((2, 2), (2,), [1, 1], r"scope \(2,\)"),
        ((2, 2), (0, 0), [[1, 1], [1, 1]], "a variable twice"),
        ((2, 2), (0,), [1, 1, 1], r"shape \(3,\); expected \(2,\)"),
        ((2, 2), (0,), [1, math.nan], "not finite"),
        ((2, 2), (0,), [1, -1], "negative"),
    ],
)
def test_a_model_that_does_not_fit_together_is_refused(cardinalities, scope, table, says):
    with pytest.raises(InvalidInputError, match=says):
        DiscreteModel(cardinalities, (ModelFactor(scope, np.array(table, dtype=float)),))
    with pytest.raises(InvalidInputError, match="kind 'GAUSS'"):
        DiscreteModel((), (), "GAUSS")


def test_the_tables_of_a_model_are_its_own_and_cannot_be_written_to():
    table = np.ones(2)
    model = DiscreteModel((2,), (ModelFactor((0,), table),))
    table[0] = 5
    assert model.factors[0].table.tolist() == [1, 1]
    with pytest.raises(ValueError, match="read-only"):
        model.factors[0].table[0] = 5


@pytest.mark.parametrize(
    ("text", "evidence"),
    [
        ("0", {}),
        ("1 0", {}),
        ("1 4 2", {4: 2}),
        ("1 1 4 2", {4: 2}),
        ("2\n0 1\n5 0\n", {0: 1, 5: 0}),
        ("1\n2 0 1 5 0\n", {0: 1, 5: 0}),
        ("# what was seen\n1 # one look\n0 1 # x0", {0: 1}),
    ],
)
def test_evidence_is_read_with_and_without_the_number_of_samples(text, evidence):
    assert read_evidence(text) == evidence


@given(st.dictionaries(st.integers(0, 50), st.integers(0, 9)))
def test_evidence_is_read_again_as_it_was_written(evidence):
    text = write_evidence(evidence)
    assert read_evidence(text) == evidence
    assert read_evidence("1 " + text) == evidence


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "the text ends after 0 words; expected the number of samples"),
        ("2 0 1", "the text ends after 3 words; expected the variable of observation 1"),
        ("2 1 0 1 1 0 1 9", "line 1: number of samples: '2'; expected 1"),
        ("1 2 0 1", "after 4 words"),
        ("2 0 1 0 1", "line 1: variable of observation 1: '0'; expected each variable to be observed once"),
        ("1 0 -1", "state of observation 0: '-1'; expected a whole number of at least 0"),
        ("1 x 1", "variable of observation 0: 'x'"),
        ("1\n0 1\n7 7", "line 3: after the last observation: '7'; expected the end of the text"),
    ],
)
def test_what_is_wrong_with_evidence_is_said_with_its_place(text, says):
    with pytest.raises(InvalidInputError) as refusal:
        read_evidence(text, "seen.evid")
    assert str(refusal.value).startswith("seen.evid: ")
    assert says in str(refusal.value)


@pytest.mark.parametrize("evidence", [{3: 0}, {0: 2}, {-1: 0}, {0: -1}, {0: True}])
def test_evidence_that_a_model_does_not_have_is_refused(evidence):
    with pytest.raises(InvalidInputError, match=r"seen.evid: (variable|state)"):
        read_model(TEXT).check_evidence(evidence, "seen.evid")


def test_no_text_of_evidence_can_be_read_both_ways():
    for words in itertools.product("012", repeat=5):
        assert len(read_or_none(" ".join(words)) or {}) in (0, 2)
    for words in itertools.product("012", repeat=4):
        assert len(read_or_none(" ".join(words)) or {}) in (0, 1)


def read_or_none(text):
    try:
        return read_evidence(text, note=lambda _: None)
    except InvalidInputError:
        return None


def test_comments_are_passed_over_and_lines_are_counted_with_them():
    commented = TEXT.replace("3\n2 3 2", "3 # variables\n# each has\n2 3 2 # states").replace(
        "6\n", "6 # 2 · 3, naïve_ly\n"
    )
    assert write_model(read_model(commented)) == write_model(read_model(TEXT))
    with pytest.raises(InvalidInputError, match="line 11: table of factor 0: 'six'"):
        read_model(commented.replace("6.5", "six"))


@pytest.mark.parametrize("rest", ["some text that a tool left here", "7", "naïve under_scores", "MARKOV 1 2 0"])
def test_text_after_the_last_table_is_ignored_and_noted(rest):
    notes = []
    assert write_model(read_model(f"{TEXT}\n{rest}\n", "graph.uai", notes.append)) == write_model(read_model(TEXT))
    first, n_words = rest.split()[0], len(rest.split())
    assert notes == [f"graph.uai: line 14: {n_words} words after the last table are ignored: {first!r}"]
    with pytest.warns(UserWarning, match="after the last table are ignored"):
        read_model(f"{TEXT} {rest}")


@pytest.mark.parametrize("text", ["0\n1 0\n", "0 0", "0\nno evidence at all", "0 1 2 3"])
def test_evidence_that_begins_with_0_is_none_whatever_follows(text):
    notes = []
    assert read_evidence(text, "seen.evid", notes.append) == {}
    (note,) = notes
    assert note.startswith("seen.evid: line ")
    assert "after 0 observations are ignored" in note
