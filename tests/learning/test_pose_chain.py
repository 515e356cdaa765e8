"""A trial under a structure as a factor graph: GTSAM, a forward pass and enumeration say the same, and so does the
filter where contents are known."""

import itertools
import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from atg_fg.core.actions import UncertainAction
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import Evidence
from atg_fg.inference.chain import forward_pass
from atg_fg.inference.factor_graph import RecognitionGraph
from atg_fg.inference.history import History
from atg_fg.learning.pose_chain import MAX_STATES, pose_chain, repeated_actions
from atg_fg.learning.pose_filter import PoseFilter
from atg_fg.learning.rates import Rates
from tests.learning.completions import completions
from tests.learning.oracle import Structure
from tests.learning.worlds import BOX, RING, RING_WORLD, objects_of, trial_of

ALPHABET = RING_WORLD.alphabet
OFTEN = Rates(slip=0.05, wrong=0.02, repeat=1e-12)
#: An action that failed fails again.
TOGETHER = replace(OFTEN, slip_again=0.6)
CONTENTS = np.eye(5)[np.array([[0, 1, 2], [0, 2, 1], [3, 4, 0], [0, 1, 4]])]
PRIOR = np.array([0.1, 0.2, 0.3, 0.4])


def history_of(seed, missing=0.0, n_actions=3):
    (shown,) = objects_of(RING, [[0, 1, 2]])
    trial = trial_of(shown, n_actions, np.random.default_rng(seed), slip=0.1, wrong=0.1, missing=missing)
    return History([Evidence.of_detection(ALPHABET, look) for look in trial.detections], list(trial.actions))


def enumerated(chain):
    """p(O, z) and p(X_s | z) of a chain, by the sum over every course of poses."""
    times = range(len(chain.widths))
    identity, marginals = np.zeros(len(chain.prior)), [np.zeros(width) for width in chain.widths]
    for o, poses in itertools.product(range(len(chain.prior)), itertools.product(*map(range, chain.widths))):
        weight = chain.prior[o] * chain.initial[o, poses[0]]
        for time in times:
            weight *= chain.likelihoods[time][o, poses[time]]
            if time:
                weight *= chain.transitions[time - 1][o, poses[time - 1], poses[time]]
        identity[o] += weight
        for time in times:
            marginals[time][poses[time]] += weight
    return identity, [marginal / identity.sum() for marginal in marginals]


@pytest.mark.parametrize(("seed", "missing"), [(0, 0.0), (1, 0.0), (2, 0.5)])
def test_every_way_to_infer_agrees(seed, missing):
    history = history_of(seed, missing)
    chain = pose_chain(RING.poses(), CONTENTS, PRIOR, TOGETHER, ALPHABET, history)
    identity, marginals = enumerated(chain)
    graph = RecognitionGraph(chain, n_unseen=1)
    belief = graph.identity()
    by_graph = np.append(belief.objects, belief.unseen)
    np.testing.assert_allclose(by_graph, identity / identity.sum(), rtol=0, atol=1e-12)
    assert graph.log_evidence() == pytest.approx(np.log(identity.sum()), abs=1e-12)
    for time, marginal in enumerate(marginals):
        np.testing.assert_allclose(graph.aspect_marginal(time).sum(axis=0), marginal, rtol=0, atol=1e-12)
    forward = forward_pass(chain)
    np.testing.assert_allclose(forward.log_joint, np.log(identity), rtol=0, atol=1e-12)


@pytest.mark.parametrize(("seed", "missing"), [(0, 0.0), (1, 0.3), (2, 0.5), (3, 0.0)])
def test_the_filter_is_the_forward_pass_where_contents_are_known(seed, missing):
    history = history_of(seed, missing, n_actions=6)
    chain = pose_chain(RING.poses(), CONTENTS, PRIOR, OFTEN, ALPHABET, history)
    own = PoseFilter(RING.poses(), CONTENTS, OFTEN, ALPHABET)
    forward = forward_pass(chain)
    for time, evidence in enumerate(history.evidence):
        if time:
            own.act(history.actions[time - 1])
        if evidence.pattern is None:
            own.observe_likelihood(evidence.likelihood)
        else:
            own.observe_pattern(ALPHABET.symbols[evidence.pattern])
        # Rows below 1e-9 are dropped.
        np.testing.assert_allclose(own.log_evidence, forward.log_joints[time] - np.log(PRIOR), rtol=0, atol=1e-6)
        filtered = np.zeros((len(CONTENTS), 6))
        filtered[own.rows.owner, own.rows.pose] = own.rows.weight
        np.testing.assert_allclose(filtered, forward.filtered[time], rtol=0, atol=1e-6)


@pytest.mark.parametrize("structure", [RING, BOX], ids=["ring", "box"])
@pytest.mark.parametrize("missing", [0.0, 0.4])
def test_a_chain_is_the_sum_over_poses_and_which_actions_failed(structure, missing):
    symbols = (0, 3, 1, 2)[: structure.n_registers]
    exact = Structure(2, structure.sources, 5, Fraction(1, 20), Fraction(1, 50), Fraction(3, 5))
    for seed in range(5):
        rng = np.random.default_rng(seed)
        trial = trial_of(*objects_of(structure, [symbols]), 7, rng, slip=0.4, wrong=0.1, missing=missing)
        history = History([Evidence.of_detection(ALPHABET, look) for look in trial.detections], list(trial.actions))
        chain = pose_chain(structure.poses(), np.eye(5)[[symbols]], np.ones(1), TOGETHER, ALPHABET, history)
        assert chain.initial.sum() == pytest.approx(1.0)
        expected = exact.probability(symbols, trial.detections, trial.actions)
        assert forward_pass(chain).log_joint[0] == pytest.approx(math.log(expected), abs=1e-9)


def test_actions_that_may_have_been_repeated_are_told_the_most_frequent_first():
    actions = [2, 0, UncertainAction(((1, 0.5), (3, 0.5)), 0.0), 0, UncertainAction(((1, 0.3),), 0.7), 2, 0]
    assert repeated_actions(actions, n_poses=24) == [0, 2, 1]
    assert repeated_actions(actions, n_poses=MAX_STATES // 4) == [0, 2]
    assert repeated_actions(actions, n_poses=MAX_STATES // 4 + 1) == [0]
    assert repeated_actions([0, 1], n_poses=24) == []


def test_a_new_object_in_the_graph_is_the_sum_over_all_it_may_contain():
    # Objects 0 … 59 of the graph are all contents there are: no approximation is left.
    contents = completions(RING, ALPHABET)
    assert contents.shape == (60, 3, 5)
    history = history_of(4)
    chain = pose_chain(RING.poses(), contents, np.full(60, 1 / 60), OFTEN, ALPHABET, history)
    graph = RecognitionGraph(chain, n_unseen=1)
    assert graph.log_evidence() == pytest.approx(np.logaddexp.reduce(forward_pass(chain).log_joint), abs=1e-12)


def test_a_box_in_the_graph_may_be_open_at_first():
    contents = completions(BOX, ALPHABET)
    chain = pose_chain(BOX.poses(), contents, np.full(120, 1 / 120), OFTEN, ALPHABET, history_of(5))
    graph = RecognitionGraph(chain, n_unseen=1)
    assert graph.log_evidence() == pytest.approx(np.logaddexp.reduce(forward_pass(chain).log_joint), abs=1e-12)
    np.testing.assert_array_equal(chain.initial, 1 / 4)


def test_a_trial_without_a_look_has_no_chain():
    with pytest.raises(InvalidInputError, match="nothing observed yet"):
        pose_chain(RING.poses(), CONTENTS, PRIOR, OFTEN, ALPHABET, History())
