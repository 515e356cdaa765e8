"""Recordings as tables: a row a look, in CSV as spreadsheets and loggers write it.

A byte order mark, any line ends, semicolons or tabs, and decimal commas beside these are read. All that is wrong is
found, with its line and column; ``read_recording`` refuses the first fault, ``check_recording`` lists them all.
"""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Final, NamedTuple

from atg_fg.core.checks import brief, listed
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import GREATEST_READING, MOST_OBJECT_SENSES, ObjectSense
from atg_fg.core.recordings import RecordedLook, RecordedTrial

#: Columns that are no slots.
FIXED: Final = ("trial", "step", "action", "object")
_NEEDED: Final = FIXED[:3]
CONFIDENCE: Final = "confidence"
READING: Final = "reading"
#: Characters of a field; a longer one is no label.
LONGEST: Final = 1000
#: Digits of a step.
_LONGEST_STEP: Final = 18
#: Faults that are kept of a file.
MOST_FAULTS: Final = 1000


class Fault(NamedTuple):
    """Something in a recording that is not as it should be.

    Attributes:
        kind: In a word or two, the same for all of its kind.
        place: Line and column.
        what: The value, and what was expected.
        fatal: Whether the recording cannot be learned from as it is.
    """

    kind: str
    place: str
    what: str
    fatal: bool = True

    def __str__(self) -> str:
        return f"{self.place}: {self.what}"


class CsvColumns(NamedTuple):
    """Which column is what.

    Attributes:
        slots: Names of the slots.
        label: Column of each slot's label, ``None`` of a slot with weights alone.
        confidence: Column of each slot's confidence, ``None`` without.
        weights: (column, label) of each slot's weights.
        readings: (column, name) of each sense of the object.
        fixed: Column of trial, step, action and object.
        n_columns: Of a row.
    """

    slots: tuple[str, ...]
    label: tuple[int | None, ...]
    confidence: tuple[int | None, ...]
    weights: tuple[tuple[tuple[int, str], ...], ...]
    readings: tuple[tuple[int, str], ...]
    fixed: dict[str, int]
    n_columns: int


def columns_of(header: Sequence[str], slots: Sequence[str] | None = None) -> CsvColumns:
    """Return which column is what, by the names in the first line.

    ``SLOT:confidence`` is how sure the detector was of a slot's label, ``SLOT=LABEL`` the likelihood of one label,
    ``SENSE:reading`` a number that the object has whichever way it lies.
    Other columns than ``FIXED`` are slots. One named ``confidence`` belongs to the only other slot, if there is one.

    Args:
        header: Names.
        slots: Those that are slots, if it is said; other columns without ``:`` and ``=`` are then left out.

    Raises:
        InvalidInputError: A column is missing or repeated, or belongs to no slot.
    """
    names = [_trimmed(name) for name in header]
    name, times = Counter(names).most_common(1)[0]
    if times > 1:
        raise InvalidInputError(f"line 1: column {brief(name)} is repeated; expected unique columns")
    for name in names:
        if not name or name[0] in ":=" or name[-1] in ":=":
            raise InvalidInputError(f"line 1: column {brief(name)}; expected a name, SLOT:confidence or SLOT=LABEL")
    for needed in _NEEDED:
        if needed not in names:
            raise InvalidInputError(f"line 1: no column {needed!r} in {listed(names)}; expected {', '.join(_NEEDED)}")
    plain = [name for name in names if name not in FIXED and ":" not in name and "=" not in name]
    weighted = [name.partition("=")[0] for name in names if "=" in name]
    lone = [name for name in plain if name != CONFIDENCE]
    if slots is None and CONFIDENCE in plain and lone:
        if len(lone) > 1:
            each = listed(f"{name}:{CONFIDENCE}" for name in lone)
            raise InvalidInputError(f"line 1: column {CONFIDENCE!r}, and several slots; expected {each}")
        plain = lone
    owned = list(dict.fromkeys([*plain, *weighted]) if slots is None else slots)
    if not owned:
        raise InvalidInputError(f"line 1: no slot in {listed(names)}; expected a column for what is seen")
    number = {name: index for index, name in enumerate(names)}
    weights: dict[str, list[tuple[int, str]]] = {slot: [] for slot in owned}
    for name, index in number.items():
        owner, equals, label = name.partition("=")
        if equals and owner in weights:
            weights[owner].append((index, label))
    for slot in owned:
        if slot not in number and not weights[slot]:
            raise InvalidInputError(f"line 1: no column for slot {slot!r} in {listed(names)}; expected one")
    readings = []
    for name, index in number.items():
        owner, colon, kind = name.partition(":")
        if colon and kind == READING and owner and "=" not in owner and owner not in owned:
            readings.append((index, owner))
        elif colon and "=" not in name and (kind != CONFIDENCE or owner not in weights):
            raise InvalidInputError(
                f"line 1: column {brief(name)}; expected SLOT:confidence of a slot: {listed(owned)}; or SENSE:reading"
            )
    if len(readings) > MOST_OBJECT_SENSES:
        raise InvalidInputError(
            f"line 1: {len(readings)} columns of readings, {listed([name for _, name in readings])}; "
            f"expected at most {MOST_OBJECT_SENSES}"
        )
    alone = number.get(CONFIDENCE) if len(owned) == 1 and CONFIDENCE not in owned else None
    return CsvColumns(
        tuple(owned),
        tuple(number.get(slot) for slot in owned),
        tuple(number.get(f"{slot}:{CONFIDENCE}", alone) for slot in owned),
        tuple(tuple(weights[slot]) for slot in owned),
        tuple(readings),
        {name: number[name] for name in FIXED if name in number},
        len(names),
    )


class CsvReader:
    """Reads the rows of a recording; all faults are collected on the way.

    Args:
        text: Of the file.
        slots: As for ``columns_of``.
        labels: Those that may occur, ``None`` for any.
        actions: Those that may occur, ``None`` for any.
        senses: What is known of some senses of the object.

    Attributes:
        columns: Which is what.
        faults: What was found to be wrong: the first ``MOST_FAULTS``, and the first fatal one.
    """

    def __init__(
        self,
        text: str,
        slots: Sequence[str] | None = None,
        labels: Sequence[str] | None = None,
        actions: Sequence[str] | None = None,
        senses: Sequence[ObjectSense | str] = (),
    ) -> None:
        self._delimiter = _delimiter_of(text.partition("\n")[0])
        # Line ends stay, for one in quotes belongs to a name.
        self._csv = csv.reader((f"{line}\n" for line in text.split("\n")), delimiter=self._delimiter, strict=True)
        self._rows = self._checked_rows()
        self._labels = None if labels is None else dict.fromkeys(sorted(labels))
        self._actions = None if actions is None else dict.fromkeys(sorted(actions))
        self._relative = {each.name for each in senses if isinstance(each, ObjectSense) and each.relative}
        self.faults: list[Fault] = []
        self._is_fatal = False
        header = _without_empty_end(next(self._rows, []))
        if not header:
            raise InvalidInputError("line 1: empty; expected the names of the columns")
        self.columns = columns_of(header, slots)
        for slot, weights in zip(self.columns.slots, self.columns.weights, strict=True):
            for _, label in weights:
                if labels is not None and label not in labels:
                    expected = f"expected one of: {listed(sorted(labels))}"
                    raise InvalidInputError(f"line 1, column {brief(f'{slot}={label}')}: {brief(label)}; {expected}")
        # Looks are few and repeat: one of each kind is kept.
        self._looks: dict[RecordedLook, RecordedLook] = {}

    def trials(self) -> list[RecordedTrial]:
        """Return the trials; where there are faults, what can be made of them."""
        seen: set[str] = set()
        trials = []
        for name, rows in groupby(self._numbered(), lambda row: row[1][self.columns.fixed["trial"]].strip()):
            kept = list(rows)
            line = kept[0][0]
            if not name:
                self._fault("no trial", line, "trial", "empty; expected the name of a trial")
            if name in seen:
                self._fault("trial split", line, "trial", f"{brief(name)} again; expected all its rows together")
            seen.add(name)
            trials.append(self._trial(name, kept))
        if not trials:
            fault = self.faults[0] if self.faults else "line 2: no rows; expected at least one look"
            raise InvalidInputError(str(fault))
        return trials

    def _checked_rows(self) -> Iterator[list[str]]:
        try:
            yield from self._csv
        except csv.Error as error:
            raise InvalidInputError(f"line {self._csv.line_num}: {error}; expected CSV") from error

    def _numbered(self) -> Iterator[tuple[int, list[str]]]:
        for row in self._rows:
            line = self._csv.line_num
            if not any(map(str.strip, row)):
                continue
            if len(row) > self.columns.n_columns:
                row = row[: self.columns.n_columns] + _without_empty_end(row[self.columns.n_columns :])
            if len(row) != self.columns.n_columns:
                self._fault("columns", line, "", f"{len(row)} columns; expected {self.columns.n_columns}")
                continue
            yield line, row

    def _trial(self, name: str, rows: list[tuple[int, list[str]]]) -> RecordedTrial:
        fixed, actions, looks = self.columns.fixed, [], []
        for number, (line, row) in enumerate(rows):
            self._check_step(line, row[fixed["step"]].strip(), number, rows)
            looks.append(self._look(line, row))
            action, last = row[fixed["action"]].strip(), number + 1 == len(rows)
            if not last:
                self._check_action(line, action)
                actions.append(action)
            elif action:
                self._fault("action at the end", line, "action", f"{brief(action)} and no look after it", fatal=False)
        # One row of a trial that says what it was of is as good as all.
        named = [(line, row[fixed["object"]].strip()) for line, row in rows] if "object" in fixed else []
        objects = list(dict.fromkeys(each for _, each in named if each))
        if len(objects) > 1:
            line = next(line for line, each in named if each == objects[1])
            self._fault("two objects", line, "object", f"{brief(objects)} in a trial; expected one")
        return RecordedTrial(name, tuple(looks), tuple(actions), objects[0] if objects else None)

    def _check_step(self, line: int, step: str, number: int, rows: list[tuple[int, list[str]]]) -> None:
        if not _is_step(step):
            self._fault("no step", line, "step", f"{brief(step)}; expected a whole number")
            return
        before = rows[number - 1][1][self.columns.fixed["step"]].strip() if number else ""
        if _is_step(before) and int(step) != int(before) + 1:
            kind = "missing step" if int(step) > int(before) + 1 else "steps out of order"
            self._fault(kind, line, "step", f"{step}; expected {int(before) + 1}, one more than before")

    def _check_action(self, line: int, action: str) -> None:
        if not action:
            self._fault("no action", line, "action", "empty; expected what was done before the next look")
        elif self._actions is not None and action not in self._actions:
            self._fault("unknown action", line, "action", f"{brief(action)}; expected one of: {listed(self._actions)}")

    def _look(self, line: int, row: list[str]) -> RecordedLook:
        columns = self.columns
        labels, confidences, weights = [], [], []
        for index, slot in enumerate(columns.slots):
            at = columns.label[index]
            label = row[at].strip() if at is not None else ""
            labels.append(self._known(line, slot, label) if label else None)
            confidences.append(self._confidence(line, index, row, bool(label)))
            given = {
                name: self._number(line, f"{slot}={name}", row[column].strip(), math.inf)
                for column, name in columns.weights[index]
                if row[column].strip()
            }
            known = {name: value for name, value in given.items() if value}
            if known and label:
                self._fault("label and weights", line, slot, f"{brief(label)} and likelihoods; expected one of them")
            elif given and not known and not label:
                self._fault("no probability", line, slot, "all likelihoods are 0; expected one above 0, or nothing")
            weights.append(known if known and not label else None)
        measured = tuple(
            (name, value)
            for column, name in columns.readings
            if (text := row[column].strip()) and (value := self._reading(line, name, text)) is not None
        )
        if any(weights):
            return RecordedLook(tuple(labels), tuple(confidences), tuple(weights), measured)
        look = RecordedLook(tuple(labels), tuple(confidences), (), measured)
        return self._looks.setdefault(look, look)

    def _reading(self, line: int, name: str, text: str) -> float | None:
        value, is_above = self._float(text), name in self._relative
        # A NaN is in no range.
        if abs(value) <= GREATEST_READING and (value > 0 or not is_above):
            return value
        what = f"{brief(text)}; expected a number{' above 0' * is_above}"
        self._fault("no reading", line, f"{name}:{READING}", what)
        return None

    def _known(self, line: int, slot: str, label: str) -> str | None:
        if len(label) > LONGEST:
            self._fault("long label", line, slot, f"{len(label)} characters; expected at most {LONGEST}")
            return None
        if self._labels is not None and label not in self._labels:
            self._fault("unknown label", line, slot, f"{brief(label)}; expected one of: {listed(self._labels)}")
            return None
        return label

    def _confidence(self, line: int, index: int, row: list[str], has_label: bool) -> float | None:
        at = self.columns.confidence[index]
        if at is None or not row[at].strip():
            return None
        name = f"{self.columns.slots[index]}:{CONFIDENCE}"
        value = self._number(line, name, row[at].strip(), 1.0)
        if not has_label:
            self._fault("confidence alone", line, name, f"{value} and no label; expected both or none", fatal=False)
            return None
        return value

    def _number(self, line: int, column: str, text: str, most: float) -> float | None:
        expected = f"expected a number from 0 to {most:g}" if math.isfinite(most) else "expected a number of at least 0"
        value = self._float(text)
        if not 0 <= value <= most or math.isinf(value):
            self._fault("no probability", line, column, f"{brief(text)}; {expected}")
            return None
        return value

    def _float(self, text: str) -> float:
        try:
            # Python takes 1_000 for a number, other programs do not.
            return math.nan if "_" in text else float(text.replace(",", ".") if self._delimiter != "," else text)
        except ValueError:
            return math.nan

    def _fault(self, kind: str, line: int, column: str, what: str, *, fatal: bool = True) -> None:
        place = f"line {line}, column {column!r}" if column else f"line {line}"
        # However many there are, the first fatal one is among those that are kept.
        if len(self.faults) < MOST_FAULTS or (fatal and not self._is_fatal):
            self.faults.append(Fault(kind, place, what, fatal))
        self._is_fatal = self._is_fatal or fatal


def _is_step(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) <= _LONGEST_STEP


def _delimiter_of(header: str) -> str:
    """Return what stands between the names of columns: they may hold others of these characters themselves."""

    def likely(delimiter: str) -> tuple[int, int]:
        names = {name.strip(' "') for name in header.split(delimiter)}
        return len(names.intersection(FIXED)), header.count(delimiter)

    return max(",;\t", key=likely)


def _without_empty_end(row: list[str]) -> list[str]:
    """Return a row without what separators at its end make of it."""
    while row and not row[-1].strip():
        row = row[:-1]
    return row


def _trimmed(name: str) -> str:
    owner, equals, label = name.partition("=")
    return f"{owner.strip()}{equals}{label.strip()}"
