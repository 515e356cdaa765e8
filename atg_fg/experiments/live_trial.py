"""A trial in which someone else acts: it takes in looks and what was done, and proposes what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Detection, Evidence
from atg_fg.core.records import TrialRecord, TrialStep
from atg_fg.engines import begin_trial
from atg_fg.policies import Choice, Policy


class LiveTrial:
    """One trial, look by look.

    Args:
        memory: The robot memory when the trial begins; it is not changed.
        parameters: α, δ and whether to learn within the trial.
        engine: Name of the inference engine.
        policy: Proposes actions; it may say that no more are needed.
        rng: The trial's own generator.
        teaching: Proposes actions when no more are needed for the verdict, so that there is more to learn from.

    Attributes:
        record: The trial so far. The action of its last step is the one proposed, until ``acted`` says what was done.
    """

    def __init__(
        self,
        memory: RobotMemory,
        parameters: ModelParameters,
        engine: str,
        policy: Policy,
        rng: np.random.Generator,
        teaching: Policy | None = None,
    ) -> None:
        self._inference = begin_trial(engine, memory, parameters)
        self._policy, self._rng, self._teaching = policy, rng, teaching
        self.record = TrialRecord(memory.names, memory.assumptions)

    def look(self, evidence: Evidence) -> TrialStep:
        """Take in a look and return the step, with the action that is proposed next; ``None`` if no more is needed.

        Args:
            evidence: What the look says about the pattern shown; its detection goes into the record.

        Raises:
            InvalidInputError: It is an action's turn.
            ImpossibleEvidenceError: The evidence has probability zero under the model; nothing has changed.
        """
        inference = self._inference
        inference.observe(evidence)
        choice = self._policy.choose(inference, self._rng)
        if choice.action is None and self._teaching is not None:
            choice = self._teaching.choose(inference, self._rng)
            choice = Choice(choice.action, choice.expected_entropies, "learn")
        bound = None if inference.exact else inference.total_variation_bound
        step = TrialStep(
            evidence.detection or self._unseen,
            evidence.pattern,
            inference.identity(),
            inference.log_evidence,
            {"confidences": list(evidence.confidences)} if any(evidence.confidences) else {},
            choice.expected_entropies,
            choice.action,
            choice.purpose,
            bound,
        )
        self.record.steps.append(step)
        return step

    def acted(self, actions: Sequence[int]) -> None:
        """Take in what was done, whether it was proposed or not; between two actions nothing was seen.

        Raises:
            InvalidInputError: Nothing was seen yet, no action is given, or there is no such action.
        """
        if not self.record.steps or not actions:
            raise InvalidInputError(f"actions: {list(actions)}; expected some, after a look")
        nothing = Evidence.of_detection(self.record.assumptions.alphabet, self._unseen)
        for number, action in enumerate(actions):
            if number:
                self.look(nothing)
            self._inference.act(action)
            self.record.steps[-1] = replace(self.record.steps[-1], action=action)

    def ended(self) -> TrialRecord:
        """Return the record without the proposal that nobody followed."""
        steps = self.record.steps
        if steps:
            steps[-1] = replace(steps[-1], action=None)
        return self.record

    @property
    def _unseen(self) -> Detection:
        return (None,) * len(self.record.assumptions.alphabet.slots)
