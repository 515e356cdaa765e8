import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import begin_trial
from atg_fg.inference.smoothing import pattern_marginals, smoothed_patterns

ALPHABET = PatternAlphabet(("front", "top"), 4)
ASSUMPTIONS = Assumptions(5, 6, ("flip", "left"), ALPHABET)
A, B, C = (0, 1), (0, 2), (3, 1)


def a_memory():
    """One object that goes A → B → C and back to A under flip, each seen five times."""
    graph = AspectTransitionGraph("ring", ASSUMPTIONS)
    aspects = [graph.add_aspect(pattern) for pattern in (A, B, C)]
    for before, after in zip(aspects, aspects[1:] + aspects[:1], strict=True):
        graph.add_transition(before, 0, after, 5)
    return RobotMemory(ASSUMPTIONS, [graph])


def after(looks, engine="bayes-filter", parameters=None):
    inference = begin_trial(engine, a_memory(), parameters or ModelParameters(1e-4, 1e-4))
    for number, look in enumerate(looks):
        inference.observe(Evidence.of_detection(ALPHABET, look))
        if number < len(looks) - 1:
            inference.act(0)
    return inference


def index(pattern):
    return ALPHABET.patterns.index(pattern)


@pytest.mark.parametrize("engine", ["bayes-filter", "gtsam", "enumeration"])
def test_a_look_with_a_symbol_missing_is_filled_in_by_its_neighbours(engine):
    inference = after([A, (0, None), C], engine)
    assert smoothed_patterns(inference, 0) == [index(A), index(B), index(C)]


def test_a_look_that_saw_nothing_is_filled_in_too():
    assert smoothed_patterns(after([A, (None, None), C]), 0) == [index(A), index(B), index(C)]


def test_what_nothing_tells_stays_open():
    patterns = smoothed_patterns(after([(0, None)]), 0)
    assert patterns == [None]


def test_complete_looks_stay_as_they_were_seen():
    looks = [A, B, C, A]
    assert smoothed_patterns(after(looks), 0) == [index(look) for look in looks]


def test_a_wrong_look_is_put_right_by_its_neighbours():
    inference = after([A, (2, 3), C], parameters=ModelParameters(1e-6, 0.05, learn_in_trial=False))
    assert smoothed_patterns(inference, 0) == [index(A), index(B), index(C)]


def test_marginals_sum_to_one_and_agree_with_what_was_seen():
    table = pattern_marginals(after([A, (0, None), (None, 1)]), 1)
    np.testing.assert_allclose(table.sum(axis=1), 1)
    seen = [index(pattern) for pattern in ALPHABET.patterns if pattern[0] == 0]
    assert table[1, seen].sum() > 0.999


def test_an_unseen_object_is_open_where_it_was_seen_in_part():
    assert smoothed_patterns(after([A, (3, None)]), 1) == [index(A), None]


def test_there_is_no_other_hypothesis():
    with pytest.raises(InvalidInputError, match="hypothesis: 2"):
        smoothed_patterns(after([A]), 2)
