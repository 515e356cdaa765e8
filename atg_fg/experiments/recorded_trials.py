"""Recordings of a user's own: their trials recognised one by one, learned from, and scored where the truth is known."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError, placed
from atg_fg.core.looks import measured_in, truth_of
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.core.recordings import RecordedTrial, Recording
from atg_fg.core.records import TrialRecord, TrialStep, TrialSummary
from atg_fg.core.statistics import rate_document
from atg_fg.engines import begin_trial
from atg_fg.experiments.scores import Score
from atg_fg.experiments.trial import can_be_learned, follow, learn_from, learn_steps
from atg_fg.learning.predictive_checks import WORSE_THAN_CHANCE
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.structured_memory import StructuredMemory


class Recognised(NamedTuple):
    """What came of one trial of a recording.

    Attributes:
        trial: Of the recording.
        record: Look by look.
        learned: Name of the ATG that it went to, ``None`` if nothing was learned.
        right: Whether the verdict is right, ``None`` if the truth is not known.
    """

    trial: RecordedTrial
    record: TrialRecord
    learned: str | None = None
    right: bool | None = None


def recognise(
    recording: Recording,
    memory: RobotMemory,
    engine: str,
    parameters: ModelParameters,
    *,
    learn: bool = False,
    scores: Score | None = None,
    on_trial: Callable[[], None] | None = None,
) -> list[Recognised]:
    """Recognise the object of each trial in turn.

    Args:
        recording: Its labels and actions are those of the memory.
        memory: What is remembered; it learns from each trial before the next if ``learn``.
        engine: Name of the engine.
        parameters: Of the model.
        learn: See above.
        scores: Counts what is right as it goes: verdicts are scored by what was learned until then.
        on_trial: Called after each trial.

    Raises:
        InvalidInputError: A look that is none under the memory's assumptions; the message names trial and step.
    """
    found = []
    for trial in recording.trials:
        record = _recognised(trial, memory, engine, parameters, recording.place)
        found.append(Recognised(trial, record, learn_from(record, memory) if learn else None))
        if scores is not None:
            found[-1] = found[-1]._replace(right=scores.add(TrialSummary.of(record), found[-1].learned, memory))
            scores.mend(memory)
        if on_trial is not None:
            on_trial()
    return found


def learn(
    recording: Recording,
    memory: RobotMemory,
    engine: str,
    parameters: ModelParameters,
    on_trial: Callable[[], None] | None = None,
) -> None:
    """Learn from each trial as one of the object that it is recognised as; nobody asks for the verdicts.

    Where looks err and there are many trials, many are learned from at once (``StructuredMemory.learn_together``); the
    file of a memory then has no records of these, as it has verdicts of none.

    Args:
        recording: Its labels and actions are those of the memory.
        memory: What learns.
        engine: Name of the engine.
        parameters: Of the model.
        on_trial: Called after each trial.

    Raises:
        InvalidInputError: A look that is none under the memory's assumptions; the message names trial and step.
    """
    left = list(recording.trials)
    while left:
        at_once = memory.n_together if isinstance(memory, StructuredMemory) else 0
        if at_once > 1 and isinstance(memory, StructuredMemory):
            taken, left = left[:at_once], left[at_once:]
            raw = [_raw(trial, memory, recording.place) for trial in taken]
            memory.learn_together([trial for trial in raw if trial is not None])
        else:
            taken, left = left[:1], left[1:]
            learn_from(_recognised(taken[0], memory, engine, parameters, recording.place), memory)
        if on_trial is not None:
            for _ in taken:
                on_trial()


def _raw(trial: RecordedTrial, memory: RobotMemory, place: str) -> RawTrial | None:
    """Return what a memory learns from a trial, ``None`` if there is nothing to learn."""
    looks = _evidence(trial, memory.assumptions, place)
    actions = _actions(trial, memory)
    record = TrialRecord.from_looks(memory.assumptions, looks, actions)
    return RawTrial.of(looks, actions, memory.assumptions.alphabet) if can_be_learned(TrialSummary.of(record)) else None


def teach(recording: Recording, memory: RobotMemory, on_trial: Callable[[], None] | None = None) -> int:
    """Learn from each trial as one of the object that the recording names; return from how many something was learned.

    Raises:
        InvalidInputError: A trial names no object; nothing was learned then.
    """
    check(recording, memory.assumptions, taught=True)
    taught = 0
    for trial in recording.trials:
        matched = trial.object if trial.object in memory.names else None
        record = TrialRecord.from_looks(
            memory.assumptions,
            _evidence(trial, memory.assumptions, recording.place),
            _actions(trial, memory),
            trial.object,
        )
        summary = TrialSummary.of(record)
        if can_be_learned(summary):
            with memory.transaction():
                learn_steps(memory, summary, matched, None if matched else trial.object, taught=True)
            taught += 1
        if on_trial is not None:
            on_trial()
    return taught


def check(recording: Recording, assumptions: Assumptions, *, taught: bool = False) -> None:
    """Raise ``InvalidInputError`` if a trial cannot be learned from: before any is, lest half of them be learned.

    Args:
        recording: Its labels are known to the assumptions.
        assumptions: Of the memory that is to learn.
        taught: Whether each trial has to name its object.
    """
    for trial in recording.trials:
        if taught and trial.object is None:
            raise InvalidInputError(f"{recording.place}: trial {trial.name}: no object; expected one, to be taught")
        _evidence(trial, assumptions, recording.place)


def _evidence(trial: RecordedTrial, assumptions: Assumptions, place: str) -> list[Evidence]:
    looks = []
    for step, look in enumerate(trial.looks):
        with placed(f"{place}: trial {trial.name}, step {step}"):
            looks.append(look.evidence(assumptions))
    return looks


def _actions(trial: RecordedTrial, memory: RobotMemory) -> list[int]:
    return [memory.assumptions.action_index(action) for action in trial.actions]


def _recognised(
    trial: RecordedTrial, memory: RobotMemory, engine: str, parameters: ModelParameters, place: str
) -> TrialRecord:
    looks = _evidence(trial, memory.assumptions, place)
    truths = [truth_of(look, trial.object) for look in looks]
    return follow(begin_trial(engine, memory, parameters), looks, _actions(trial, memory), truths)


def scored_afterwards(found: Sequence[Recognised], made_from: dict[str, object]) -> tuple[Score, list[Recognised]]:
    """Return the scores of trials that were not learned from, and the trials with what is right.

    Args:
        found: The trials; those whose truth is not known are not scored.
        made_from: The object that each ATG was made from.
    """
    scores = Score(made_from, learns=False)
    return scores, [
        each if each.trial.object is None else each._replace(right=scores.add(TrialSummary.of(each.record), None))
        for each in found
    ]


def score_document(scores: Score) -> dict[str, Any]:
    """Return how many verdicts are right as JSON knows it."""
    counts = {
        "success": (scores.successes, scores.n_trials),
        "identification": (scores.identified, scores.n_trials),
        "recognition": (scores.recognised, scores.judged_known),
        **({} if scores.mended is None else {"mended": (scores.mended, scores.n_trials)}),
    }
    return {name: rate_document(*count) for name, count in counts.items()}


def names_by_majority(found: Sequence[Recognised], made_from: dict[str, object]) -> dict[str, object]:
    """Return the object that each ATG is taken for: the one of its name, else of most trials that were matched to it.

    The name of an ATG that was not taught says nothing of the truth.
    """
    votes: dict[str, Counter[object]] = {}
    for each in found:
        if each.record.matched is not None and each.trial.object is not None:
            votes.setdefault(each.record.matched, Counter())[each.trial.object] += 1
    return {**{name: counts.most_common(1)[0][0] for name, counts in votes.items()}, **made_from}


def improbable_trials(found: Sequence[Recognised]) -> list[str]:
    """Return a warning for each trial that labels drawn at random explain far better than the model does.

    Trials with likelihoods in place of labels are left out, for their scale is the detector's own; and those before
    which nothing was learned, since then there is no model yet.
    """
    warnings = []
    for each in found:
        record = each.record
        n_labels = sum(symbol is not None for detection in record.detections for symbol in detection)
        at_random = -n_labels * math.log(record.assumptions.alphabet.n_symbols)
        soft = any(step.truth.get("likelihoods") for step in record.steps)
        if record.names and not soft and record.steps[-1].log_evidence < at_random - WORSE_THAN_CHANCE:
            warnings.append(
                f"trial {each.trial.name} is less probable than labels drawn at random: something else was shown or "
                "done (actions), or the detector erred more than usual (noise)"
            )
    return warnings


def trial_document(each: Recognised) -> dict[str, Any]:
    """Return what came of a trial as JSON knows it, with the names of labels, actions and objects."""
    record = each.record
    return {
        "trial": each.trial.name,
        "verdict": record.verdict,
        "matched": record.matched,
        "object": each.trial.object,
        "right": each.right,
        "learned": each.learned,
        "steps": [_step_document(number, step, record) for number, step in enumerate(record.steps)],
        "mistakes": [
            {
                "step": mistake.look,
                "slot": record.assumptions.alphabet.slots[mistake.slot],
                "probability": mistake.probability,
            }
            for mistake in record.mistakes
        ],
    }


def _step_document(number: int, step: TrialStep, record: TrialRecord) -> dict[str, Any]:
    alphabet = record.assumptions.alphabet
    objects = zip(record.names, step.belief.objects.tolist(), strict=True)
    return {
        "step": number,
        "seen": {
            slot: None if symbol is None else alphabet.name_of(symbol)
            for slot, symbol in zip(alphabet.slots, step.detection, strict=True)
        },
        **({"measured": dict(measured)} if (measured := measured_in(step.truth)) else {}),
        "action": None if step.action is None else record.assumptions.actions[step.action],
        "unseen": float(step.belief.unseen),
        "objects": dict(objects),
        "entropy": float(step.belief.entropy),
        "log_evidence": float(step.log_evidence),
    }
