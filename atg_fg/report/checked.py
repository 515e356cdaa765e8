"""Values of a file's fields, checked: every function names the place of what is not as it should be."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import Detection, Evidence
from atg_fg.storage.checked_json import placed, read_list


def field_of(value: Any, key: str, place: str) -> Any:
    """Return the field ``key`` of the object at ``place``."""
    if not isinstance(value, Mapping) or key not in value:
        raise InvalidInputError(f"{place}: key {key!r} is missing; expected an object with it")
    return value[key]


def number(value: Any, place: str, least: float = 0.0, most: float = math.inf) -> float:
    """Return ``value`` if it is a finite number from ``least`` to ``most``."""
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InvalidInputError(f"{place}: {value!r}; expected a number")
    # Rounding may carry a probability or an entropy a hair past its bound.
    if not least - 1e-6 <= value <= most + 1e-6:
        raise InvalidInputError(f"{place}: {value!r}; expected a number from {least:g} to {most:g}")
    return float(value)


def numbers(value: Any, place: str, length: int, most: float = math.inf) -> list[float]:
    """Return ``value`` if it is a list of ``length`` numbers from 0 to ``most``."""
    entries = read_list(value, place)
    if len(entries) != length:
        raise InvalidInputError(f"{place}: {len(entries)} numbers; expected {length}")
    return [number(entry, f"{place}[{index}]", most=most) for index, entry in enumerate(entries)]


def texts(value: Any, place: str) -> list[str]:
    """Return ``value`` if it is a list of texts."""
    entries = read_list(value, place)
    for index, entry in enumerate(entries):
        if not isinstance(entry, str):
            raise InvalidInputError(f"{place}[{index}]: {entry!r}; expected a text")
    return entries


def detection(value: Any, assumptions: Assumptions, place: str) -> Detection:
    """Return ``value`` if it is a detection: a symbol a slot, or ``None``."""
    found = tuple(read_list(value, place))
    for symbol in found:
        if symbol is not None and (isinstance(symbol, bool) or not isinstance(symbol, int)):
            raise InvalidInputError(f"{place}: {list(found)!r}; expected a whole number or null for each slot")
    with placed(place):
        Evidence.of_detection(assumptions.alphabet, found)
    return found


def action(value: Any, assumptions: Assumptions, place: str) -> str | None:
    """Return ``value`` if it is the name of an action, or ``None``."""
    if value is not None and value not in assumptions.actions:
        raise InvalidInputError(f"{place}: {value!r}; expected one of: {', '.join(assumptions.actions)}")
    return value if value is None else str(value)


def shown(truth: Any) -> tuple[int, ...] | None:
    """Return the pattern that a world's truth says was shown, ``None`` if it says none."""
    pattern = truth.get("pattern") if isinstance(truth, Mapping) else None
    if isinstance(pattern, Sequence) and all(isinstance(symbol, int) for symbol in pattern):
        return tuple(pattern)
    return None


def presented(truth: Any, place: str) -> int | str:
    """Return which object a world's truth says was presented."""
    found = field_of(truth, "object", place)
    if not isinstance(found, (int, str)):
        raise InvalidInputError(f"{place}: object: {found!r}; expected a number or a name")
    return found


def told_truth(truth: Any) -> str:
    """Return in words what was presented, by a world's truth."""
    if not isinstance(truth, Mapping) or "object" not in truth:
        return "not recorded"
    return f"object number {truth['object']}" + (", lost" if truth.get("lost") else "")
