"""How a trial went, look by look, from its record or from the engine that it was inferred with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction, told
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.checks import instance
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.core.records import TrialRecord
from atg_fg.engines import begin_trial
from atg_fg.inference.interface import Inference


class TrialCourse(NamedTuple):
    """A trial of t actions, with t + 1 looks or, if the last one is still to come or the object was lost, t.

    Attributes:
        assumptions: What the trial took for granted.
        names: Of the remembered objects.
        beliefs: After each look.
        patterns: Index of the pattern seen at each look, ``None`` where it was not complete.
        actions: Index of each action that a look followed.
        expected: Expected entropy in nats of each action, by name, before each of ``actions``; empty where the policy
            did not ask.
    """

    assumptions: Assumptions
    names: tuple[str, ...]
    beliefs: list[IdentityBelief]
    patterns: list[int | None]
    actions: list[AnyAction]
    expected: list[Mapping[str, float]]

    @property
    def chosen(self) -> list[str]:
        """Name of each action that a look followed."""
        return [told(action, self.assumptions) for action in self.actions]


def course_of(trial: TrialRecord | Inference) -> TrialCourse:
    """Return how a trial went.

    An engine does not keep what it believed before, so the trial is gone through once more with another one like it.

    Raises:
        InvalidInputError: There was no look yet, or the memory has learned since the engine's trial began.
    """
    course = _of_record(trial) if isinstance(trial, TrialRecord) else _of_inference(instance(trial, "trial", Inference))
    if not course.beliefs:
        raise InvalidInputError("trial: nothing seen yet; expected a first look")
    return course


def _of_record(record: TrialRecord) -> TrialCourse:
    steps, assumptions = record.steps, record.assumptions
    # The last action of a trial in which the object was lost has no look after it.
    followed = steps[:-1]
    actions: list[AnyAction] = [step.action for step in followed if step.action is not None]
    expected = [_by_name(assumptions, step.expected_entropies) for step in followed]
    return TrialCourse(assumptions, record.names, [step.belief for step in steps], record.patterns, actions, expected)


def _of_inference(inference: Inference) -> TrialCourse:
    memory, evidence, actions = inference.memory, inference.history.evidence, inference.history.actions
    again = begin_trial(type(inference), memory, inference.parameters, inference.prior, **inference.options)
    beliefs, expected = [], []
    for time, look in enumerate(evidence):
        again.observe(look)
        beliefs.append(again.identity())
        if time < len(actions):
            if time + 1 < len(evidence):
                expected.append(_by_name(memory.assumptions, again.expected_entropies()))
            again.act(actions[time])
    before, now = inference.identity().probabilities, again.identity().probabilities
    # An engine that samples may have been asked at other times, and have sampled other things then.
    if before.shape != now.shape or (inference.exact and not np.allclose(before, now, atol=1e-6)):
        raise InvalidInputError(
            "trial: the memory has learned since it began; expected the memory as it was then, or the trial's record"
        )
    patterns = [look.pattern for look in evidence]
    return TrialCourse(
        memory.assumptions, memory.names, beliefs, patterns, actions[: max(len(evidence) - 1, 0)], expected
    )


def _by_name(assumptions: Assumptions, entropies: FloatArray | None) -> Mapping[str, float]:
    return {} if entropies is None else dict(zip(assumptions.actions, entropies.tolist(), strict=True))
