"""What is learned where looks err: whose errors they are."""

import numpy as np
import pytest

from atg_fg.learning.evidence_learner import EvidenceLearner
from atg_fg.learning.learner import StructureLearner
from tests.learning.worlds import ARCUBES, cubes, prisms, trial_of


def sampled(objects, **noise):
    learner, rng = StructureLearner(ARCUBES), np.random.default_rng(0)
    evidence = EvidenceLearner(learner)
    for number, each in enumerate(objects):
        learner.learn(str(number), trial_of(each, 10, rng, **noise), rests=True)
        evidence.learn()
    return evidence


def test_errors_that_recur_slot_by_slot_are_the_structures():
    assert sampled(prisms(8)).is_mistaken


@pytest.mark.parametrize("noise", [{"wrong": 0.2, "missing": 0.2}, {"slip": 0.05, "wrong": 0.1, "missing": 0.1}])
def test_looks_that_are_wrong_as_a_whole_are_the_detectors(noise):
    evidence = sampled(cubes(16), **noise)
    assert not evidence.is_mistaken
    assert evidence.noise.alone < 0.05
