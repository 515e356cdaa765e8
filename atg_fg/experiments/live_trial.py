"""A trial in which someone else acts: it takes in looks and what was done, and proposes what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialRecord, TrialStep
from atg_fg.experiments.recognition_agent import RecognitionAgent
from atg_fg.policies import Choice, Policy


class LiveTrial:
    """One trial of an agent, on record look by look.

    Args:
        agent: Recognises the object and proposes actions, until no more are needed. Its memory is not changed.
        teaching: Proposes actions when no more are needed for the verdict, so that there is more to learn from.

    Attributes:
        record: The trial so far. The action of its last step is the one proposed, until ``acted`` says what was done.
    """

    def __init__(self, agent: RecognitionAgent, teaching: Policy | None = None) -> None:
        agent.reset()
        self._agent, self._teaching = agent, teaching
        self.record = TrialRecord(agent.memory.names, agent.memory.assumptions)

    def look(self, evidence: Evidence) -> TrialStep:
        """Take in a look and return the step, with the action that is proposed next; ``None`` if no more is needed.

        Of looks at rest, without an action between them, the one that says most counts alone, and is on record.

        Args:
            evidence: What the look says about the pattern shown; its detection goes into the record.

        Raises:
            ImpossibleEvidenceError: The evidence has probability zero under the model; nothing has changed.
        """
        agent, steps = self._agent, self.record.steps
        agent.observe(evidence, independent=False)
        inference = agent.inference
        counts = inference.history.evidence[-1]
        choice = agent.choice()
        if choice.action is None and self._teaching is not None:
            choice = agent.choice(self._teaching)
            choice = Choice(choice.action, choice.expected_entropies, "learn")
        step = TrialStep(
            counts.detection or (None,) * len(self.record.assumptions.alphabet.slots),
            counts.pattern,
            inference.identity(),
            inference.log_evidence,
            {"confidences": list(counts.confidences)} if any(counts.confidences) else {},
            choice.expected_entropies,
            choice.action,
            choice.purpose,
            None if inference.exact else inference.total_variation_bound,
        )
        steps[len(inference.history.evidence) - 1 :] = [step]
        return step

    def acted(self, actions: Sequence[int]) -> None:
        """Take in what was done, whether it was proposed or not; between two actions nothing was seen.

        Raises:
            InvalidInputError: Nothing was seen yet, no action is given, or there is no such action.
        """
        if not self.record.steps or not actions:
            raise InvalidInputError(f"actions: {list(actions)}; expected some, after a look")
        nothing = Evidence.of_detection(alphabet := self.record.assumptions.alphabet, (None,) * len(alphabet.slots))
        for number, action in enumerate(actions):
            if number:
                self.look(nothing)
            self._agent.did(action)
            self.record.steps[-1] = replace(self.record.steps[-1], action=action)

    def ended(self) -> TrialRecord:
        """Return the record without the proposal that nobody followed."""
        steps = self.record.steps
        if steps:
            steps[-1] = replace(steps[-1], action=None)
        return self.record
