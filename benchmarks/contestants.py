"""What is timed: anything that can follow a trial, look by look, and decide what to do next."""

from __future__ import annotations

import statistics
from abc import ABC, abstractmethod
from typing import Any, Final

import numpy as np

from atg_fg.core.compact.compact_memory import CompactMemory
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.engines import ENGINES, begin_trial
from atg_fg.engines.gtsam_elimination import GtsamElimination
from atg_fg.inference.interface import Inference
from atg_fg.storage.presets import preset
from benchmarks.measuring import Clock, Sample
from benchmarks.memories import Course

#: What the others are held against.
REFERENCE: Final = "bayes-filter"
LARGE_MEMORY: Final = "large-memory"
#: Exact engines and peers agree with the reference to this, in probability and in nats.
TOLERANCE: Final = 1e-9
#: The naive way is timed on so many of all patterns.
N_NAIVE_PATTERNS: Final = 2
#: Looks after which the naive way decides; its graphs grow with the trial.
N_NAIVE_LOOKS: Final = 3


class Contestant(ABC):
    """One way to recognise an object, with its tables for one memory and one preset.

    Attributes:
        name: Of the engine or library.
        preset: Name of the model's parameters.
        remark: What a reader of its times has to know.
        same_model: Whether its identity has to be that of ``REFERENCE``.
        tolerance: How far it may be from that, if it is exact; ``None`` if it is no exact one.
    """

    name: str
    preset: str
    remark: str = ""
    same_model: bool = True
    tolerance: float | None = TOLERANCE

    @abstractmethod
    def begin(self) -> None:
        """Begin a trial."""

    @abstractmethod
    def look(self, evidence: Evidence) -> None:
        """Take in a look at a whole pattern."""

    @abstractmethod
    def act(self, action: int) -> None:
        """Predict what an action does."""

    @abstractmethod
    def decide(self) -> FloatArray | None:
        """Return the expected entropy of each action in nats, shape [A], or ``None`` if it scores them otherwise."""

    @abstractmethod
    def identity(self) -> FloatArray:
        """Return p(O | z_0:t, a_1:t), shape [H]."""


class EngineContestant(Contestant):
    """An engine of this library.

    Args:
        name: In ``ENGINES``.
        preset_name: Name of a preset.
        memory: The robot memory.
        options: Of the engine.

    Raises:
        AtgError: The engine does not take this preset or this memory.
    """

    def __init__(self, name: str, preset_name: str, memory: RobotMemory, **options: Any) -> None:
        self.name, self.preset = name, preset_name
        self.same_model = not preset(preset_name).learn_structure
        self.tolerance = TOLERANCE if ENGINES[name].exact else None
        self._memory, self._options = memory, options
        self._inference: Inference
        self.begin()

    def begin(self) -> None:
        """Begin a trial, which makes the tables of the memory."""
        self._inference = begin_trial(self.name, self._memory, preset(self.preset), **self._options)

    def look(self, evidence: Evidence) -> None:
        """Take in a look at a whole pattern."""
        self._inference.observe(evidence)

    def act(self, action: int) -> None:
        """Predict what an action does."""
        self._inference.act(action)

    def decide(self) -> FloatArray:
        """Return the expected entropy of each action in nats, shape [A]."""
        return self._inference.expected_entropies()

    def identity(self) -> FloatArray:
        """Return p(O | z_0:t, a_1:t), shape [H]."""
        return self._inference.identity().probabilities


def large_memory(preset_name: str, memory: RobotMemory) -> EngineContestant:
    """Return the engine for large memories on arrays, as one would use it, and by its own way at any size."""
    return EngineContestant(LARGE_MEMORY, preset_name, CompactMemory.of(memory), n_exact=0)


def follow(contestant: Contestant, course: Course, clock: Clock) -> Sample:
    """Let a contestant follow a trial, with a decision before each action, and time it.

    Returns:
        Seconds of ``step`` (an action and the look after it) and ``decision``, each the median over the trial; of the
        first and last decision; and of the whole trial, in which only the beginning and the first look are not counted
        elsewhere.
    """
    steps, decisions = [], []
    start = clock()
    contestant.begin()
    contestant.look(course.evidence[0])
    for action, evidence in zip(course.actions, course.evidence[1:], strict=True):
        asked = clock()
        contestant.decide()
        decided = clock()
        contestant.act(action)
        contestant.look(evidence)
        decisions.append(decided - asked)
        steps.append(clock() - decided)
    return {
        "step": statistics.median(steps),
        "decision": statistics.median(decisions),
        "first decision": decisions[0],
        "last decision": decisions[-1],
        "trial": clock() - start,
    }


def agreement(contestant: Contestant, reference: Contestant, course: Course) -> dict[str, Any]:
    """Return the largest difference of both in identity and expected entropy (nats) along a trial."""
    worst: dict[str, float | None] = {"identity": 0.0, "expected_entropy": 0.0}
    for each in (contestant, reference):
        each.begin()
    for time, evidence in enumerate(course.evidence):
        for each in (contestant, reference):
            if time:
                each.act(course.actions[time - 1])
            each.look(evidence)
        pairs = {
            "identity": (contestant.identity(), reference.identity()),
            "expected_entropy": (contestant.decide(), reference.decide()),
        }
        for name, (own, other) in pairs.items():
            difference = None if own is None or other is None else float(np.abs(own - other).max())
            before = worst[name]
            worst[name] = None if difference is None or before is None else max(before, difference)
    largest = max(value for value in worst.values() if value is not None)
    tolerance = contestant.tolerance
    return {**worst, "tolerance": tolerance, "agrees": None if tolerance is None else largest <= tolerance}


class NaiveGraphs:
    """Eq. 3 the way it is written: one hypothetical graph for each action and pattern, each eliminated with GTSAM.

    Only a few of the patterns are timed, of one action; the seconds are scaled up to all.
    """

    name: Final = "gtsam, each hypothetical graph eliminated"
    preset: Final = "paper"

    def __init__(self, memory: RobotMemory, course: Course) -> None:
        inference = begin_trial("gtsam", memory, preset(self.preset))
        for time in range(N_NAIVE_LOOKS):
            if time:
                inference.act(course.actions[time - 1])
            inference.observe(course.evidence[time])
        assert isinstance(inference, GtsamElimination)
        model = inference.model
        patterns = np.eye(model.n_patterns)[:N_NAIVE_PATTERNS]
        self._observations = np.stack([model.likelihood(Evidence(pattern)) for pattern in patterns])
        self._transition, self._graph = model.transition(0), inference.graph()
        n_graphs = model.n_actions * model.n_patterns
        self._scale = n_graphs / N_NAIVE_PATTERNS
        self.remark = f"after {N_NAIVE_LOOKS} looks; timed on {N_NAIVE_PATTERNS} of {n_graphs} graphs and scaled up"

    def sample(self, clock: Clock) -> Sample:
        """Return the seconds of a decision."""
        start = clock()
        self._graph.expected_entropy_by_elimination(self._transition, self._observations)
        return {"decision": (clock() - start) * self._scale}
