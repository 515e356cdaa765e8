import itertools
from math import inf, nan

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import Evidence, PatternAlphabet

ARCUBE = PatternAlphabet(("front", "top"), 12)
SMALL = PatternAlphabet(("front", "top"), 3)  # 01 02 10 12 20 21


@pytest.mark.parametrize(
    ("n_slots", "n_symbols", "size"), [(1, 1, 1), (1, 5, 5), (2, 2, 2), (2, 3, 6), (3, 4, 24), (2, 12, 132)]
)
def test_patterns_are_all_ordered_tuples_of_different_symbols(n_slots: int, n_symbols: int, size: int) -> None:
    alphabet = PatternAlphabet(tuple(f"slot-{slot}" for slot in range(n_slots)), n_symbols)
    assert len(alphabet) == len(alphabet.patterns) == size
    expected = [p for p in itertools.product(range(n_symbols), repeat=n_slots) if len(set(p)) == n_slots]
    assert list(alphabet.patterns) == expected
    assert alphabet.symbols.tolist() == [list(pattern) for pattern in expected]
    assert [alphabet.index(pattern) for pattern in expected] == list(range(size))


@pytest.mark.parametrize(
    ("slots", "n_symbols"),
    [
        ((), 3),
        (("front", "front"), 3),
        (("front", "top"), 1),
        (("front",), 0),
        (("front",), -1),
        (("front",), 2.5),
        (("a", "b", "c"), 60),  # 205,320 patterns
        (("a", "b", "c"), 10**7),  # more than len() can return
    ],
)
def test_an_alphabet_that_cannot_be_is_refused(slots: tuple[str, ...], n_symbols: int) -> None:
    with pytest.raises(InvalidInputError):
        PatternAlphabet(slots, n_symbols)


@pytest.mark.parametrize(
    "pattern", [(0,), (0, 1, 2), (0, 0), (0, 3), (-1, 0), (0, None), (0, 1.0), (0, True), ("0", 1), "01", 1, None]
)
def test_what_is_no_complete_pattern_is_refused(pattern: object) -> None:
    with pytest.raises(InvalidInputError):
        SMALL.index(pattern)


def test_an_error_names_the_place_the_slot_and_the_value() -> None:
    with pytest.raises(InvalidInputError, match=r"graph 'cup', slot 'top': symbol 7; expected 0 to 2"):
        SMALL.check_pattern((0, 7), "graph 'cup'")


def test_numpy_integers_are_symbols_and_become_plain_ones() -> None:
    checked = SMALL.check_detection(np.array([2, 0]))
    assert checked == (2, 0)
    assert {type(symbol) for symbol in checked} == {int}


@pytest.mark.parametrize(
    ("detection", "likelihood", "pattern"),
    [
        ((0, 2), [0, 1, 0, 0, 0, 0], 1),
        ((2, 1), [0, 0, 0, 0, 0, 1], 5),
        ((0, None), [1, 1, 0, 0, 0, 0], None),
        ((None, 0), [0, 0, 1, 0, 1, 0], None),
        ((None, None), [1, 1, 1, 1, 1, 1], None),
    ],
)
def test_a_detection_agrees_with_all_patterns_that_have_what_was_seen(detection, likelihood, pattern) -> None:
    evidence = Evidence.of_detection(SMALL, detection)
    assert evidence.likelihood.tolist() == likelihood
    assert evidence.pattern == pattern


def test_slots_are_bounded_even_where_there_is_one_symbol_alone() -> None:
    assert len(PatternAlphabet(tuple(map(str, range(16))), 1, exclusive=False)) == 1
    with pytest.raises(InvalidInputError, match=r"1 symbols in 17 slots make too many patterns; .* and 16 slots"):
        PatternAlphabet(tuple(map(str, range(17))), 1, exclusive=False)


def test_seeing_one_tag_of_an_arcube_leaves_eleven_patterns() -> None:
    assert Evidence.of_detection(ARCUBE, (None, 4)).likelihood.sum() == 11


def test_one_symbol_can_be_a_complete_or_a_missing_detection_of_an_alphabet_of_one() -> None:
    alone = PatternAlphabet(("front",), 1)
    assert Evidence.of_detection(alone, (0,)).pattern == 0
    assert Evidence.of_detection(alone, (None,)).pattern is None


def test_a_symbol_seen_twice_is_refused_even_if_another_is_missing() -> None:
    with pytest.raises(InvalidInputError, match="repeated"):
        Evidence.of_detection(PatternAlphabet(("a", "b", "c"), 4), (1, None, 1))


@pytest.mark.parametrize(
    "likelihood",
    [
        [1] * 5,
        [1] * 7,
        [[1] * 6],
        1.0,
        [],
        [0] * 6,
        [1, 1, 1, 1, 1, -1e-9],
        [1, 1, 1, 1, 1, nan],
        [1, 1, 1, 1, 1, inf],
    ],
)
def test_soft_evidence_that_is_no_likelihood_is_refused(likelihood: object) -> None:
    with pytest.raises(InvalidInputError, match="evidence"):
        Evidence.of_likelihood(SMALL, likelihood)


def test_soft_evidence_is_a_copy_and_never_complete() -> None:
    mine = np.array([0.0, 0, 0, 1, 0, 0])
    evidence = Evidence.of_likelihood(SMALL, mine)
    mine[:] = 7
    assert evidence.likelihood.tolist() == [0, 0, 0, 1, 0, 0]
    assert evidence.pattern is None


@pytest.mark.parametrize("pattern", [999, 6, -1, 1.0, True, "1"])
def test_evidence_of_a_pattern_that_is_not_there_is_refused(pattern: object) -> None:
    with pytest.raises(InvalidInputError, match=r"evidence: pattern: .*; expected a whole number from 0 to 5"):
        Evidence(np.ones(6), pattern).check(6)


def test_symbols_and_evidence_cannot_be_written_to() -> None:
    alphabet = PatternAlphabet(("front", "top"), 3)
    for array in (alphabet.symbols, Evidence.of_detection(alphabet, (0, 1)).likelihood):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(
    ("weights", "taken", "divisor"),
    [
        ([1.0, 0.5, 0.0], [1.0, 0.5, 0.0], 1.0),
        ([1.0, 1e-99, 0.0], [1.0, 1e-99, 0.0], 1.0),
        ([1.0, 1e-101, 0.0], [1.0, 0.0, 0.0], 1.0),
        ([5e-324, 5e-324, 0.0], [1.0, 1.0, 0.0], 5e-324),
        ([1e308, 5e307, 5e-324], [1.0, 0.5, 0.0], 1e308),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 1.0),
    ],
)
def test_weights_of_any_size_are_taken_as_numbers_of_a_middling_size(weights, taken, divisor) -> None:
    evidence, log_scale = Evidence(np.array(weights), 1).scaled()
    assert evidence.likelihood == pytest.approx(taken, rel=1e-15)
    assert log_scale == pytest.approx(np.log(divisor))
    assert evidence.pattern == 1
