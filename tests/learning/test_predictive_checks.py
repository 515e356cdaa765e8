"""A memory of looks that err: what it says of itself, and what it warns of."""

from contextlib import closing

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.predictive_checks import predictive_checks, summary_of_evidence
from atg_fg.learning.structured_memory import StructuredMemory, memory_for
from atg_fg.policies import make_policy
from atg_fg.worlds.registry import make_world

LEARNED = ModelParameters(learn_structure=True)


@pytest.fixture(scope="module")
def memory():
    """Learned from 14 trials of three objects before a detector."""
    with closing(make_world("detector", n_objects=3, wrong=0.1)) as world:
        memory = memory_for(LEARNED, RobotMemory(world.unwrapped.assumptions))
        for number in range(14):
            inference = begin_trial("learned-structure", memory, LEARNED)
            learn_from(run_trial(world, inference, make_policy("random"), 8, np.random.default_rng(number)), memory)
    return memory


def test_it_says_how_often_looks_err_and_what_moves_the_objects(memory):
    summary = summary_of_evidence(memory)
    assert summary["weight"] == 1.0
    assert summary["wrong"] == pytest.approx(0.1, abs=0.07)
    assert summary["states"] == 8
    assert summary["objects"] == 3
    assert summary["warnings"] == []


def test_more_atgs_than_objects_are_warned_of(memory):
    told = memory.assumptions
    fewer = Assumptions(2, told.n_aspects, told.actions, told.alphabet)
    twin = StructuredMemory(fewer)
    for trial in memory.learner.trials[:1]:
        for _ in range(3):
            patterns = [Evidence.of_detection(told.alphabet, look).pattern for look in trial.detections]
            twin.learn_shared(twin.learn(patterns, list(trial.actions), None), trial.detections, trial.actions)
            twin.reassign({number: f"object-{number:03d}" for number in range(len(twin.learner.trials))})
    assert [each for each in predictive_checks(twin) if each.startswith("3 ATGs, but n_objects is 2")]


def test_a_trial_of_noise_alone_is_warned_of(memory):
    twin, told = memory.copy(), memory.assumptions
    rng = np.random.default_rng(3)
    looks = [(int(label),) for label in rng.integers(8, size=40)]
    patterns = [Evidence.of_detection(told.alphabet, look).pattern for look in looks]
    twin.learn_shared(twin.learn(patterns, [0] * 39, None), looks, [0] * 39)
    assert any("trial 14 is less probable than labels drawn at random" in each for each in predictive_checks(twin))


def test_nothing_is_said_of_a_memory_without_trials():
    with closing(make_world("detector", n_objects=3)) as world:
        assert summary_of_evidence(StructuredMemory(world.unwrapped.assumptions)) == {}


def test_a_label_that_does_not_fit_is_told_from_those_that_do(memory):
    """The object turned round twice: the second time one of its sides is called otherwise."""
    inference = begin_trial("learned-structure", memory, LEARNED)
    with closing(make_world("detector", n_objects=3)) as world:
        sides = [world.unwrapped.family.objects[0].patterns[state] for state in range(4)]
    for look in range(12):
        if look:
            inference.act(0)
        label = sides[look % 4] if look != 6 else ((sides[2][0] + 1) % 8,)
        inference.observe(Evidence.of_detection(memory.assumptions.alphabet, label))
    mistakes = {look: probability for look, _, probability in inference.mistakes()}
    assert max(mistakes, key=mistakes.get) == 6
    assert mistakes[6] > 0.8
