"""The filter of one chain against the factor graph of the same chain, which GTSAM eliminates exactly."""

import gtsam
import numpy as np
import pytest

from atg_fg.core.actions import UncertainAction
from atg_fg.core.log_math import log_sum_exp
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.inference.gtsam_factors import factor
from atg_fg.learning.detector_noise import DetectorNoise
from atg_fg.learning.evidence_learner import BelievedChain
from atg_fg.learning.path_filter import PathFilter, label_likelihoods

RING = np.array([[1, 2, 0], [1, 0, 2]])
REGISTERS = np.array([[0, 1], [1, 2], [2, 0]])
ALPHABET = PatternAlphabet(("front", "top"), 3, exclusive=False)
SLIP = 0.1
#: Keys of the object, of each register's content, and of the state at each look.
OBJECT, CONTENT, STATE = 1000, 900, 800
LOOKS = [
    Evidence.of_detection(ALPHABET, (0, 2)),
    Evidence.of_detection(ALPHABET, (1, None), (0.7, None)),
    Evidence.of_slots(ALPHABET, [[0.2, 0.5, 0.3], None], (None, 1)),
    Evidence.of_detection(ALPHABET, (None, None)),
]
ACTIONS = [0, 1, 0]


@pytest.fixture
def chain():
    rng = np.random.default_rng(1)
    tables = rng.dirichlet(np.full(3, 0.5), size=(3, 3))  # two known objects and a new one, three registers
    tables[-1] = 1 / 3
    return BelievedChain(1.0, RING, REGISTERS, tables, np.log([0.3, 0.3, 0.4]), SLIP)


@pytest.fixture
def noise():
    return DetectorNoise(np.array([0.6]), np.array([0.5, 0.9]), (1 - np.eye(3)) / 2, 0.2)


def graph_of(chain, noise, n_looks, actions=ACTIONS):
    """p(O) Π_r p(C_r | O) p(S_0) Π_k p(S_k+1 | S_k, a_k) Π_k Π_slots p(look | S_k, C), as one discrete factor graph."""
    graph = gtsam.DiscreteFactorGraph()
    graph.push_back(factor([OBJECT], np.exp(chain.log_prior)))
    for register in range(3):
        graph.push_back(factor([OBJECT, CONTENT - register], chain.tables[:, register]))
    graph.push_back(factor([STATE], np.full(3, 1 / 3)))
    for time in range(n_looks):
        if time:
            action = actions[time - 1]
            sure = not isinstance(action, UncertainAction)
            moved = np.eye(3) * (0.0 if sure else action.stays)
            for index, chance in ((action, 1.0),) if sure else action.chances:
                moved[range(3), RING[index]] += chance * (1 - SLIP)
                moved[range(3), range(3)] += chance * SLIP
            graph.push_back(factor([STATE - time + 1, STATE - time], moved))
        likelihood = label_likelihoods(noise, LOOKS[time])
        for slot, weights in enumerate(LOOKS[time].slots):
            if weights is not None:
                likelihood[slot] = 0.9995 * np.array(weights) + 0.0005 * np.mean(weights)
        for slot in range(2):
            # The register that is shown depends on the state, so the factor is on all of them.
            table = np.zeros((3, 3, 3, 3))
            for state in range(3):
                shape = [1, 1, 1]
                shape[REGISTERS[state, slot]] = 3
                table[state] = likelihood[slot].reshape(shape)
            graph.push_back(factor([STATE - time, CONTENT, CONTENT - 1, CONTENT - 2], table))
    return graph


def masses(graph, key):
    """The sum of the whole product over all variables but one, for each of its values."""
    result = np.zeros(3)
    for values, mass in graph.product().enumerate():
        result[values[key]] += mass
    return result


def filtered_through(chain, noise, n_looks, actions=ACTIONS):
    """The filter after so many looks."""
    filtered = PathFilter(chain, noise, ALPHABET, chain.log_prior)
    for time in range(n_looks):
        if time:
            filtered.act(actions[time - 1])
        filtered.observe(LOOKS[time])
    return filtered


@pytest.mark.parametrize("actions", [ACTIONS, [0, UncertainAction(((0, 0.2), (1, 0.5)), 0.3), 1]])
@pytest.mark.parametrize("n_looks", [1, 2, 3, 4])
def test_identity_and_evidence_are_those_of_the_factor_graph_of_the_chain(chain, noise, n_looks, actions):
    joint = chain.log_prior + filtered_through(chain, noise, n_looks, actions).log_evidence
    of_graph = masses(graph_of(chain, noise, n_looks, actions), OBJECT)
    assert log_sum_exp(joint) == pytest.approx(np.log(of_graph.sum()), abs=1e-12)
    assert np.exp(joint - log_sum_exp(joint)) == pytest.approx(of_graph / of_graph.sum(), abs=1e-12)


def test_states_are_those_of_the_factor_graph_of_the_chain(chain, noise):
    only = np.array([0.0, -np.inf, -np.inf])
    filtered = PathFilter(chain, noise, ALPHABET, only)
    for time, look in enumerate(LOOKS[:3]):
        if time:
            filtered.act(ACTIONS[time - 1])
        filtered.observe(look)
    graph = graph_of(chain._replace(log_prior=np.log([1.0, 1e-300, 1e-300])), noise, 3)
    of_graph = masses(graph, STATE - 2)
    poses = filtered.poses_of(0)
    assert [poses.get(state, 0.0) for state in range(3)] == pytest.approx(of_graph / of_graph.sum(), abs=1e-7)


@pytest.mark.parametrize("owner", range(3))
def test_what_was_shown_and_which_labels_are_right_are_those_of_the_factor_graph_of_the_chain(chain, noise, owner):
    filtered, n_looks = filtered_through(chain, noise, 3), 3
    shown, right, total = np.zeros((n_looks, 9)), np.zeros((n_looks, 2)), 0.0
    for values, mass in graph_of(chain, noise, n_looks).product().enumerate():
        if values[OBJECT] == owner:
            total += mass
            for time in range(n_looks):
                symbols = [values[CONTENT - register] for register in REGISTERS[values[STATE - time]].tolist()]
                shown[time, ALPHABET.index(symbols)] += mass
                right[time] += mass * np.equal(symbols, LOOKS[time].detection or (None, None))
    np.testing.assert_allclose(filtered.smoothed_patterns(owner), shown / total, atol=1e-4)
    owners, now = filtered.shown_patterns()
    np.testing.assert_allclose(now[owners.tolist().index(owner)], shown[-1] / total, atol=1e-4)
    for look, told, expected in zip(LOOKS, filtered.right_labels(owner, LOOKS[:n_looks]), right / total, strict=False):
        for label, probability, exact in zip(look.detection or (), told, expected, strict=False):
            assert probability is None if label is None else probability == pytest.approx(exact, abs=1e-6)


@pytest.mark.parametrize("owner", range(3))
def test_contents_are_what_was_known_of_that_object_times_what_was_seen(chain, noise, owner):
    """With one state there is one path."""
    alone = chain._replace(successors=np.zeros((2, 1), dtype=np.int64), registers=REGISTERS[:1])
    filtered = PathFilter(alone, noise, ALPHABET, chain.log_prior)
    filtered.observe(LOOKS[0])
    expected = chain.tables[owner] * np.vstack((label_likelihoods(noise, LOOKS[0]), np.ones(3)))
    np.testing.assert_allclose(filtered.learned_contents(owner), expected / expected.sum(axis=1, keepdims=True))


def test_a_look_is_predicted_as_probable_as_it_then_is_and_a_copy_goes_on_alone(chain, noise):
    filtered = filtered_through(chain, noise, 3)
    before = filtered.log_evidence.copy()
    filtered.copy().observe(LOOKS[0])
    owners, predicted = filtered.predicted_patterns()
    for action in range(2):
        then = np.zeros((3, 9))
        for pattern, symbols in enumerate(ALPHABET.symbols):
            twin = filtered.copy()
            twin.act(action)
            twin.observe_pattern(symbols)
            then[:, pattern] = np.exp(twin.log_evidence)
        np.testing.assert_allclose(predicted[action], (then / then.sum(axis=1, keepdims=True))[owners], atol=1e-4)
    filtered.act(0)
    filtered.observe(LOOKS[3])  # nothing was seen
    np.testing.assert_allclose(filtered.log_evidence, before, atol=1e-6)
