"""Recordings written as tables, if these can hold them."""

from __future__ import annotations

from collections.abc import Sequence

from atg_fg.core.checks import brief, listed
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.recordings import RecordedLook, Recording
from atg_fg.storage.recording_csv import CONFIDENCE, LONGEST, READING, columns_of


def write_csv(recording: Recording) -> str:
    """Return trials as CSV: with confidences and the object where there are any, with weights by label if need be.

    Raises:
        InvalidInputError: A name would be read as another one, or as another kind of column.
    """
    slots, trials, senses = recording.slots, recording.trials, recording.sense_names
    by_label = {
        slot: sorted({name for trial in trials for look in trial.looks for name in _weights(look, index)})
        for index, slot in enumerate(slots)
    }
    sure = any(value is not None for trial in trials for look in trial.looks for value in look.confidences)
    named = any(trial.object is not None for trial in trials)
    header = ["trial", "step", "action"]
    for slot in slots:
        header += [slot, *([f"{slot}:{CONFIDENCE}"] if sure else []), *(f"{slot}={name}" for name in by_label[slot])]
    lines = [header + [f"{name}:{READING}" for name in senses] + (["object"] if named else [])]
    _check_columns(lines[0], recording, [by_label[slot] for slot in slots])
    for trial in trials:
        for step, look in enumerate(trial.looks):
            row = [trial.name, str(step), trial.actions[step] if step < len(trial.actions) else ""]
            for index, slot in enumerate(slots):
                row.append(look.labels[index] or "")
                stated = look.confidences[index] if look.confidences and look.labels[index] else None
                row += ["" if stated is None else repr(stated)] if sure else []
                weights = _weights(look, index)
                row += [repr(weights[name]) if name in weights else "" for name in by_label[slot]]
            readings = dict(look.measured)
            row += [repr(readings[name]) if name in readings else "" for name in senses]
            lines.append(row + ([trial.object or ""] if named else []))
    for name in {name for line in lines for name in line}:
        if name != name.strip() or len(name) > LONGEST or "\r" in name:
            expected = f"expected a name without spaces around it, of at most {LONGEST} characters, or .jsonl"
            raise InvalidInputError(f"{recording.place}: {brief(name)} in a table; {expected}")
    return "".join(f"{','.join(map(_quoted, line))}\n" for line in lines)


def _check_columns(header: Sequence[str], recording: Recording, weighted: Sequence[Sequence[str]]) -> None:
    """Raise ``InvalidInputError`` unless the columns are read as what they are; ``weighted`` has labels by slot."""
    try:
        columns = columns_of(header)
        slots, senses = columns.slots, tuple(name for _, name in columns.readings)
        same = (slots, senses) == (recording.slots, recording.sense_names)
        same = same and [[label for _, label in each] for each in columns.weights] == list(map(list, weighted))
    except InvalidInputError:
        same = False
    if not same:
        raise InvalidInputError(
            f"{recording.place}: columns {listed(header)} would not be read as they are meant; expected .jsonl"
        )


def _weights(look: RecordedLook, slot: int) -> dict[str, float]:
    return dict(look.weights[slot] or {}) if look.weights else {}


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"' if set(text) & set(',;"\t\n\r') or text != text.strip() else text
