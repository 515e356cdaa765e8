"""Inference engines compared on the same trials: how far their posteriors are from exact, and what a decision costs."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.checks import MANY, instance, sequence, whole_number
from atg_fg.core.errors import InvalidInputError, TooLargeError
from atg_fg.core.looks import evidence_in
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray, read_only
from atg_fg.core.recordings import RecordedTrial
from atg_fg.core.records import TrialRecord
from atg_fg.core.statistics import wilson_interval
from atg_fg.engines import begin_trial, engine_for
from atg_fg.engines.options import check_known, name_and_options
from atg_fg.experiments.exploration import learned_memory
from atg_fg.inference.expected_entropy import best_actions
from atg_fg.inference.interface import Inference
from atg_fg.policies import RandomPolicy
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.base import detection_of
from atg_fg.worlds.registry import make_world

#: The exact engine that the others are held against, and timed against; and the one that knows of kinds, where the
#: parameters say that these are learned.
REFERENCE: Final = "bayes-filter"
REFERENCE_OF_KINDS: Final = "learned-structure"


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
            whole_number(getattr(self, name), name, 1, MANY)
        if not 0 <= self.n_remembered <= self.n_objects:
            raise InvalidInputError(f"n_remembered: {self.n_remembered}; expected 0 to {self.n_objects}")

    def learned_memory(self, rng: np.random.Generator) -> RobotMemory:
        """Return a memory of the first objects, each turned at random in the ideal world."""
        cubes = make_arcubes(self.n_objects, seed=0)[: self.n_remembered]
        assumptions = arcube_assumptions(self.n_objects)
        turned = RandomPolicy(), self.n_learning_actions, rng
        return learned_memory(assumptions, cubes, *turned, parameters=self.parameters)

    def drawn_course(self, memory: RobotMemory, rng: np.random.Generator) -> Course:
        """Return what is seen and done in a trial with random actions."""
        world = make_world("ideal", cubes=make_arcubes(self.n_objects, seed=0), **self.world_options)
        observation, _ = world.reset(seed=int(rng.integers(2**31)))
        # One action more than is done, so that the same seeds draw the same trials as ever.
        actions = rng.integers(len(memory.assumptions.actions), size=self.n_actions + 1)[:-1]
        looks = [Evidence.of_detection(memory.assumptions.alphabet, detection_of(observation))]
        for action in actions:
            observation, *_ = world.step(action)
            looks.append(Evidence.of_detection(memory.assumptions.alphabet, detection_of(observation)))
        return Course(looks, [int(action) for action in actions])


class Course(NamedTuple):
    """What is seen and done in a trial: t + 1 looks, and the t actions between them."""

    looks: Sequence[Evidence]
    actions: Sequence[int]

    @classmethod
    def of(cls, trial: RecordedTrial | TrialRecord, assumptions: Assumptions) -> Course:
        """Return what was seen and done in a trial of a recording, or in one that was run.

        Raises:
            InvalidInputError: It has a label or an action that is unknown under these assumptions.
        """
        if isinstance(trial, RecordedTrial):
            looks = [look.evidence(assumptions) for look in trial.looks]
            return cls(looks, [assumptions.action_index(action) for action in trial.actions])
        instance(trial, "trial", TrialRecord)
        looks = [evidence_in(assumptions.alphabet, step.detection, step.truth) for step in trial.steps]
        return cls(looks, trial.actions)


@dataclass(frozen=True, eq=False)
class EngineRecord:
    """What was measured of one engine, decision by decision: a look, and the expected entropies after it.

    Attributes:
        exact: Whether the engine says that it is.
        total_variation: ½ Σ |p(O) − q(O)| to the reference, shape [looks of all trials].
        same_decision: Whether the engine's best action is one of the reference's, shape [looks].
        seconds: Of each decision, shape [looks].
        reference_seconds: Of the reference, measured in turn with the engine, shape [looks].
        refused: Why the engine did not do the trials, if it is too small for them; ``None`` if it did.
    """

    exact: bool
    total_variation: FloatArray
    same_decision: NDArray[np.bool_]
    seconds: FloatArray
    reference_seconds: FloatArray
    refused: str | None = None

    @property
    def time_ratios(self) -> FloatArray:
        """Seconds of each decision over the reference's, shape [looks]."""
        return self.seconds / self.reference_seconds


def compare(
    plan: ComparisonPlan,
    engines: Sequence[str | type[Inference]],
    seed: int = 0,
    on_trial: Callable[[], None] | None = None,
) -> dict[str, EngineRecord]:
    """Let engines follow the same trials, drawn at random, side by side with the reference.

    Args:
        plan: The trials.
        engines: As for ``compare_engines``.
        seed: Seed of memory and trials.
        on_trial: Called after each trial.
    """
    memory_seed, *trial_seeds = np.random.SeedSequence(seed).spawn(1 + plan.n_trials)
    memory = plan.learned_memory(np.random.default_rng(memory_seed))
    courses = [plan.drawn_course(memory, np.random.default_rng(trial_seed)) for trial_seed in trial_seeds]
    return compare_engines(engines, memory, courses, plan.parameters, on_trial)


def compare_engines(
    engines: Sequence[str | type[Inference]],
    memory: RobotMemory,
    trials: Sequence[RecordedTrial | TrialRecord | Course],
    parameters: ModelParameters | None = None,
    on_trial: Callable[[], None] | None = None,
) -> dict[str, EngineRecord]:
    """Let engines follow trials of one's own, look by look, side by side with the reference, ``bayes-filter``.

    If the parameters say that kinds of objects are learned (preset ``learned``), the reference is
    ``learned-structure``, and engines that know nothing of kinds take each object for a plain ATG.

    Args:
        engines: Names, with options if need be (``"particle(n_particles=500)"``), ``module:Class``, or classes.
        memory: What the robot remembers when each of the trials begins; it is not changed.
        trials: Of a recording (``Recording.trials``), records of trials that were run, or looks with actions.
        parameters: Of the model.
        on_trial: Called after each trial.

    Returns:
        What was measured, by the engine as it was written, or by the name of a class.

    Raises:
        UnknownNameError: No engine has this name.
        InvalidInputError: An engine has no such option or does not know the model; a trial does not fit the memory; or
            there is none.
    """
    parameters = ModelParameters() if parameters is None else instance(parameters, "parameters", ModelParameters)
    assumptions = instance(memory, "memory", RobotMemory).assumptions
    courses = [
        each if isinstance(each, Course) else Course.of(each, assumptions) for each in sequence(trials, "trials")
    ]
    if not courses:
        raise InvalidInputError("trials: none; expected at least one")
    reference = REFERENCE_OF_KINDS if parameters.learn_structure else REFERENCE
    engine_for(reference, parameters)
    tried = {
        each if isinstance(each, str) else engine_for(each).name: _Tried.of(each, parameters)
        for each in sequence(engines, "engines")
    }
    for course in courses:
        for each in tried.values():
            if each.refused is None:
                each.follow(memory, parameters, reference, course)
        if on_trial is not None:
            on_trial()
    return {name: each.record() for name, each in tried.items()}


class _Decision(NamedTuple):
    total_variation: float
    same: bool
    seconds: float
    reference_seconds: float


@dataclass
class _Tried:
    """An engine that is compared, and what was measured of it so far."""

    engine: type[Inference]
    options: dict[str, Any]
    decisions: list[_Decision] = field(default_factory=list)
    refused: str | None = None

    @classmethod
    def of(cls, engine: str | type[Inference], parameters: ModelParameters) -> _Tried:
        name, options = name_and_options(engine) if isinstance(engine, str) else (engine, {})
        found = engine_for(name, replace(parameters, learn_structure=False))
        check_known(found, found.name, options)
        return cls(found, options)

    def follow(self, memory: RobotMemory, parameters: ModelParameters, against: str, course: Course) -> None:
        """Let the engine and the reference go through a trial in turn, and note how they differ."""
        try:
            known = parameters if self.engine.knows_structure else replace(parameters, learn_structure=False)
            tried = begin_trial(self.engine, memory, known, **self.options)
            reference = begin_trial(against, memory, parameters)
            for look, evidence in enumerate(course.looks):
                # Each engine goes first in every other look: the second one finds warm caches.
                pair = [tried, reference] if look % 2 else [reference, tried]
                timed = {id(inference): _timed_decision(inference, evidence) for inference in pair}
                (seconds, expected), (reference_seconds, exact) = timed[id(tried)], timed[id(reference)]
                same = best_actions(expected)[0] in best_actions(exact)
                distance = total_variation(tried, reference)
                self.decisions.append(_Decision(distance, same, seconds, reference_seconds))
                if look < len(course.actions):
                    tried.act(course.actions[look])
                    reference.act(course.actions[look])
        except TooLargeError as error:
            self.refused = str(error)

    def record(self) -> EngineRecord:
        columns = np.array(self.decisions, dtype=float).reshape(-1, len(_Decision._fields)).T
        distance, same, seconds, reference_seconds = map(read_only, columns)
        return EngineRecord(
            self.engine.exact, distance, read_only(same.astype(bool)), seconds, reference_seconds, self.refused
        )


def _timed_decision(inference: Inference, evidence: Evidence) -> tuple[float, FloatArray]:
    start = time.perf_counter()
    inference.observe(evidence)
    expected = inference.expected_entropies()
    return time.perf_counter() - start, expected


def total_variation(one: Inference, other: Inference) -> float:
    """Return ½ Σ |p(O) − q(O)| of two engines' beliefs over identity, *unseen* as one state."""
    p, q = one.identity(), other.identity()
    return float(np.abs(p.objects - q.objects).sum() + abs(p.unseen - q.unseen)) / 2


def summarise(records: Mapping[str, EngineRecord]) -> dict[str, Any]:
    """Return for each engine whether it is exact, its errors, its decisions, and its cost: as ``--json`` writes it."""
    return {engine: _summary(record) for engine, record in records.items()}


def _summary(record: EngineRecord) -> dict[str, Any]:
    summary: dict[str, Any] = {"exact": record.exact, "refused": record.refused}
    if record.refused is None:
        same, looks = int(record.same_decision.sum()), len(record.same_decision)
        low, median, high = np.quantile(record.time_ratios, (0.25, 0.5, 0.75)).tolist()
        distance = record.total_variation
        summary |= {
            "looks": looks,
            "total_variation": {"mean": statistics.fmean(distance), "worst": float(distance.max())},
            "same_decision": {"rate": same / looks, "interval95": list(wilson_interval(same, looks))},
            "time_ratio": {"median": median, "quartiles": [low, high]},
            "errors": distance.tolist(),
            "seconds": record.seconds.tolist(),
            "reference_seconds": record.reference_seconds.tolist(),
        }
    return summary
