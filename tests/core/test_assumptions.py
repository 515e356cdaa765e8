import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import PatternAlphabet

ALPHABET = PatternAlphabet(("front", "top"), 3)


def test_arcubes_are_assumed_as_the_paper_says() -> None:
    assumptions = arcube_assumptions()
    assert assumptions.n_objects == 100
    assert assumptions.n_aspects == 24
    assert assumptions.actions == ("flip", "left", "right")
    assert len(assumptions.alphabet) == 132
    assert arcube_assumptions(20).n_objects == 20


@pytest.mark.parametrize("field", ["n_objects", "n_aspects"])
@pytest.mark.parametrize("value", [0, -1, 1.0, True, "3", None, 2**53 + 1])
def test_a_number_that_is_no_whole_number_of_at_least_one_is_refused(field: str, value: object) -> None:
    numbers = {"n_objects": 5, "n_aspects": 4} | {field: value}
    with pytest.raises(InvalidInputError, match=field):
        Assumptions(**numbers, actions=("push",), alphabet=ALPHABET)


@pytest.mark.parametrize("actions", [(), ("push", "push"), ("push", "pull", "push")])
def test_actions_have_different_names_and_there_is_one_at_least(actions: tuple[str, ...]) -> None:
    with pytest.raises(InvalidInputError, match="actions"):
        Assumptions(5, 4, actions, ALPHABET)


def test_an_object_has_no_more_aspects_than_there_are_patterns() -> None:
    assert Assumptions(5, 6, ("push",), ALPHABET).n_aspects == 6
    with pytest.raises(InvalidInputError, match="at most the 6 patterns"):
        Assumptions(5, 7, ("push",), ALPHABET)


def test_actions_are_found_by_name() -> None:
    assumptions = arcube_assumptions()
    assert [assumptions.action_index(name) for name in ("flip", "left", "right")] == [0, 1, 2]


@pytest.mark.parametrize("name", ["Flip", "", 0, None])
def test_an_unknown_action_is_refused_with_the_names_there_are(name: object) -> None:
    with pytest.raises(InvalidInputError, match=r"step 3: .*expected one of: flip, left, right"):
        arcube_assumptions().action_index(name, "step 3")


def test_equal_assumptions_are_equal() -> None:
    assert arcube_assumptions() == arcube_assumptions()
    assert arcube_assumptions() != arcube_assumptions(99)


def test_a_list_of_names_is_as_good_as_a_tuple_and_numpy_numbers_as_plain_ones() -> None:
    listed = Assumptions(
        np.int64(5),
        np.int32(4),
        ["push", "pull"],
        PatternAlphabet(["front", "top"], np.int16(3)),  # type: ignore
    )
    plain = Assumptions(5, 4, ("push", "pull"), PatternAlphabet(("front", "top"), 3))
    assert listed == plain
    assert hash(listed) == hash(plain)
    assert (type(listed.n_objects), type(listed.alphabet.n_symbols)) == (int, int)


@pytest.mark.parametrize("names", ["push", ["push", 3], 7, None, {"push": 1}])
def test_what_is_no_sequence_of_names_is_refused(names: object) -> None:
    with pytest.raises(InvalidInputError, match=r"actions: .*expected at least one name, all different"):
        Assumptions(5, 4, names, ALPHABET)  # type: ignore
    with pytest.raises(InvalidInputError, match=r"slots: .*expected at least one name, all different"):
        PatternAlphabet(names, 5)  # type: ignore
