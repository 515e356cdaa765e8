"""Senses of the object and their readings as JSON, checked on the way in."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from atg_fg.core.checks import number, plain_text, whole_number
from atg_fg.core.errors import InvalidInputError, placed
from atg_fg.core.object_sense import Moments, ObjectSense, check_measured
from atg_fg.core.patterns import Measured
from atg_fg.storage.checked_json import read_entries, read_list, read_object

#: Sums of readings and of their squares are numbers up to here.
_GREATEST: Final = 1e100


def write_object_sense(sense: ObjectSense) -> dict[str, Any]:
    """Return a sense of the object as JSON knows it."""
    return {
        "name": sense.name,
        "unit": sense.unit,
        "typical": sense.typical,
        "spread": sense.spread,
        "error": sense.error,
        "relative": sense.relative,
        **({} if math.isinf(sense.worth) else {"worth": sense.worth}),  # known, which JSON has no number for
        "revealed_by": list(sense.revealed_by),
    }


def read_object_senses(value: Any, place: str) -> tuple[ObjectSense, ...]:
    """Return the senses of the object that are listed at ``place``."""
    senses = []
    for entry, where in read_entries(value, place):
        keys, further = ("name", "typical", "spread", "error"), ("unit", "relative", "revealed_by", "worth")
        fields = read_object(entry, where, keys, further)
        revealing = read_list(fields.get("revealed_by", []), where)
        actions = tuple(plain_text(name, f"{where}.revealed_by") for name in revealing)
        with placed(where):
            senses.append(ObjectSense(**{**fields, "revealed_by": actions}))
    return tuple(senses)


def write_moments(measured: Mapping[str, Moments]) -> dict[str, Any]:
    """Return what is kept of the readings of an object as JSON knows it."""
    return {
        name: {"count": moments.count, "total": moments.total, "squares": moments.squares}
        for name, moments in measured.items()
    }


def read_moments(value: Any, senses: Sequence[ObjectSense], place: str) -> dict[str, Moments]:
    """Return what is kept of the readings of an object at ``place``."""
    names = tuple(sense.name for sense in senses)
    fields = read_object(value, place, (), names)
    found = {}
    for name, entry in fields.items():
        where = f"{place}.{name}"
        kept = read_object(entry, where, ("count", "total", "squares"))
        count = whole_number(kept["count"], f"{where}.count", 1, 2**53)
        total = number(kept["total"], f"{where}.total", -_GREATEST, _GREATEST)
        squares = number(kept["squares"], f"{where}.squares", 0.0, _GREATEST)
        if total * total > count * squares * (1 + 1e-9):
            raise InvalidInputError(f"{where}: squares {squares!r}; expected at least total² / count")
        found[name] = Moments(count, total, squares)
    return found


def write_readings(measured: Sequence[Measured]) -> list[list[list[Any]]]:
    """Return the readings at each look as JSON knows them: pairs of a name and a number."""
    return [[[name, reading] for name, reading in look] for look in measured]


def read_readings(value: Any, senses: Sequence[ObjectSense], place: str) -> tuple[Measured, ...]:
    """Return the readings at each look that are listed at ``place``."""
    looks = []
    for entry, where in read_entries(value, place):
        look: list[tuple[str, float]] = []
        for pair in read_list(entry, where):
            parts = read_list(pair, where)
            if len(parts) != 2 or not isinstance(parts[0], str):
                raise InvalidInputError(f"{where}: {len(parts)} entries; expected a name and a number")
            look += check_measured(senses, {parts[0]: parts[1]}, where)
        looks.append(tuple(look))
    return tuple(looks)
