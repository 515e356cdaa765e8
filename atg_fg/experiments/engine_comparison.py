"""Inference engines compared on the same trials: how far their posteriors are from exact, and what a decision costs."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError, TooLargeError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.core.statistics import wilson_interval
from atg_fg.engines import ENGINES, begin_trial
from atg_fg.experiments.exploration import learned_memory
from atg_fg.inference.expected_entropy import best_actions
from atg_fg.inference.interface import Inference
from atg_fg.policies import RandomPolicy
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.base import detection_of
from atg_fg.worlds.registry import make_world

#: The exact engine that the others are held against, and timed against.
REFERENCE: Final = "bayes-filter"


@dataclass(frozen=True)
class ComparisonPlan:
    """The trials that engines are compared on.

    Attributes:
        n_trials: Number of trials.
        n_actions: Random actions a trial.
        n_objects: |O|.
        n_remembered: Objects in the memory, each turned at random ``n_learning_actions`` times.
        n_learning_actions: See above.
        parameters: α, δ and whether to learn within the trial.
        world_options: Noise of the world: ``slip``, ``wrong``, ``missing``.
    """

    n_trials: int = 50
    n_actions: int = 6
    n_objects: int = 100
    n_remembered: int = 20
    n_learning_actions: int = 10
    parameters: ModelParameters = field(default_factory=ModelParameters)
    world_options: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("n_trials", "n_actions", "n_objects", "n_learning_actions"):
            if getattr(self, name) < 1:
                raise InvalidInputError(f"{name}: {getattr(self, name)}; expected a whole number of at least 1")
        if not 0 <= self.n_remembered <= self.n_objects:
            raise InvalidInputError(f"n_remembered: {self.n_remembered}; expected 0 to {self.n_objects}")

    def learned_memory(self, rng: np.random.Generator) -> RobotMemory:
        """Return a memory of the first objects, each turned at random in the ideal world."""
        cubes = make_arcubes(self.n_objects, seed=0)[: self.n_remembered]
        return learned_memory(arcube_assumptions(self.n_objects), cubes, RandomPolicy(), self.n_learning_actions, rng)


@dataclass
class EngineRecord:
    """What was measured of one engine.

    Attributes:
        total_variation: Of p(O) to the reference's after each look.
        same_decision: Whether the engine's best action is one of the reference's, after each look.
        time_ratios: Seconds of each decision (a look, its expected entropies) over the reference's, measured in turn.
        refused: Why the engine did not do the trials, if it is too small for them.
    """

    total_variation: list[float] = field(default_factory=list)
    same_decision: list[bool] = field(default_factory=list)
    time_ratios: list[float] = field(default_factory=list)
    refused: str | None = None


def compare(
    plan: ComparisonPlan, engines: Sequence[str], seed: int = 0, on_trial: Callable[[], None] | None = None
) -> dict[str, EngineRecord]:
    """Let engines follow the same trials, look by look, side by side with the reference.

    Args:
        plan: The trials.
        engines: Names of engines.
        seed: Seed of memory and trials.
        on_trial: Called after each trial.
    """
    memory_seed, *trial_seeds = np.random.SeedSequence(seed).spawn(1 + plan.n_trials)
    memory = plan.learned_memory(np.random.default_rng(memory_seed))
    records = {engine: EngineRecord() for engine in engines}
    for trial_seed in trial_seeds:
        course = _drawn_course(plan, memory, np.random.default_rng(trial_seed))
        for engine, record in records.items():
            if record.refused is None:
                _follow(engine, memory, plan.parameters, course, record)
        if on_trial is not None:
            on_trial()
    return records


def _drawn_course(plan: ComparisonPlan, memory: RobotMemory, rng: np.random.Generator) -> list[tuple[Evidence, int]]:
    """Return what is seen and done in a trial with random actions: (evidence, action after it)."""
    world = make_world("ideal", cubes=make_arcubes(plan.n_objects, seed=0), **plan.world_options)
    observation, _ = world.reset(seed=int(rng.integers(2**31)))
    course = []
    for action in rng.integers(len(memory.assumptions.actions), size=plan.n_actions + 1):
        evidence = Evidence.of_detection(memory.assumptions.alphabet, detection_of(observation))
        course.append((evidence, int(action)))
        observation, *_ = world.step(action)
    return course


def _follow(
    engine: str,
    memory: RobotMemory,
    parameters: ModelParameters,
    course: Sequence[tuple[Evidence, int]],
    record: EngineRecord,
) -> None:
    """Let an engine and the reference go through a trial in turn, and note how they differ."""
    try:
        tried, reference = begin_trial(engine, memory, parameters), begin_trial(REFERENCE, memory, parameters)
        for look, (evidence, action) in enumerate(course):
            # Each engine goes first in every other look: the second one finds warm caches.
            pair = [tried, reference] if look % 2 else [reference, tried]
            timed = {id(inference): _timed_decision(inference, evidence) for inference in pair}
            (seconds, expected), (reference_seconds, exact) = timed[id(tried)], timed[id(reference)]
            record.total_variation.append(total_variation(tried, reference))
            record.same_decision.append(best_actions(expected)[0] in best_actions(exact))
            record.time_ratios.append(seconds / reference_seconds)
            if look < len(course) - 1:
                tried.act(action)
                reference.act(action)
    except TooLargeError as error:
        record.refused = str(error)


def _timed_decision(inference: Inference, evidence: Evidence) -> tuple[float, FloatArray]:
    start = time.perf_counter()
    inference.observe(evidence)
    expected = inference.expected_entropies()
    return time.perf_counter() - start, expected


def total_variation(one: Inference, other: Inference) -> float:
    """Return ½ Σ |p(O) − q(O)| of two engines' beliefs over identity, *unseen* as one state."""
    p, q = one.identity(), other.identity()
    return float(np.abs(p.objects - q.objects).sum() + abs(p.unseen - q.unseen)) / 2


def summarise(records: dict[str, EngineRecord]) -> dict[str, Any]:
    """Return for each engine whether it is exact, its errors, its decisions, and its cost relative to the reference."""
    return {engine: _summary(engine, record) for engine, record in records.items()}


def _summary(engine: str, record: EngineRecord) -> dict[str, Any]:
    summary: dict[str, Any] = {"exact": ENGINES[engine].exact, "refused": record.refused}
    if record.refused is None:
        same, looks = sum(record.same_decision), len(record.same_decision)
        quartiles = statistics.quantiles(record.time_ratios, n=4)
        summary |= {
            "looks": looks,
            "total_variation": {"mean": statistics.fmean(record.total_variation), "worst": max(record.total_variation)},
            "same_decision": {"rate": same / looks, "interval95": list(wilson_interval(same, looks))},
            "time_ratio": {"median": quartiles[1], "quartiles": [quartiles[0], quartiles[2]]},
        }
    return summary
