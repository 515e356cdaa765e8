"""What is kept of a trial as a line of JSON, and the trials of one test as a file of such lines (``….jsonl.gz``).

All readers of records go by ``from_line``, or by ``read_step`` and ``summary_of`` where a record comes in other pieces:
whatever is of a wrong type, out of its range, or does not fit the rest is refused here, and nowhere else.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import number, one_of, plain_text, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import Detection, Evidence
from atg_fg.core.records import VERDICTS, Mended, Mistake, StepSummary, TrialRecord, TrialSummary
from atg_fg.storage.checked_json import plain_json, read_entries, read_info, read_list, read_object, without_none
from atg_fg.storage.growing_file import GrowingFile, read_lines
from atg_fg.storage.memory_json import write_assumptions

_FORMAT: Final = {"format": "atg-fg/test", "version": 1}
_KEYS: Final = ("verdict", "matched", "observed", "actions", "unseen", "entropy", "truth")
#: Rounding may carry a probability or an entropy this far past its bound.
_SLACK: Final = 1e-6


def to_line(trial: TrialSummary) -> dict[str, Any]:
    """Return a trial as logs and runs have it."""
    purposes = [step.purpose for step in trial.steps]
    patterns = trial.learned_patterns
    return without_none(
        {
            "verdict": trial.verdict,
            "matched": trial.matched,
            "observed": [list(step.observed) for step in trial.steps],
            "actions": list(trial.actions),
            "unseen": [step.unseen for step in trial.steps],
            "entropy": [step.entropy for step in trial.steps],
            "purpose": purposes if any(purposes) else None,
            "crops": [step.crops or None for step in trial.steps] if any(step.crops for step in trial.steps) else None,
            "truth": list(trial.truths),
            "learned": None if patterns is None else list(patterns),
            "mistakes": [list(each) for each in trial.mistakes] or None,
            "mended": [list(each) for each in trial.mended] or None,
        },
        but_for=("matched",),
    )


def from_line(line: Any, place: str, assumptions: Assumptions | None = None) -> TrialSummary:
    """Return the trial in a line.

    Args:
        line: The JSON document.
        place: Named in errors.
        assumptions: Of the trial; without them, patterns are not known, and symbols and actions not checked.

    Raises:
        InvalidInputError: Anything in it is not as it should be.
    """
    fields = read_object(line, place, _KEYS, optional=("purpose", "crops", "learned", "mistakes", "mended"))
    looks = len(read_list(fields["observed"], f"{place}: observed"))
    lost = fields["verdict"] == "lost"
    actions = list(read_list(fields["actions"], f"{place}: actions"))
    # An action may be the last thing that is recorded: of an object that is lost, no look follows.
    if len(actions) not in ((looks,) if lost else (looks - 1, looks)):
        raise InvalidInputError(f"{place}: {looks} looks, {len(actions)} actions; expected one look more")
    actions += [None] * (looks - len(actions))
    lengths = {**dict.fromkeys(("unseen", "entropy", "purpose", "crops"), looks), "truth": looks + lost}
    columns = {
        name: read_list(fields[name] if name in fields else [None] * looks, f"{place}: {name}", length)
        for name, length in lengths.items()
    }
    steps = [
        read_step(
            {
                "observed": fields["observed"][time],
                **{name: column[time] for name, column in columns.items()},
                "action": actions[time],
            },
            f"{place}: look {time}",
            assumptions,
        )
        for time in range(looks)
    ]
    lost_truth = columns["truth"][-1] if lost else None
    return summary_of({**fields, "lost_truth": lost_truth}, steps, place, assumptions)


def read_step(fields: Mapping[str, Any], place: str, assumptions: Assumptions | None = None) -> StepSummary:
    """Return one look of a record; arguments and errors are those of ``from_line``."""
    observed = _detection(fields["observed"], f"{place}: observed", assumptions)
    action, purpose, log_evidence, expected = map(fields.get, ("action", "purpose", "log_evidence", "expected_entropy"))
    crops = [] if fields.get("crops") is None else read_entries(fields["crops"], f"{place}: crops", len(observed))
    if action is not None and assumptions is not None:
        action = one_of(action, f"{place}: action", assumptions.actions)
    if assumptions is None:
        pattern = fields.get("pattern")
        pattern = None if pattern is None else whole_number(pattern, f"{place}: pattern")
    else:
        pattern = Evidence.of_detection(assumptions.alphabet, observed).pattern
    return StepSummary(
        observed,
        pattern,
        number(fields["unseen"], f"{place}: unseen", 0.0, 1.0, slack=_SLACK),
        number(fields["entropy"], f"{place}: entropy", 0.0, slack=_SLACK),
        _truth(fields["truth"], f"{place}: truth"),
        None if action is None else plain_text(action, f"{place}: action"),
        None if purpose is None else plain_text(purpose, f"{place}: purpose"),
        None if log_evidence is None else number(log_evidence, f"{place}: log_evidence"),
        None if expected is None else _expected(expected, f"{place}: expected_entropy", assumptions),
        tuple(None if each is None else plain_text(each, where) for each, where in crops),
    )


def summary_of(
    fields: Mapping[str, Any], steps: Sequence[StepSummary], place: str, assumptions: Assumptions | None = None
) -> TrialSummary:
    """Return a trial of these looks.

    Args:
        fields: ``verdict``, and what there is of ``matched``, ``lost_truth``, ``learned`` (the patterns learned),
            ``mistakes`` and ``mended``.
        steps: The looks.
        place: As for ``from_line``.
        assumptions: As for ``from_line``.

    Raises:
        InvalidInputError: As for ``from_line``.
    """
    verdict = next(known for known in VERDICTS if known == one_of(fields["verdict"], f"{place}: verdict", VERDICTS))
    matched, lost_truth, learned = map(fields.get, ("matched", "lost_truth", "learned"))
    if not steps:
        raise InvalidInputError(f"{place}: no looks; expected at least one")
    still = next((time for time, step in enumerate(steps[:-1]) if step.action is None), None)
    if still is not None:
        raise InvalidInputError(f"{place}: look {still}: no action; expected one before the next look")
    if (verdict == "known") != (matched is not None):
        raise InvalidInputError(
            f"{place}: verdict {verdict}, matched {matched!r:.60}; expected a match of what is known only"
        )
    if (verdict == "lost") != (lost_truth is not None):
        raise InvalidInputError(f"{place}: verdict {verdict}; expected the last truth of what is lost only")
    if learned is not None:
        most = None if assumptions is None else len(assumptions.alphabet) - 1
        learned = tuple(
            None if entry is None else whole_number(entry, where, 0, most)
            for entry, where in read_entries(learned, f"{place}: learned", len(steps))
        )
    return TrialSummary(
        verdict,
        None if matched is None else plain_text(matched, f"{place}: matched"),
        tuple(steps),
        None if lost_truth is None else _truth(lost_truth, f"{place}: truth[{len(steps)}]"),
        learned_patterns=learned,
        mistakes=read_mistakes(fields.get("mistakes", []), steps, f"{place}: mistakes"),
        mended=_read_mended(fields.get("mended", []), f"{place}: mended"),
    )


def read_mistakes(value: Any, steps: Sequence[StepSummary], place: str) -> tuple[Mistake, ...]:
    """Return the labels of these looks that were taken for wrong; errors are those of ``from_line``."""
    mistakes = []
    for entry, where in read_entries(value, place):
        look, slot, probability = read_list(entry, where, 3)
        look = whole_number(look, f"{where}[0]", 0, len(steps) - 1)
        slot = whole_number(slot, f"{where}[1]", 0, len(steps[look].observed) - 1)
        if steps[look].observed[slot] is None:
            raise InvalidInputError(f"{where}: slot {slot} of look {look}, where nothing was seen; expected a label")
        mistakes.append(Mistake(look, slot, number(probability, f"{where}[2]", 0.0, 1.0, slack=_SLACK)))
    return tuple(mistakes)


def _read_mended(value: Any, place: str) -> tuple[Mended, ...]:
    mended = []
    for entry, where in read_entries(value, place):
        trial, old, new = read_list(entry, where, 3)
        names = [plain_text(name, f"{where}[{position}]") for position, name in ((1, old), (2, new))]
        mended.append(Mended(whole_number(trial, f"{where}[0]", 0), *names))
    return tuple(mended)


def _detection(value: Any, place: str, assumptions: Assumptions | None) -> Detection:
    entries = read_list(value, place)
    if assumptions is not None:
        return assumptions.alphabet.check_detection(entries, place)
    return tuple(None if entry is None else whole_number(entry, place) for entry in entries)


def _truth(value: Any, place: str) -> dict[str, Any]:
    truth = read_info(value, place)
    presented = truth.get("object")
    if presented is not None and (isinstance(presented, bool) or not isinstance(presented, (int, str))):
        raise InvalidInputError(f"{place}: object: {presented!r:.60}; expected a whole number or a name")
    return truth


def _expected(value: Any, place: str, assumptions: Assumptions | None) -> dict[str, float]:
    """Return the expected entropy of each action; without assumptions, of those that there are."""
    entries = read_info(value, place) if assumptions is None else read_object(value, place, assumptions.actions)
    return {name: number(entry, f"{place}: {name}", 0.0, slack=_SLACK) for name, entry in entries.items()}


class TrialLog:
    """The trials of one test on disk.

    Args:
        path: The file, ``….jsonl.gz``.
        header: What test this is; a file of another one is refused.
        assumptions: Of the memory.
    """

    def __init__(self, path: Path, header: Mapping[str, Any], assumptions: Assumptions) -> None:
        self._file = GrowingFile(path, {**_FORMAT, **header}, "the trials", packed=True)
        self._assumptions = assumptions

    def begin(self) -> list[TrialSummary]:
        """Make the file, with its header, and return the trials in it: none.

        Raises:
            InvalidInputError: It is already there, or cannot be written.
        """
        self._file.begin()
        return []

    def resume(self) -> list[TrialSummary]:
        """Return the trials that are in the file, cutting off half a trial at its end; begin it if it is not there.

        Raises:
            InvalidInputError: The file cannot be read, or is of another test.
        """
        return [
            from_line(line, f"{self._file.path}: trial {index}", self._assumptions)
            for index, line in enumerate(self._file.resume())
        ]

    def append(self, trial: TrialSummary) -> None:
        """Add a trial to the file."""
        self._file.append(to_line(trial))


def read_log(path: Path) -> tuple[dict[str, Any], list[Any]]:
    """Return the header of a file, without format and version, and the lines of its trials, which are not checked yet.

    Half a trial at the end is left out.

    Raises:
        InvalidInputError: The file cannot be read, or is not such a file.
    """
    lines = read_lines(path, packed=True)
    header = lines[0] if lines and isinstance(lines[0], dict) else {}
    if {name: header.get(name) for name in _FORMAT} != _FORMAT:
        raise InvalidInputError(f"{path}: is not a log of trials; expected a file that --records wrote")
    return {name: value for name, value in header.items() if name not in _FORMAT}, lines[1:]


#: What the first line of a record says that it is.
TRIAL_FORMAT: Final = "atg-fg/trial"


def to_json_lines(record: TrialRecord, pictures: Sequence[Mapping[str, Any]] = (), **header: Any) -> str:
    """Return the record as JSON lines: a header, a line a step, the verdict.

    Args:
        record: The trial.
        pictures: Paths of ``frame`` and ``crops`` of each look, from the record's folder, if there are any.
        header: What else the header says.
    """
    assumptions = write_assumptions(record.assumptions)
    lines: list[dict[str, Any]] = [
        {"format": TRIAL_FORMAT, "version": 1, "objects": record.names, "assumptions": assumptions, **header}
    ]
    lines += [_step_line(record, time) for time in range(len(record.steps))]
    for line, paths in zip(lines[1:], pictures, strict=False):
        line.update(paths)
    verdict = {"outcome": record.verdict, "judged_novel": record.judged_novel, "matched": record.matched}
    mistakes = {"mistakes": [list(each) for each in record.mistakes]} if record.mistakes else {}
    lines.append({"verdict": {**verdict, **mistakes, "truth": record.lost_truth or record.steps[-1].truth}})
    return "".join(json.dumps(line, default=plain_json, allow_nan=False) + "\n" for line in lines)


def _step_line(record: TrialRecord, time: int) -> dict[str, Any]:
    step, actions = record.steps[time], record.assumptions.actions
    bound = step.total_variation_bound
    expected = step.expected_entropies
    line = {
        "step": time,
        "observed": step.detection,
        "objects": step.belief.objects,
        "unseen": step.belief.unseen,
        "entropy": step.belief.entropy,
        "log_evidence": step.log_evidence,
        "expected_entropy": None if expected is None else dict(zip(actions, expected.tolist(), strict=True)),
        "action": None if step.action is None else actions[step.action],
        "purpose": step.purpose,
        "total_variation_bound": bound,
        "truth": step.truth,
    }
    return without_none(line, but_for=("expected_entropy", "action"))
