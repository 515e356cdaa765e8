"""Readings of the object as a whole in the sampler, against the joint density of what is of one object."""

from __future__ import annotations

import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.learning import object_kernels
from atg_fg.learning.duplicates import find_duplicates
from atg_fg.learning.raw_trials import RawTrial, Recording
from atg_fg.learning.structured_memory import StructuredMemory
from tests.learning.test_kernels import chain_of, drawn_trials
from tests.normal import log_density

LENGTH = ObjectSense("length", 2.0, 1.0, 0.5, relative=False)
READINGS = [[1.0, 1.2], [1.1], [3.0], [], [0.9, 1.0, 1.1]]


def log_evidence(readings: list[float]) -> float:
    """ln p(readings | one object)."""
    return log_density(readings, 2.0, np.ones((len(readings),) * 2) + 0.25 * np.eye(len(readings))) if readings else 0.0


def felt_trials(n_trials=5):
    trials = [RawTrial(((0,),), (), (), (), ((tuple(("length", value) for value in each)),)) for each in READINGS]
    felt = Recording.of(trials, 3, (LENGTH,)).felt
    return drawn_trials(np.random.default_rng(0), n_trials)._replace(felt=felt)


def test_a_cluster_weighs_what_its_readings_say_of_those_of_a_trial():
    trials = felt_trials()
    chain, _ = chain_of(trials, [0, 0, 1, 1, -1], [0, 0, 0, 0, 0])
    found = object_kernels.cluster_weights(trials, 4, chain.clusters, 2, 0.7)
    of_clusters = [[*READINGS[0], *READINGS[1]], READINGS[2], []]
    expected = np.array([log_evidence([*each, *READINGS[4]]) - log_evidence(each) for each in of_clusters])
    expected[2] += 0.7
    np.testing.assert_allclose(found[:3] - found[0], expected - expected[0], atol=1e-10)
    # A trial in which nothing was felt says nothing.
    chain.clusters.owner[:] = [0, 0, 1, -1, 2]
    np.testing.assert_array_equal(object_kernels.cluster_weights(trials, 3, chain.clusters, 5, 0.7)[:5], 0.0)


def test_evidence_of_a_partition_is_the_joint_density_up_to_a_constant():
    trials = felt_trials()
    differences = []
    for owner in ([0, 0, 1, 1, 2], [0, 1, 2, 3, 4], [0, 0, 0, 0, 0]):
        chain, _ = chain_of(trials, owner, [0] * 5)
        groups = [
            [value for each, own in zip(READINGS, owner, strict=True) if own == k for value in each] for k in range(5)
        ]
        differences.append(object_kernels.log_felt(trials, chain.clusters) - sum(map(log_evidence, groups)))
    assert differences == pytest.approx([differences[0]] * 3, abs=1e-10)


def look_alikes(weights, alphabet):
    """A memory that is shown boxes of the same looks, with these weights."""
    weight = ObjectSense("weight", 0.5, 0.6, 0.08, unit="kg")
    assumptions = Assumptions(6, 3, ("turn",), alphabet, (weight,))
    memory, verdicts = StructuredMemory(assumptions), []
    for number, reading in enumerate(weights):
        detections = [(number % 3 if k == 9 else (k % 3),) for k in range(4)]
        measured = [(), (("weight", reading),), (), ()]
        trial = RawTrial(tuple(detections), (0, 0, 0), (), (), tuple(measured))
        verdict = memory.evidence.conclude(trial)
        best = int(verdict.probabilities.argmax())
        matched = verdict.names[best] if best < len(verdict.names) else None
        verdicts.append(matched)
        name = memory.learn([each[0] for each in detections], [0, 0, 0], matched, measured=measured)
        memory.learn_shared(name, detections, [0, 0, 0], measured=measured)
    return memory, verdicts


def test_boxes_that_differ_in_weight_alone_are_told_apart_by_what_is_sampled():
    memory, verdicts = look_alikes([0.3, 0.9, 0.31, 0.88, 0.29, 0.92], PatternAlphabet(("front",), 3, exclusive=False))
    assert verdicts == [None, None, "object-000", "object-001", "object-000", "object-001"]
    assert [memory[name].measured["weight"].count for name in memory.names] == [3, 3]


def test_duplicates_weigh_alike():
    weight = ObjectSense("weight", 0.5, 0.6, 0.08, unit="kg")
    assumptions = Assumptions(6, 3, ("turn",), PatternAlphabet(("front",), 30), (weight,))
    memory = RobotMemory(assumptions)
    for name, reading in (("one", 0.3), ("two", 0.31), ("three", 0.9)):
        graph = AspectTransitionGraph(name, assumptions)
        for symbol in range(3):
            graph.add_aspect((symbol,))
        for source, target in ((0, 1), (1, 2), (2, 0)):
            graph.add_transition(source, 0, target)
        graph.measure((("weight", reading),))
        memory.add(graph)
    found = find_duplicates(memory, ModelParameters(1e-8, 1e-8, learn_in_trial=True))
    assert [(each.keep, each.drop) for each in found] == [("one", "two")]
