"""Readings of the object as a whole: a factor on O alone, the same in every exact engine and in the factor graph."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from scipy import integrate

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import begin_trial
from atg_fg.inference.explanations import best_explanations, sample_explanations, surprise
from atg_fg.inference.factor_graph import RecognitionGraph
from atg_fg.inference.joint_factor_graph import JointRecognitionGraph
from tests.normal import log_density
from tests.small import EXACT_ENGINES, each_of

ABLE = [name for name in EXACT_ENGINES if name != "large-memory"]
WEIGHT = ObjectSense("weight", 0.5, 0.6, 0.08, unit="kg", revealed_by=("flip",))
SIZE = ObjectSense("size", 0.1, 0.02, 0.01, unit="m", relative=False, revealed_by=("flip",))
LEARNING = ModelParameters(0.5, 0.05, learn_in_trial=True)
FIXED = ModelParameters(0.5, 0.05, learn_in_trial=False)


def memory_of(*weights: Sequence[float], senses: tuple[ObjectSense, ...] = (WEIGHT,)) -> RobotMemory:
    """A memory of boxes that look alike, each felt a few times."""
    assumptions = Assumptions(5, 3, ("flip", "look"), PatternAlphabet(("front",), 4), senses)
    memory = RobotMemory(assumptions)
    for number, readings in enumerate(weights):
        graph = AspectTransitionGraph(f"box-{number}", assumptions)
        graph.add_aspect((0,))
        graph.add_aspect((1,))
        graph.add_transition(0, 0, 1)
        for reading in readings:
            graph.measure((("weight", reading),))
        memory.add(graph)
    return memory


def next_density(readings: Sequence[float], reading: float, sense: ObjectSense = WEIGHT) -> float:
    """p(reading | readings before of the same object), by the joint normal density of all of them."""
    values = [math.log(each) if sense.relative else each for each in (*readings, reading)]
    m0 = math.log(sense.typical) if sense.relative else sense.typical

    def joint(points: Sequence[float]) -> float:
        if not points:
            return 1.0
        cov = sense.spread**2 * np.ones((len(points),) * 2) + sense.error**2 * np.eye(len(points))
        return math.exp(log_density(points, m0, cov))

    return joint(values) / joint(values[:-1])


@each_of(ABLE)
@pytest.mark.parametrize("parameters", [FIXED, LEARNING])
def test_readings_multiply_what_looks_say_by_the_density_of_each(engine: str, parameters: ModelParameters) -> None:
    memory = memory_of([0.3, 0.32], [0.6], [])
    looks = [({"front": 0, "weight": 0.31}, "flip"), ({"front": 1}, "look"), ({"front": 1, "weight": 0.29}, "flip")]
    with_weight, without = (begin_trial(engine, memory, parameters) for _ in range(2))
    for look, action in looks:
        with_weight.observe(look)
        without.observe({"front": look["front"]})
        with_weight.act(action)
        without.act(action)
    kept = [[0.3, 0.32], [0.6], [], []]
    factor = np.array([next_density(each, 0.31) * next_density([*each, 0.31], 0.29) for each in kept])
    expected = without.identity().probabilities * factor
    np.testing.assert_allclose(with_weight.identity().probabilities, expected / expected.sum(), rtol=0, atol=1e-12)
    assert with_weight.log_evidence == pytest.approx(without.log_evidence + math.log(expected.sum()), abs=1e-9)
    for hypothesis in range(4):  # readings say nothing of the aspects of an object
        for ours, theirs in zip(
            with_weight.smoothed_aspects(hypothesis), without.smoothed_aspects(hypothesis), strict=True
        ):
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)


@each_of(ABLE)
@pytest.mark.parametrize("parameters", [FIXED, LEARNING])
def test_expected_entropy_counts_on_what_an_action_reveals(engine: str, parameters: ModelParameters) -> None:
    memory = memory_of([0.3, 0.32], [0.6], [0.5, 0.52, 0.51])
    inference = begin_trial(engine, memory, parameters)
    inference.observe({"front": 0})
    identity = inference.identity().probabilities
    flip, look = inference.expected_entropies()
    blind = begin_trial(engine, memory_of([], [], [], senses=()), parameters)
    blind.observe({"front": 0})
    assert look == pytest.approx(blind.expected_entropies()[1], abs=1e-9)
    # Brute force: every pattern, and an adaptive integral over the logarithm of the weight.
    enumerated = begin_trial("enumeration", memory, parameters)
    enumerated.observe({"front": 0})
    predicted = np.array([[_joint(enumerated, 0, pattern, h) for pattern in range(4)] for h in range(4)])
    np.testing.assert_allclose(predicted.sum(axis=1), identity, rtol=0, atol=1e-12)
    kept = [[0.3, 0.32], [0.6], [0.5, 0.52, 0.51], []]

    def entropy_density(value: float) -> float:
        densities = np.array([next_density(each, math.exp(value)) for each in kept])
        joint = predicted * densities[:, None]
        total = joint.sum(axis=0)
        weighted = total * np.log(total) - (joint * np.log(np.maximum(joint, 1e-300))).sum(axis=0)
        return float((weighted + joint[-1] * math.log(2)).sum())

    ends = [math.log(value) for value in (0.004, 0.05, 0.2, 0.25, 0.31, 0.4, 0.5, 0.55, 0.6, 0.8, 1.0, 6.0, 70.0)]
    integral = sum(integrate.quad(entropy_density, a, b, epsabs=1e-10)[0] for a, b in itertools.pairwise(ends))
    assert flip == pytest.approx(integral, abs=2e-6)
    assert flip < look - 0.3


def _joint(inference: object, action: int, pattern: int, hypothesis: int) -> float:
    """p(O, z | a), by the model's own tables."""
    model = inference.model  # type: ignore[attr-defined]
    mass = inference.aspect_belief[hypothesis] @ model.transition(action)[hypothesis]  # type: ignore[attr-defined]
    likelihood = np.zeros(4)
    likelihood[pattern] = 1.0
    return float(mass @ model.pattern_likelihood(Evidence(likelihood))[hypothesis])


def test_two_senses_are_counted_on_together() -> None:
    memory = memory_of([0.3], [0.6], senses=(WEIGHT, SIZE))
    memory["box-0"].measure((("size", 0.12),))
    memory["box-1"].measure((("size", 0.08),))
    both = begin_trial("bayes-filter", memory, LEARNING)
    both.observe({"front": 0})
    one = begin_trial("bayes-filter", memory_of([0.3], [0.6]), LEARNING)
    one.observe({"front": 0})
    exact = begin_trial("enumeration", memory, LEARNING)
    exact.observe({"front": 0})
    assert both.expected_entropies()[0] < one.expected_entropies()[0]
    np.testing.assert_allclose(both.expected_entropies(), exact.expected_entropies(), atol=1e-6)


def test_the_factor_graph_has_a_factor_on_o_alone_for_each_reading() -> None:
    inference = begin_trial("gtsam", memory_of([0.3, 0.32], [0.6]), LEARNING)
    inference.observe({"front": 0, "weight": 0.31})
    inference.act("flip")
    inference.observe({"weight": 0.3})
    graph = RecognitionGraph(inference.chain(), inference.model.n_unseen)
    scopes = [graph.names_of(index) for index in range(graph.graph.size())]
    assert scopes.count(("O",)) == 3  # the prior and two readings
    np.testing.assert_allclose(graph.identity().probabilities, inference.identity().probabilities, atol=1e-12)
    assert graph.log_evidence() == pytest.approx(inference.log_evidence, abs=1e-9)


def test_explanations_samples_and_surprise_know_what_was_felt() -> None:
    inference = begin_trial("bayes-filter", memory_of([0.3, 0.32], [0.6, 0.61]), FIXED)
    inference.observe({"front": 0, "weight": 0.6})
    inference.act("flip")
    inference.observe({"front": 1, "weight": 0.62})
    chain = inference.chain()
    best = best_explanations(chain, 40)
    by_object = np.zeros(3)
    for each in best:
        by_object[each.hypothesis] += each.probability
    np.testing.assert_allclose(by_object, inference.identity().probabilities, atol=1e-6)
    assert best[0].hypothesis == 1
    drawn = sample_explanations(chain, 2000, np.random.default_rng(0))
    assert np.mean([each.hypothesis == 1 for each in drawn]) == pytest.approx(by_object[1], abs=0.03)
    assert surprise(chain).sum() == pytest.approx(-inference.log_evidence, abs=1e-9)


def test_two_boxes_that_look_alike_are_told_apart_together() -> None:
    memory = memory_of([0.3, 0.32], [0.6, 0.61])
    chains = []
    for weight in (0.31, 0.33):
        inference = begin_trial("bayes-filter", memory, FIXED)
        inference.observe({"front": 0, "weight": weight})
        chains.append(inference.chain())
    first, second = JointRecognitionGraph(chains, 3).identities()
    alone = [begin_trial("enumeration", memory, FIXED) for _ in range(2)]
    joint = np.zeros((3, 3))
    for each, weight in zip(alone, (0.31, 0.33), strict=True):
        each.observe({"front": 0, "weight": weight})
    p, q = (each.identity().probabilities for each in alone)
    for i in range(3):
        for j in range(3):
            joint[i, j] = p[i] * q[j] * ((i != j) if min(i, j) < 2 and max(i, j) < 3 and not i == j == 2 else 2 / 3)
    joint /= joint.sum()
    np.testing.assert_allclose(first.probabilities, joint.sum(axis=1), atol=1e-12)
    np.testing.assert_allclose(second.probabilities, joint.sum(axis=0), atol=1e-12)


@pytest.mark.parametrize("engine", ["particle", "mean-field", "gibbs", "loopy-bp", "learned-structure"])
def test_approximate_engines_know_what_was_felt(engine: str) -> None:
    inference = begin_trial(engine, memory_of([0.3, 0.32], [0.6, 0.61]), FIXED)
    inference.observe({"front": 0, "weight": 0.61})
    exact = begin_trial("enumeration", memory_of([0.3, 0.32], [0.6, 0.61]), FIXED)
    exact.observe({"front": 0, "weight": 0.61})
    if engine == "mean-field":  # sure of itself, as it always is
        assert inference.identity().most_probable_object == exact.identity().most_probable_object == 1
    else:
        np.testing.assert_allclose(inference.identity().probabilities, exact.identity().probabilities, atol=0.05)
    assert inference.expected_entropies()[0] < inference.expected_entropies()[1] + 1e-9


def test_a_reading_that_fits_nothing_rules_nothing_out() -> None:
    for engine in ABLE:
        inference = begin_trial(engine, memory_of([0.3], [0.6]), FIXED)
        inference.observe({"front": 0, "weight": 1e9})
        assert np.isfinite(inference.log_evidence)
        assert inference.identity().unseen > 0.9


@pytest.mark.parametrize(
    ("look", "message"),
    [
        ({"front": 0, "weight": float("nan")}, "look: weight: nan; expected a number above 0, in kg"),
        ({"front": 0, "weight": -0.3}, "look: weight: -0.3; expected a number above 0, in kg"),
        ({"front": 0, "weight": "300 g"}, "look: weight: '300 g'; expected a number above 0, in kg"),
        ({"front": 0, "weight": True}, "look: weight: True; expected a number above 0, in kg"),
        ({"front": 0, "mass": 0.3}, "look: slot 'mass'; expected one of: front, weight"),
    ],
)
def test_what_is_no_reading_is_refused_and_changes_nothing(look: dict[str, object], message: str) -> None:
    inference = begin_trial("bayes-filter", memory_of([0.3]), FIXED)
    with pytest.raises(InvalidInputError) as raised:
        inference.observe(look)
    assert str(raised.value) == message
    assert not inference.history.evidence


def test_an_engine_for_large_memories_says_that_it_takes_no_readings() -> None:
    with pytest.raises(InvalidInputError, match="'large-memory': senses of the object, 'weight'; expected none"):
        begin_trial("large-memory", memory_of([0.3]), FIXED)
