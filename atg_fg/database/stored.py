"""A trial and an experiment as a database has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from atg_fg.errors import InvalidInputError
from atg_fg.patterns import Detection
from atg_fg.trial import TrialRecord, Verdict


@dataclass(frozen=True)
class Experiment:
    """What trials were run for.

    Attributes:
        kind: Such as ``"trial"`` or ``"test"``.
        parameters: All that it was run with, as JSON knows it.
        seed: Of the experiment, if it has one.
        version: Of ``atg-fg`` that ran it.
        number: In the database, from 1; 0 if it is not there yet.
    """

    kind: str
    parameters: Mapping[str, Any]
    seed: int | None
    version: str
    number: int = 0


@dataclass(frozen=True)
class StoredStep:
    """One look of a stored trial, and the action chosen after it.

    Attributes:
        observed: The symbol seen in each slot, ``None`` where nothing was.
        pattern: Index of the pattern if the detection was complete.
        unseen: p(O unseen) given all up to here.
        entropy: Of identity, in nats.
        log_evidence: ln p(z_0:t | a_1:t); ``None`` where it was not kept.
        expected_entropy: Of each action by name, in nats, if the policy looked at them.
        action: Name of the action chosen next; ``None`` at the end.
        purpose: What it is for, if the policy said so.
        truth: What the world's ``info`` said.
    """

    observed: Detection
    pattern: int | None
    unseen: float
    entropy: float
    log_evidence: float | None
    expected_entropy: dict[str, float] | None
    action: str | None
    purpose: str | None
    truth: dict[str, Any]


@dataclass(frozen=True)
class StoredTrial:
    """A trial as a database has it.

    Attributes:
        experiment: Number of its experiment, ``None`` if it belongs to none.
        number: Of the trial in its experiment, from 0.
        verdict: How it ended.
        matched: Name of the ATG that the object was matched to.
        learned: Name of the ATG that it went to, ``None`` if nothing was learned in this memory.
        learned_patterns: What was learned if that is not what was seen.
        lost_truth: What the world said when it lost the object.
        steps: The looks.
    """

    experiment: int | None
    number: int
    verdict: Verdict
    matched: str | None
    learned: str | None
    learned_patterns: tuple[int | None, ...] | None
    lost_truth: dict[str, Any] | None
    steps: tuple[StoredStep, ...]

    @classmethod
    def of(
        cls, record: TrialRecord, learned: str | None = None, learned_patterns: Sequence[int | None] | None = None
    ) -> StoredTrial:
        """Return what is kept of a trial that was run; its number is given when it is written."""
        names = record.assumptions.actions
        steps = [
            StoredStep(
                step.detection,
                step.pattern,
                float(step.belief.unseen),
                float(step.belief.entropy),
                float(step.log_evidence),
                None
                if step.expected_entropies is None
                else dict(zip(names, step.expected_entropies.tolist(), strict=True)),
                None if step.action is None else names[step.action],
                step.purpose,
                step.truth,
            )
            for step in record.steps
        ]
        patterns = None if learned_patterns is None else tuple(learned_patterns)
        return cls(None, 0, record.verdict, record.matched, learned, patterns, record.lost_truth, tuple(steps))

    @classmethod
    def of_line(cls, line: Mapping[str, Any], place: str) -> StoredTrial:
        """Return what is kept of a trial in a log, which has a line for it.

        Raises:
            InvalidInputError: Not such a line; the message names ``place``.
        """
        try:
            looks, truths, actions = line["observed"], line["truth"], [*line["actions"], None]
            purposes = line.get("purpose", [None] * len(looks))
            steps = [
                StoredStep(
                    tuple(look), None, line["unseen"][t], line["entropy"][t], None, None, action, purposes[t], truths[t]
                )
                for t, (look, action) in enumerate(zip(looks, actions, strict=False))
            ]
            patterns = tuple(line["learned"]) if "learned" in line else None
            lost = truths[-1] if line["verdict"] == "lost" else None
            return cls(None, 0, line["verdict"], line["matched"], None, patterns, lost, tuple(steps))
        except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
            raise InvalidInputError(f"{place}: {error!r}; expected a trial") from error

    def line(self) -> dict[str, Any]:
        """Return the trial as a log of trials has it (``trial_log.summary_of``)."""
        truths, purposes = [step.truth for step in self.steps], [step.purpose for step in self.steps]
        return {
            "verdict": self.verdict,
            "matched": self.matched,
            "observed": [list(step.observed) for step in self.steps],
            "actions": [step.action for step in self.steps if step.action is not None],
            "unseen": [step.unseen for step in self.steps],
            "entropy": [step.entropy for step in self.steps],
            **({"purpose": purposes} if any(purposes) else {}),
            "truth": truths if self.lost_truth is None else [*truths, self.lost_truth],
            **({} if self.learned_patterns is None else {"learned": list(self.learned_patterns)}),
        }
