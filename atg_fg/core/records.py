"""What happened in a trial, as plain data: look by look, in short, and as a database keeps it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal, NamedTuple, TypeAlias, get_args

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.belief import IdentityBelief, entropies
from atg_fg.core.checks import brief, sequence
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.looks import Look, confidences_in, confidences_of, evidence_of, pattern_to_learn, truth_of
from atg_fg.core.patterns import Confidences, Detection, FloatArray
from atg_fg.core.table import Bar, Cell, Table, shortened

#: How a trial can end.
Verdict: TypeAlias = Literal["novel", "known", "lost", "undecided"]

VERDICTS: Final[tuple[Verdict, ...]] = get_args(Verdict)


class Mistake(NamedTuple):
    """A label that is probably wrong.

    Attributes:
        look: From 0.
        slot: Index of it.
        probability: That the label is wrong, given the whole trial.
    """

    look: int
    slot: int
    probability: float


class Mended(NamedTuple):
    """An earlier trial that turned out to be of another object than it was taken for.

    Attributes:
        trial: Number of it among the trials that were learned from, from 0.
        old: Name of the ATG that it was of.
        new: Name of the one that it is of from then on.
    """

    trial: int
    old: str
    new: str


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

    @property
    def confidences(self) -> Confidences:
        """How sure the detector is of each symbol, as the world's ``info`` has it; empty if it does not say."""
        return confidences_in(self.truth)


@dataclass
class TrialRecord:
    """Everything that happened in a trial.

    Attributes:
        names: Names of the remembered objects, in the order of their index.
        assumptions: What the trial took for granted.
        steps: The looks, t + 1 of them for t actions; one less if the object was lost.
        lost_truth: What the world's ``info`` said when it lost the object, ``None`` if it did not.
        mistakes: Labels that the engine takes for wrong, given the whole trial.
    """

    names: tuple[str, ...]
    assumptions: Assumptions
    steps: list[TrialStep] = field(default_factory=list)
    lost_truth: dict[str, Any] | None = None
    mistakes: list[Mistake] = field(default_factory=list)

    @classmethod
    def from_looks(
        cls, assumptions: Assumptions, looks: Sequence[Look], actions: Sequence[int | str], name: str | None = None
    ) -> TrialRecord:
        """Return the record of a trial that nobody inferred anything from: what was seen and done is all there is.

        Args:
            assumptions: Of the memory that is to learn from it.
            looks: Each look, as evidence or as ``Inference.observe`` takes it, at least one, t + 1 of them.
            actions: What was done between each two, index or name, t of them.
            name: Of the object, if it is known; it is then the belief at each look, else *unseen* is.

        Raises:
            InvalidInputError: Lengths that do not fit, an action that there is not, or evidence over another alphabet.
        """
        if not isinstance(assumptions, Assumptions):
            raise InvalidInputError(f"trial: {brief(assumptions)}; expected Assumptions")
        n_looks, n_actions = len(sequence(looks, "trial: looks")), len(sequence(actions, "trial: actions"))
        if not n_looks or n_actions != n_looks - 1:
            raise InvalidInputError(f"trial: {n_looks} looks, {n_actions} actions; expected one look more")
        belief = IdentityBelief.of(
            np.array([1.0, 0.0] if name else [1.0]), max(assumptions.n_objects - (name is not None), 1)
        )
        record = cls(() if name is None else (name,), assumptions)
        for time, look in enumerate(looks):
            evidence = evidence_of(assumptions.alphabet, look, assumptions.object_senses)
            evidence.check(len(assumptions.alphabet))
            action = None if time == len(actions) else assumptions.action_of(actions[time], f"trial, action {time}")
            seen = evidence.detection or (None,) * len(assumptions.alphabet.slots)
            truth = truth_of(evidence, name)
            record.steps.append(TrialStep(seen, evidence.pattern, belief, 0.0, truth, action=action))
        return record

    @property
    def belief(self) -> IdentityBelief:
        """The belief at the end of the trial."""
        return self.steps[-1].belief

    @property
    def verdict(self) -> Verdict:
        """How the trial ended: ``undecided`` if nothing at all was seen, ``lost`` if the world lost the object."""
        if self.lost_truth is not None:
            return "lost"
        if not any(step.truth.get("likelihoods") or set(step.detection) - {None} for step in self.steps):
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
    def confidences(self) -> list[Confidences]:
        """How sure the detector is of each symbol at each look; empty if it never says."""
        return list(confidences_of([step.truth for step in self.steps]))

    @property
    def actions(self) -> list[int]:
        """Index of each action, in order."""
        return [step.action for step in self.steps if step.action is not None]

    def table(self) -> Table:
        """Return the trial look by look."""
        rows = [_step_row(number, step, self) for number, step in enumerate(self.steps)]
        ending = f"{self.verdict}{_of(self.matched)}" if rows else "nothing seen yet"
        title = f"Trial of {len(self.actions)} actions: {ending}"
        seen = f"seen ({', '.join(self.assumptions.alphabet.slots)})"
        headings = ("look", seen, "most probable object", "", "unseen", "entropy, nats", "then")
        return Table(title, headings, shortened(rows, _LOOKS, "looks"))

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    def __repr__(self) -> str:
        return f"<{self.table().title}>"


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
class StepSummary:
    """What is kept of one look, and of the action chosen after it.

    Attributes:
        observed: The symbol seen in each slot, ``None`` where nothing was.
        pattern: Index of the pattern if the detection was complete; ``None``, too, where the record does not say.
        unseen: p(O unseen) given all up to here.
        entropy: Of identity, in nats.
        truth: What the world's ``info`` said.
        action: Name of the action chosen next; ``None`` at the end.
        purpose: What it is for, if the policy said so.
        log_evidence: ln p(z_0:t | a_1:t); ``None`` where it was not kept.
        expected_entropy: Of each action by name, in nats, if the policy looked at them and it was kept.
        crops: Path of what was cut out for each slot, from the record's folder; empty if none were kept.
    """

    observed: Detection
    pattern: int | None
    unseen: float
    entropy: float
    truth: dict[str, Any]
    action: str | None = None
    purpose: str | None = None
    log_evidence: float | None = None
    expected_entropy: dict[str, float] | None = None
    crops: tuple[str | None, ...] = ()


@dataclass(frozen=True)
class TrialSummary:
    """What is kept of a trial in logs, databases and runs: all that scoring, learning and reports need of it.

    Attributes:
        verdict: How it ended.
        matched: Name of the ATG that the object was matched to.
        steps: The looks, at least one.
        lost_truth: What the world said when it lost the object.
        learned: Name of the ATG that it went to, ``None`` if nothing was learned, or the record does not say.
        learned_patterns: What was learned if that is not what was seen.
        experiment: Number of its experiment in a database, ``None`` if it belongs to none.
        number: Of the trial in its experiment, from 0.
        mistakes: Labels that the engine took for wrong, given the whole trial.
        mended: Earlier trials that turned out to be of other objects when this one was learned.
    """

    verdict: Verdict
    matched: str | None
    steps: tuple[StepSummary, ...]
    lost_truth: dict[str, Any] | None = None
    learned: str | None = None
    learned_patterns: tuple[int | None, ...] | None = None
    experiment: int | None = field(default=None, compare=False)
    number: int = field(default=0, compare=False)
    mistakes: tuple[Mistake, ...] = ()
    mended: tuple[Mended, ...] = ()

    @classmethod
    def of(
        cls, record: TrialRecord, learned: str | None = None, learned_patterns: Sequence[int | None] | None = None
    ) -> TrialSummary:
        """Return what is kept of a trial that was run.

        Args:
            record: Of the trial.
            learned: Name of the ATG that it went to.
            learned_patterns: Index of the pattern to learn from at each look. If not given, those seen whole, and those
                that a likelihood alone makes more probable than not.
        """
        names = record.assumptions.actions
        entropies_of_looks = entropies([step.belief for step in record.steps])
        steps = [
            StepSummary(
                step.detection,
                step.pattern,
                float(step.belief.unseen),
                entropy,
                step.truth,
                None if step.action is None else names[step.action],
                step.purpose,
                float(step.log_evidence),
                None
                if step.expected_entropies is None
                else dict(zip(names, step.expected_entropies.tolist(), strict=True)),
            )
            for step, entropy in zip(record.steps, entropies_of_looks, strict=True)
        ]
        if learned_patterns is None:
            alphabet = record.assumptions.alphabet
            looks = ((step.detection, step.pattern, step.truth) for step in record.steps)
            learned_patterns = [pattern_to_learn(alphabet, *look) for look in looks]
        patterns: tuple[int | None, ...] | None = tuple(learned_patterns)
        if patterns == tuple(record.patterns):
            patterns = None
        return cls(
            record.verdict,
            record.matched,
            tuple(steps),
            record.lost_truth,
            learned,
            patterns,
            mistakes=tuple(record.mistakes),
        )

    @property
    def patterns(self) -> tuple[int | None, ...]:
        """Index of the pattern to learn from at each look, ``None`` where it was not complete."""
        return self.learned_patterns or tuple(step.pattern for step in self.steps)

    @property
    def detections(self) -> tuple[Detection, ...]:
        """The symbol seen in each slot at each look, ``None`` where nothing was."""
        return tuple(step.observed for step in self.steps)

    @property
    def confidences(self) -> tuple[Confidences, ...]:
        """How sure the detector was of each symbol at each look; empty if it never says."""
        return confidences_of([step.truth for step in self.steps])

    @property
    def actions(self) -> tuple[str, ...]:
        """Name of each action, in order."""
        return tuple(step.action for step in self.steps if step.action is not None)

    @property
    def truths(self) -> tuple[dict[str, Any], ...]:
        """What the world said at each look, and when it lost the object."""
        truths = tuple(step.truth for step in self.steps)
        return truths if self.lost_truth is None else (*truths, self.lost_truth)

    @property
    def object(self) -> int | str:
        """What was presented, by the world's truth.

        Raises:
            InvalidInputError: The truth does not say.
        """
        found: int | str | None = self.steps[0].truth.get("object")
        if found is None:
            raise InvalidInputError(f"truth: {self.steps[0].truth!r:.60}; expected the object that was presented")
        return found

    def table(self) -> Table:
        """Return how the trial ended, what it was about, and what was seen."""
        title = f"Trial of {len(self.actions)} actions: {self.verdict}{_of(self.matched)}"
        seen = "; ".join(
            f"({', '.join('–' if symbol is None else str(symbol) for symbol in detection)})"
            for detection in self.detections[:_LOOKS]
        )
        presented = str(self.steps[0].truth.get("object", "–"))
        return Table(title, ("object presented", "seen"), ((presented, seen),))

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()


_LOOKS: Final = 40


def _step_row(number: int, step: TrialStep, record: TrialRecord) -> tuple[Cell, ...]:
    belief, best = step.belief, step.belief.most_probable_object
    name = "–" if best is None else record.names[best]
    share = 0.0 if best is None else float(belief.objects[best])
    then = [] if step.action is None else [record.assumptions.actions[step.action]]
    then += [] if step.purpose is None else [f"({step.purpose})"]
    return (
        str(number),
        record.assumptions.alphabet.text(step.detection),
        name,
        Bar(share, f"{share:.3f}"),
        Bar(belief.unseen, f"{belief.unseen:.3f}"),
        f"{belief.entropy:.3f}",
        " ".join(then),
    )


def _of(matched: str | None) -> str:
    return "" if matched is None else f", {matched}"
