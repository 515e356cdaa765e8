"""The tables of the model by hand; F(a, b) is the fraction a/b."""

from fractions import Fraction as F  # noqa: N817

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.inference.expected_entropy import next_pattern_joint, pattern_table
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel
from tests.small import graph, one_slot, seen

TWO_SLOTS = Assumptions(5, 4, ("push", "pull"), PatternAlphabet(("front", "top"), 3))  # |𝒵| = 6


def two_slot_memory() -> RobotMemory:
    """Aspect 0 shows (0, 1) and aspect 1 shows (1, 0); push led from 0 to 1 three times and to 0 once."""
    known = graph(TWO_SLOTS, "known", [(0, 1), (1, 0)], (0, 0, 1, 3), (0, 0, 0, 1))
    return RobotMemory(TWO_SLOTS, [known])


def table_is(actual: np.ndarray, expected: list) -> None:
    np.testing.assert_allclose(actual, np.array(expected, dtype=np.float64), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("n_objects", "n_remembered", "expected"),
    [
        (100, 0, [1]),
        (100, 1, [F(1, 100), F(99, 100)]),
        (5, 2, [F(1, 5), F(1, 5), F(3, 5)]),
        (2, 2, [F(1, 3)] * 3),  # U is at least 1, and the prior is normalised
        (1, 3, [F(1, 4)] * 4),
    ],
)
def test_the_prior_is_one_share_an_object_and_u_shares_for_unseen(n_objects, n_remembered, expected) -> None:
    assumptions = one_slot(n_objects, 2, 3)
    memory = RobotMemory(assumptions, [graph(assumptions, str(i), []) for i in range(n_remembered)])
    model = RecognitionModel(memory, ModelParameters())
    table_is(model.prior, expected)
    assert model.n_unseen == max(n_objects - n_remembered, 1)


def test_the_first_aspect_is_each_known_one_equally_and_the_rest_the_collection_node() -> None:
    # G = 4: the known object has n = 2 and m = 2, unseen has m = 4.
    model = RecognitionModel(two_slot_memory(), ModelParameters())
    table_is(model.base_row, [[F(2, 4), F(1, 4), F(1, 4)], [1, 0, 0]])


def test_a_full_graph_has_no_collection_node() -> None:
    assumptions = one_slot(3, 2, 2)
    memory = RobotMemory(assumptions, [graph(assumptions, "full", [(1,), (0,)])])
    model = RecognitionModel(memory, ModelParameters(1.0, 0.0))
    table_is(model.base_row, [[0, F(1, 2), F(1, 2)], [1, 0, 0]])
    table_is(model.transition(0)[0, 1:], [[0, F(1, 2), F(1, 2)]] * 2)


def test_a_tried_action_is_a_dirichlet_mean_and_an_untried_one_the_base() -> None:
    model = RecognitionModel(two_slot_memory(), ModelParameters(1.0, 0.1))
    base = [F(2, 4), F(1, 4), F(1, 4)]
    # α = 1, c = 3 + 1: C gets (0 + 2/4)/5, aspect 0 (1 + 1/4)/5, aspect 1 (3 + 1/4)/5.
    table_is(model.transition(0), [[base, [F(1, 10), F(1, 4), F(13, 20)], base], [[1, 0, 0]] * 3])
    table_is(model.transition(1), [[base] * 3, [[1, 0, 0]] * 3])


def test_without_concentration_a_tried_action_is_its_plain_frequency() -> None:
    model = RecognitionModel(two_slot_memory(), ModelParameters(0.0, 0.1))
    table_is(model.transition(0)[0, 1], [0, F(1, 4), F(3, 4)])
    table_is(model.transition(0)[0, 2], [F(2, 4), F(1, 4), F(1, 4)])  # c = 0: the base, not 0/0


def test_a_known_aspect_shows_its_pattern_and_the_collection_node_any_unknown_one() -> None:
    model = RecognitionModel(two_slot_memory(), ModelParameters(1.0, 0.1))
    noise = F(1, 60)  # δ/|𝒵|
    # Known (0, 1) and (1, 0), so 4 patterns are left for C, and 6 for unseen.
    table_is(model.likelihood(seen(TWO_SLOTS, 0, 1))[0], [noise, F(9, 10) + noise, noise])
    table_is(model.likelihood(seen(TWO_SLOTS, 2, 1))[0], [F(9, 40) + noise, noise, noise])
    table_is(model.likelihood(seen(TWO_SLOTS, 2, 1))[1, :1], [F(9, 60) + noise])


def test_partial_evidence_is_the_sum_over_the_patterns_that_agree() -> None:
    model = RecognitionModel(two_slot_memory(), ModelParameters(1.0, 0.1))
    # Front 0 agrees with (0, 1), which is known, and (0, 2), which is not.
    partial = model.likelihood(seen(TWO_SLOTS, 0, None))
    table_is(partial[0], [F(9, 40) + F(2, 60), F(9, 10) + F(2, 60), F(2, 60)])
    table_is(partial[1, :1], [F(18, 60) + F(2, 60)])
    table_is(model.likelihood(seen(TWO_SLOTS, None, None))[0], [1, 1, 1])


def test_soft_evidence_weighs_the_patterns() -> None:
    model = RecognitionModel(two_slot_memory(), ModelParameters(1.0, 0.0))
    # 𝒵 in order: 01 02 10 12 20 21
    soft = Evidence.of_likelihood(TWO_SLOTS.alphabet, [0.5, 1, 0.25, 0, 0, 2])
    table_is(model.likelihood(soft)[0], [F(1 + 0 + 0 + 2, 4), F(1, 2), F(1, 4)])
    table_is(model.likelihood(soft)[1, :1], [F(15, 24)])  # (1/2 + 1 + 1/4 + 2) / 6


def test_learning_gives_every_hypothesis_with_room_the_new_aspect_and_splits_its_belief() -> None:
    # |𝒵| = 4, G = 2, δ = 1/2: "half" knows 1 of 2, "full" 2 of 2, unseen 0 of 2.
    assumptions = one_slot(5, 2, 4)
    memory = RobotMemory(assumptions, [graph(assumptions, "half", [(3,)]), graph(assumptions, "full", [(2,), (3,)])])
    model = RecognitionModel(memory, ModelParameters(1.0, 0.5, learn_in_trial=True))
    revelation = model.learn(None, None, 0)
    assert revelation is not None
    assert revelation.hypotheses.tolist() == [0, 2]
    assert revelation.states.tolist() == [2, 1]
    # "half" has found its G-th aspect, which takes all; unseen divides (1/2)/4 : (1/2)/4.
    table_is(revelation.shares, [1, F(1, 2)])
    assert model.n_known.tolist() == [2, 2, 1]
    table_is(model.base_row, [[0, F(1, 2), F(1, 2)], [0, F(1, 2), F(1, 2)], [F(1, 2), F(1, 2), 0]])
    # Seen again it is no news to anybody.
    assert model.learn(0, 0, 0) is None
    # C of unseen now has 3 patterns left: (1/2)/3 + (1/2)/4 for each.
    table_is(model.likelihood(seen(assumptions, 1))[2, :2], [F(1, 6) + F(1, 8), F(1, 8)])
    assert (model.likelihood(seen(assumptions, 0))[:2, COLLECTION] == 0.125).all()


def test_learning_counts_a_transition_for_each_hypothesis_that_knows_both_its_ends() -> None:
    assumptions = one_slot(5, 2, 4)
    memory = RobotMemory(
        assumptions, [graph(assumptions, "both", [(0,), (1,)], (0, 0, 1, 1)), graph(assumptions, "full", [(0,), (3,)])]
    )
    model = RecognitionModel(memory, ModelParameters(1.0, 0.5, learn_in_trial=True))
    model.learn(None, None, 0)
    model.learn(0, 0, 1)
    # "both": c = 2, so (2 + 1/2)/3. "full" has no room for pattern 1: its row stays the base.
    # Unseen found 0 and 1: c = 1, so (1 + 1/2)/2.
    rows = model.transition(0)[:, 1]
    table_is(rows, [[0, F(1, 6), F(5, 6)], [0, F(1, 2), F(1, 2)], [0, F(1, 4), F(3, 4)]])


def test_an_incomplete_look_teaches_nothing_and_breaks_the_sequence() -> None:
    assumptions = one_slot(5, 3, 4)
    model = RecognitionModel(RobotMemory(assumptions), ModelParameters(1.0, 0.1, learn_in_trial=True))
    model.learn(None, None, 0)
    assert model.learn(0, 0, None) is None
    model.learn(None, 0, 1)
    assert model.n_known.tolist() == [2]
    table_is(model.transition(0)[0], [[F(1, 3)] * 3] * 3)


def test_nothing_is_learned_within_the_trial_unless_asked_for() -> None:
    model = RecognitionModel(two_slot_memory(), ModelParameters(1.0, 0.1, learn_in_trial=False))
    before = model.transition(0).copy()
    assert model.learn(None, None, 5) is None
    assert model.learn(5, 0, 0) is None
    assert (model.transition(0) == before).all()


def test_the_memory_is_not_changed_by_learning_within_the_trial() -> None:
    memory = two_slot_memory()
    model = RecognitionModel(memory, ModelParameters())
    model.learn(None, None, 0)
    model.learn(0, 0, 5)
    assert memory == two_slot_memory()


def test_restricted_tables_are_those_of_the_hypotheses_that_are_left() -> None:
    assumptions = one_slot(5, 3, 4, ("push", "pull"))
    graphs = [graph(assumptions, str(i), [(i,), (3,)], (0, i % 2, 1, 1 + i), (1, 0, 0, 2)) for i in range(3)]
    model = RecognitionModel(RobotMemory(assumptions, graphs), ModelParameters(0.5, 0.1))
    part = model.restricted(np.array([0, 2, 3]))
    for action in range(2):
        table_is(part.transition(action), model.transition(action)[[0, 2, 3]])
    evidence = seen(assumptions, 3)
    table_is(part.likelihood(evidence), model.likelihood(evidence)[[0, 2, 3]])
    mass = model.prior[:, None] * model.base_row
    whole = pattern_table(model, next_pattern_joint(model, mass), np.arange(4))
    left = pattern_table(part, next_pattern_joint(part, mass[[0, 2, 3]]), np.arange(3))
    table_is(left, whole[:, [0, 2, 3]])
