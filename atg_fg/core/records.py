"""What happened in a trial, as plain data: look by look, in short, and as a database keeps it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import Detection, FloatArray
from atg_fg.core.table import Bar, Cell, HtmlTable, _symbols, shortened

#: How a trial can end.
Verdict: TypeAlias = Literal["novel", "known", "lost", "undecided"]


@dataclass(frozen=True, eq=False)
class TrialStep:
    """One look and the action chosen after it.

    Attributes:
        detection: The symbol seen in each slot, ``None`` where nothing was.
        pattern: Index of the pattern if the detection was complete.
        belief: p(O | z_0:t, a_1:t).
        log_evidence: ln p(z_0:t | a_1:t).
        expected_entropies: Of each action in nats, shape [A], if the policy looked at them.
        action: Index of the action chosen next; ``None`` at the end of the trial.
        truth: What the world's ``info`` said, for scoring only.
        purpose: What the action is for, or why the policy ended the trial, if the policy says so.
        total_variation_bound: How far the belief may be from exact, if the engine is not but has a bound.
    """

    detection: Detection
    pattern: int | None
    belief: IdentityBelief
    log_evidence: float
    truth: dict[str, Any]
    expected_entropies: FloatArray | None = None
    action: int | None = None
    purpose: str | None = None
    total_variation_bound: float | None = None


@dataclass
class TrialRecord:
    """Everything that happened in a trial.

    Attributes:
        names: Names of the remembered objects, in the order of their index.
        assumptions: What the trial took for granted.
        steps: The looks, t + 1 of them for t actions; one less if the object was lost.
        lost_truth: What the world's ``info`` said when it lost the object, ``None`` if it did not.
    """

    names: tuple[str, ...]
    assumptions: Assumptions
    steps: list[TrialStep] = field(default_factory=list)
    lost_truth: dict[str, Any] | None = None

    @property
    def belief(self) -> IdentityBelief:
        """The belief at the end of the trial."""
        return self.steps[-1].belief

    @property
    def verdict(self) -> Verdict:
        """How the trial ended: ``undecided`` if nothing at all was seen, ``lost`` if the world lost the object."""
        if self.lost_truth is not None:
            return "lost"
        if all(symbol is None for step in self.steps for symbol in step.detection):
            return "undecided"
        return "novel" if self.belief.is_novel else "known"

    @property
    def judged_novel(self) -> bool:
        """Whether the object is judged novel at the end."""
        return self.verdict == "novel"

    @property
    def matched(self) -> str | None:
        """Name of the ATG the object is matched to, ``None`` if it is not judged known."""
        best = self.belief.most_probable_object
        return self.names[best] if self.verdict == "known" and best is not None else None

    @property
    def patterns(self) -> list[int | None]:
        """Index of the pattern seen at each look, ``None`` where it was not complete."""
        return [step.pattern for step in self.steps]

    @property
    def detections(self) -> list[Detection]:
        """The symbol seen in each slot at each look, ``None`` where nothing was."""
        return [step.detection for step in self.steps]

    @property
    def actions(self) -> list[int]:
        """Index of each action, in order."""
        return [step.action for step in self.steps if step.action is not None]

    def _repr_html_(self) -> str:
        return record_view(self)._repr_html_()

    def __repr__(self) -> str:
        return f"<{record_view(self).title}>"


@dataclass(frozen=True)
class TrialOutcome:
    """What scoring and learning need of a trial.

    Attributes:
        verdict: How it ended.
        matched: Name of the ATG the object was matched to.
        patterns: Index of the pattern to learn from at each look, ``None`` where it was not complete.
        actions: Index of each action.
        object: What was presented, by the world's truth.
        detections: The symbol seen in each slot at each look, ``None`` where nothing was.
    """

    verdict: Verdict
    matched: str | None
    patterns: tuple[int | None, ...]
    actions: tuple[int, ...]
    object: object
    detections: tuple[Detection, ...]

    @classmethod
    def of(cls, record: TrialRecord, patterns: Sequence[int | None] | None = None) -> TrialOutcome:
        """Return the outcome of a trial that has just been run, with ``patterns`` in place of those seen if given."""
        truth = record.steps[0].truth["object"]
        seen = record.patterns if patterns is None else patterns
        detections = tuple(record.detections)
        return cls(record.verdict, record.matched, tuple(seen), tuple(record.actions), truth, detections)

    def _repr_html_(self) -> str:
        return outcome_view(self)._repr_html_()


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


_LOOKS: Final = 40


def record_view(record: TrialRecord) -> HtmlTable:
    """Return a table of a trial, look by look."""
    rows = [_step_row(number, step, record) for number, step in enumerate(record.steps)]
    ending = f"{record.verdict}{_of(record.matched)}" if rows else "nothing seen yet"
    title = f"Trial of {len(record.actions)} actions: {ending}"
    headings = ("look", f"seen ({', '.join(record.assumptions.alphabet.slots)})", "most probable object", "", "unseen")
    return HtmlTable(title, (*headings, "entropy, nats", "then"), shortened(rows, _LOOKS, "looks"))


def _step_row(number: int, step: TrialStep, record: TrialRecord) -> tuple[Cell, ...]:
    belief, best = step.belief, step.belief.most_probable_object
    name = "–" if best is None else record.names[best]
    share = 0.0 if best is None else float(belief.objects[best])
    then = [] if step.action is None else [record.assumptions.actions[step.action]]
    then += [] if step.purpose is None else [f"({step.purpose})"]
    return (
        str(number),
        _symbols(step.detection),
        name,
        Bar(share, f"{share:.3f}"),
        Bar(belief.unseen, f"{belief.unseen:.3f}"),
        f"{belief.entropy:.3f}",
        " ".join(then),
    )


def outcome_view(outcome: TrialOutcome) -> HtmlTable:
    """Return how a trial ended, what it was about, and what was seen."""
    title = f"Trial of {len(outcome.actions)} actions: {outcome.verdict}{_of(outcome.matched)}"
    seen = "; ".join(_symbols(detection) for detection in outcome.detections[:_LOOKS])
    return HtmlTable(title, ("object presented", "seen"), ((str(outcome.object), seen),))


def _of(matched: str | None) -> str:
    return "" if matched is None else f", {matched}"
