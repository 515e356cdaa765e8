import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.worlds.finite_objects import FiniteObject, Mechanism, ObjectFamily, closed_mechanism

SWITCH = Mechanism.deterministic([[1], [0]])
#: From state 0 a toss leads to 1 or 2, and back again.
TOSS = Mechanism(np.array([[[1, 2]], [[0, 0]], [[0, 0]]]), np.array([[[0.25, 0.75]], [[0.5, 0.5]], [[1.0, 0.0]]]))


def test_a_deterministic_mechanism_asks_no_generator():
    assert (SWITCH.n_states, SWITCH.n_actions) == (2, 1)
    assert [SWITCH.next_state(state, 0, None) for state in (0, 1)] == [1, 0]


def test_a_stochastic_mechanism_leads_where_it_says_as_often_as_it_says():
    rng = np.random.default_rng(0)
    reached = [TOSS.next_state(0, 0, rng) for _ in range(4000)]
    assert set(reached) == {1, 2}
    assert abs(reached.count(1) / 4000 - 0.25) < 5 * np.sqrt(0.25 * 0.75 / 4000)
    assert {TOSS.next_state(1, 0, rng) for _ in range(50)} == {0}


@pytest.mark.parametrize(
    ("successors", "probabilities", "message"),
    [
        (np.zeros((2, 1), int), np.ones((2, 1)), "expected .states, actions, branches."),
        (np.zeros((0, 1, 1), int), np.ones((0, 1, 1)), "expected .states, actions, branches."),
        (np.zeros((2, 1, 1), int), np.ones((2, 1, 2)), "expected .states, actions, branches."),
        (np.full((2, 1, 1), 2), np.ones((2, 1, 1)), "expected states from 0 to 1"),
        (np.full((2, 1, 1), -1), np.ones((2, 1, 1)), "expected states from 0 to 1"),
        (np.zeros((2, 1, 2), int), np.full((2, 1, 2), 0.4), "a sum of one"),
        (np.zeros((1, 1, 2), int), np.array([[[-0.5, 1.5]]]), "none below zero"),
        (np.zeros((1, 1, 1), int), np.array([[[np.nan]]]), "none below zero"),
    ],
)
def test_a_mechanism_that_is_none_is_refused(successors, probabilities, message):
    with pytest.raises(InvalidInputError, match=message):
        Mechanism(successors, probabilities)


def test_an_object_shows_one_pattern_a_state():
    with pytest.raises(InvalidInputError, match="1 patterns; expected one for each of 2 states"):
        FiniteObject(SWITCH, ((0,),))


def test_objects_look_the_same_however_their_states_are_numbered():
    assert FiniteObject(SWITCH, ((0,), (1,))).appearance == FiniteObject(SWITCH, ((1,), (0,))).appearance
    assert FiniteObject(SWITCH, ((0,), (1,))).appearance != FiniteObject(SWITCH, ((0,), (2,))).appearance


def test_objects_with_the_same_patterns_differ_by_where_actions_lead():
    stuck = Mechanism.deterministic([[0], [1]])
    patterns = ((0,), (1,))
    assert FiniteObject(SWITCH, patterns).appearance != FiniteObject(stuck, patterns).appearance


def test_branches_to_states_that_look_the_same_are_one():
    mechanism = Mechanism(TOSS.successors, np.full((3, 1, 2), 0.5))
    thing = FiniteObject(mechanism, ((0,), (1,), (1,)))
    assert thing.n_aspects == 2
    assert thing.appearance == {((0,), 0, frozenset({((1,), 1.0)})), ((1,), 0, frozenset({((0,), 1.0)}))}


def test_a_family_says_what_to_take_for_granted():
    alphabet = PatternAlphabet(("front",), 4)
    objects = (FiniteObject(TOSS, ((0,), (1,), (1,))), FiniteObject(TOSS, ((0,), (1,), (3,))))
    assumptions = ObjectFamily(("toss",), alphabet, objects).assumptions
    assert (assumptions.n_objects, assumptions.n_aspects) == (2, 3)
    assert (assumptions.actions, assumptions.alphabet) == (("toss",), alphabet)


@pytest.mark.parametrize(
    ("actions", "objects", "message"),
    [
        (("press",), (), "objects: none given"),
        (("press", "pull"), (FiniteObject(SWITCH, ((0,), (1,))),), r"objects\[0\]: 1 actions; expected press, pull"),
        (("press",), (FiniteObject(SWITCH, ((0,), (2,))),), r"objects\[0\], state 1, slot 'front': symbol 2"),
        (("press",), (FiniteObject(SWITCH, ((0,), (0, 1))),), r"objects\[0\], state 1: .* 1 slots"),
    ],
)
def test_a_family_that_does_not_fit_together_is_refused(actions, objects, message):
    with pytest.raises(InvalidInputError, match=message):
        ObjectFamily(actions, PatternAlphabet(("front",), 2), objects)


def test_a_mechanism_is_closed_from_where_it_starts():
    states, mechanism = closed_mechanism(0, (lambda n: (n + 2) % 6, lambda n: 0))
    assert states == (0, 2, 4)
    assert mechanism.successors[..., 0].tolist() == [[1, 0], [2, 0], [0, 0]]
