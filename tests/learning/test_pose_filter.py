"""Loops of the filter over pose and contents: many looks in one call, and what tables show, as NumPy has it."""

import numpy as np
import pytest

from atg_fg.core.actions import UncertainAction
from atg_fg.learning.pose_chain import pose_patterns
from atg_fg.learning.pose_filter import PoseFilter, Rows
from atg_fg.learning.rates import FAILED, Rates
from atg_fg.learning.raw_trials import side_by_side
from atg_fg.learning.register_contents import symbol_probabilities
from tests.learning.worlds import BOX, RING, RING_WORLD, objects_of, trial_of

ALPHABET = RING_WORLD.alphabet
OFTEN = Rates(slip=0.05, slip_again=0.4, wrong=0.02, repeat=0.05)


@pytest.mark.parametrize("structure", [RING, BOX], ids=["ring", "box"])
@pytest.mark.parametrize("rivals", [False, True])
def test_looks_at_once_are_looks_one_by_one(structure, rivals):
    rng = np.random.default_rng(3)
    contents = [rng.permutation(5)[: structure.n_registers].tolist() for _ in range(6)]
    trials = [trial_of(each, 5, rng, slip=0.2, wrong=0.1) for each in objects_of(structure, contents)]
    symbols, actions = side_by_side(trials)
    known = np.eye(5)[np.array(contents)] * rng.choice([0.0, 0.6, 1.0], (6, 1, 1))
    weights = np.log(np.full(6, 1 / 6)) if rivals else None
    at_once, one_by_one = (PoseFilter(structure.poses(), known, OFTEN, ALPHABET, weights) for _ in range(2))
    at_once.follow(np.ascontiguousarray(actions.T), np.ascontiguousarray(symbols.transpose(1, 0, 2)))
    for look in range(symbols.shape[1]):
        if look:
            one_by_one.act_apart(np.ascontiguousarray(actions[:, look - 1]))
        one_by_one.observe_pattern(symbols[:, look])
    for own, other in zip(at_once.rows, one_by_one.rows, strict=True):
        np.testing.assert_array_equal(own, other)
    np.testing.assert_array_equal(at_once.log_evidence, one_by_one.log_evidence)
    np.testing.assert_allclose(at_once._shown, symbol_probabilities(at_once._contents, OFTEN.repeat), rtol=1e-12)


@pytest.mark.parametrize("structure", [RING, BOX], ids=["ring", "box"])
@pytest.mark.parametrize("last", [1, UncertainAction(((0, 0.5), (1, 0.2)), 0.3)], ids=["sure", "uncertain"])
def test_predicted_patterns_are_sums_over_poses_and_slips(structure, last):
    """Contents are known in part; the middle one of three objects is too improbable to matter."""
    rng, n = np.random.default_rng(5), structure.n_registers
    contents = np.eye(5)[[rng.permutation(5)[:n] for _ in range(3)]] * rng.choice([0.0, 0.6, 1.0], (3, n, 1))
    filtered = PoseFilter(structure.poses(), contents, OFTEN, ALPHABET, np.log([0.7, 1e-12, 0.3]))
    filtered.observe_pattern(np.array([0, 1]))
    filtered.act(last)
    owners, predicted = filtered.predicted_patterns()
    now_of, shown_now = filtered.shown_patterns()
    assert owners.tolist() == now_of.tolist() == [0, 2]
    poses, rows = structure.poses(), filtered.rows
    for place, owner in enumerate(owners):
        shown = pose_patterns(poses, filtered._contents, OFTEN, ALPHABET)
        own = np.flatnonzero((rows.owner == owner) & (rows.weight > 1e-5))
        total = sum(rows.weight[own])
        now = sum(rows.weight[row] / total * shown[rows.table[row], rows.pose[row]] for row in own)
        np.testing.assert_allclose(shown_now[place], now, rtol=0, atol=1e-9)
        for action in range(2):
            right = np.zeros(len(ALPHABET))
            for row in own:
                failed_before = rows.events[row, FAILED + action]
                slip = 0.05 * (1 - failed_before) + 0.4 * failed_before
                after = shown[rows.table[row], poses.successors[rows.pose[row], action]]
                stayed = shown[rows.table[row], rows.pose[row]]
                right += rows.weight[row] / total * ((1 - slip) * after + slip * stayed)
            np.testing.assert_allclose(predicted[action, place], 0.98 * right + 0.02 / len(ALPHABET), rtol=0, atol=1e-9)


def test_before_the_first_look_a_new_object_is_in_one_pose_of_each_class_and_a_known_one_in_any():
    poses = BOX.poses()
    contents = np.stack((np.zeros((BOX.n_registers, 5)), np.eye(5)[: BOX.n_registers] * 0.6))
    rows = (own := PoseFilter(poses, contents, OFTEN, ALPHABET)).rows
    new, known = rows.take(np.flatnonzero(rows.owner == 0)), rows.take(np.flatnonzero(rows.owner == 1))
    assert (new.pose.tolist(), new.weight.tolist()) == (poses.first.tolist(), poses.first_weights.tolist())
    assert new.start.tolist() == list(range(len(poses.first)))
    assert (known.pose.tolist(), set(known.start.tolist())) == (list(range(len(poses.registers))), {0})
    assert known.weight == pytest.approx(1 / len(poses.registers))
    assert rows.table.tolist() == rows.owner.tolist()
    assert not rows.events.any()
    np.testing.assert_allclose(own._shown, symbol_probabilities(contents, OFTEN.repeat), rtol=1e-12)


def test_learned_is_the_table_of_a_row_that_is_likelier_than_all_others_else_their_mean():
    own = PoseFilter(RING.poses(), np.zeros((3, RING.n_registers, 5)), OFTEN, ALPHABET)
    tables, events = np.arange(4.0)[:, None, None] * np.ones((RING.n_registers, 5)), np.zeros((4, FAILED + 2))
    events[:, 0] = 1.0, 2.0, 3.0, 4.0
    owner, weight, nothing = np.array([0, 0, 2, 2]), np.array([0.7, 0.3, 0.5, 0.5]), np.zeros(4, np.int64)
    own.rows, own._contents = Rows(owner, nothing, nothing, weight, np.array([3, 1, 2, 0]), events), tables
    learned, is_possible = own.learned()
    assert is_possible.tolist() == [True, False, True]
    assert (learned[0] == 3).all()
    assert learned[2] == pytest.approx(1.0)
    assert own.learned_contents(1) is None
    assert own.expected_events()[:, 0] == pytest.approx([0.7 * 1 + 0.3 * 2, 0, 3.5])
