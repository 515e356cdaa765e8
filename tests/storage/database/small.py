"""Small memories, and a trial, for tests of the database."""

from __future__ import annotations

import numpy as np

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialRecord
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import run_trial
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.policies import EntropyPolicy
from atg_fg.worlds.registry import make_world
from tests.learning.worlds import cubes, trial_of

ARCUBES = arcube_assumptions()


def a_record(seed: int, memory: RobotMemory | None = None, **world_options: float) -> TrialRecord:
    """A trial of four actions in the ideal world."""
    inference = begin_trial("bayes-filter", memory or RobotMemory(ARCUBES), ModelParameters())
    return run_trial(make_world("ideal", **world_options), inference, EntropyPolicy(), 4, np.random.default_rng(seed))


def add_cube(memory: RobotMemory, number: int, matched: str | None = None) -> str:
    """Let a memory learn a trial with a cube."""
    trial = trial_of(cubes(8)[number], 8, np.random.default_rng(number), missing=0.05)
    patterns = [Evidence.of_detection(ARCUBES.alphabet, look).pattern for look in trial.detections]
    with memory.transaction():
        name = memory.learn(patterns, list(trial.actions), matched)
        memory.learn_shared(name, trial.detections, trial.actions)
    return name


def plain(n_objects: int = 3) -> RobotMemory:
    memory = RobotMemory(ARCUBES)
    for number in range(n_objects):
        add_cube(memory, number)
    return memory


def structured(n_objects: int = 3) -> StructuredMemory:
    memory = StructuredMemory(ARCUBES)
    for number in range(n_objects):
        add_cube(memory, number)
    return memory
