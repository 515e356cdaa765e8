"""A scalar of an object: the conjugate normal, by hand and against the joint density, and what is no reading."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import Moments, ObjectSense
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.learning.structured_memory import StructuredMemory
from tests.normal import log_density

WEIGHT = ObjectSense("weight", 0.5, 0.6, 0.08, unit="kg", revealed_by=("flip",))
LENGTH = ObjectSense("length", 2.0, 1.0, 0.5, unit="m", relative=False)
ASSUMED = Assumptions(5, 3, ("flip",), PatternAlphabet(("front",), 4), (WEIGHT, LENGTH))


def test_the_next_reading_by_hand() -> None:
    # Of a fresh object: N(2, 1 + 0.25). After one reading of 3: precision 1 + 4, mean (2 + 12) / 5.
    mean, variance = LENGTH.next_reading(np.array([0.0, 1.0]), np.array([0.0, 3.0]), 0.25)
    np.testing.assert_allclose(mean, [2.0, 2.8])
    np.testing.assert_allclose(variance, [1.25, 0.45])
    value, deviation = LENGTH.estimate(Moments(1, 3.0, 9.0), 0.25)
    assert (value, deviation) == (pytest.approx(2.8), pytest.approx(math.sqrt(0.2)))


@given(st.lists(st.floats(0.01, 50.0), min_size=1, max_size=6))
def test_readings_one_after_the_other_are_their_joint_density(readings: list[float]) -> None:
    values = [math.log(reading) for reading in readings]
    total = 0.0
    for number, value in enumerate(values):
        before = WEIGHT.moments_of(readings[:number])
        mean, variance = WEIGHT.next_reading(np.array([float(before.count)]), np.array([before.total]), 0.08**2)
        total += log_density([value], mean[0], variance.reshape(1, 1))
    covariance = 0.6**2 * np.ones((len(values),) * 2) + 0.08**2 * np.eye(len(values))
    assert total == pytest.approx(log_density(values, math.log(0.5), covariance), rel=1e-7, abs=1e-7)


def test_an_error_that_is_learned_goes_from_what_was_stated_to_what_readings_scatter() -> None:
    sense = ObjectSense("length", 2.0, 1.0, 0.5, relative=False, worth=4.0)
    assert sense.variance([]) == pytest.approx(0.25)
    # Two objects with two readings each, 0.2 apart: (4 · 0.25 + 2 · 0.02) / (4 + 2).
    few = [sense.moments_of([1.0, 1.2]), sense.moments_of([3.0, 3.2])]
    assert sense.variance(few) == pytest.approx(1.04 / 6)
    rng = np.random.default_rng(0)
    many = [sense.moments_of(rng.normal(mean, 0.1, 5).tolist()) for mean in rng.normal(2.0, 1.0, 400)]
    assert math.sqrt(sense.variance(many)) == pytest.approx(0.1, rel=0.1)
    assert LENGTH.variance(many) == 0.25  # known


def test_readings_alone_say_what_is_like_most_and_what_they_err_by() -> None:
    rng = np.random.default_rng(0)
    trials = [(weight * np.exp(rng.normal(0.0, 0.08, 9))).tolist() for weight in np.exp(rng.normal(-0.7, 0.6, 400))]
    sense = ObjectSense.of_readings("weight", trials, ("flip",))
    assert (sense.relative, sense.revealed_by, math.isinf(sense.worth)) == (True, ("flip",), False)
    assert (math.log(sense.typical), sense.spread, sense.error) == pytest.approx((-0.7, 0.6, 0.08), abs=0.05)
    shifted = ObjectSense.of_readings("weight", [[value - 1.0 for value in each] for each in trials])
    assert not shifted.relative


@pytest.mark.parametrize(
    "trials", [[], [[]], [[0.5]], [[0.0, 0.0], [0.0]], [[0.3, 0.3], [0.3]], [[1e12], [1e-12, 1e-11]], [[-1e12, 1e12]]]
)
def test_few_readings_make_a_sense_that_is_sure_of_nothing(trials: list[list[float]]) -> None:
    sense = ObjectSense.of_readings("weight", trials)
    assert sense.spread >= 3 * sense.error
    assert math.isfinite(sense.worth)


def test_an_atg_keeps_its_readings_through_copies_and_merges() -> None:
    memory = RobotMemory(ASSUMED)
    for name, readings in (("one", [0.3, 0.31]), ("two", [0.6])):
        graph = AspectTransitionGraph(name, ASSUMED)
        graph.add_aspect((0,))
        for reading in readings:
            graph.measure((("weight", reading), ("length", 1.0)))
        memory.add(graph)
    before = memory.copy()
    assert before == memory
    assert memory["one"].measured["weight"].count == 2
    assert "weight 0.306 kg (2 readings)" in memory["one"].table().note
    memory.merge("one", "two")
    assert memory["one"].measured["weight"].count == 3
    assert memory["one"].measured["weight"].total == pytest.approx(sum(map(math.log, (0.3, 0.31, 0.6))))
    memory.learn([1], [], "one", measured=[(("weight", 0.32),)])
    memory.unmerge("two")
    assert memory["two"] == before["two"]
    assert memory["one"].measured["weight"].total == pytest.approx(sum(map(math.log, (0.3, 0.31, 0.32))))


def test_raw_trials_that_change_hands_take_their_readings_along() -> None:
    memory = StructuredMemory(ASSUMED)
    for reading in (0.3, 0.6, 0.31):
        name = memory.learn([0], [], None, measured=[(("weight", reading),)])
        memory.learn_shared(name, [(0,)], [], measured=[(("weight", reading),)])
    memory.reassign({2: "object-000"})
    assert memory.names == ("object-000", "object-001")
    assert memory["object-000"].measured["weight"] == WEIGHT.moments_of([0.3]).plus(WEIGHT.moments_of([0.31]))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"error": 0.0}, "object sense 'weight': error 0.0; expected a number of at least 1e-09"),
        ({"error": float("nan")}, "object sense 'weight': error nan; expected"),
        ({"typical": -1.0}, "object sense 'weight': typical: -1.0; expected a number above 0"),
        ({"spread": 100.0}, "spread 100, error 0.08; expected at most 250 times as much"),
        ({"name": ""}, "object sense: name: ''; expected a text that is not empty"),
    ],
)
def test_what_is_no_sense_is_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidInputError) as raised:
        ObjectSense(**{"name": "weight", "typical": 0.5, "spread": 0.6, "error": 0.08, **options})  # type: ignore[arg-type]
    assert message in str(raised.value)


@pytest.mark.parametrize(
    ("senses", "message"),
    [
        ((WEIGHT, WEIGHT), "name 'weight' is taken"),
        ((ObjectSense("front", 1.0, 1.0, 1.0),), "name 'front' is taken"),
        ((ObjectSense("weight", 1.0, 1.0, 1.0, revealed_by=("lift",)),), "revealed by 'lift'; expected some of: flip"),
        ((WEIGHT, LENGTH, ObjectSense("age", 1.0, 1.0, 1.0)), "expected at most 2 of them"),
        ("weight", "expected at most 2 of them"),
    ],
)
def test_senses_that_a_robot_cannot_have_are_refused(senses: object, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        Assumptions(5, 3, ("flip",), PatternAlphabet(("front",), 4), senses)  # type: ignore[arg-type]
