"""Checks of values that come from users and files; each error names the place, the value and what was expected."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence, Set
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError

#: Numbers of arrays are not greater, so that sums of their squares are numbers, too.
GREATEST: Final = 1e100
#: More trials, actions or objects in one go are refused: memory is taken for all of them before the first is done.
MANY: Final = 100_000
#: A seed is not greater: as much as ``secrets.randbits(128)`` gives, and few enough digits to be written down.
GREATEST_SEED: Final = 2**128 - 1
#: Names that an error message tells.
_LISTED: Final = 24
_Value = TypeVar("_Value")


def whole_number(value: Any, place: str, least: int = 0, most: int | None = None) -> int:
    """Return ``value`` as an int, or raise ``InvalidInputError`` unless it is a whole number in these bounds."""
    is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not is_whole or value < least or (most is not None and value > most):
        bounds = f"of at least {least}" if most is None else f"from {least} to {most}"
        raise InvalidInputError(f"{place}: {brief(value)}; expected a whole number {bounds}")
    return int(value)


def is_number(value: Any) -> bool:
    """Whether ``value`` is a number of Python's or NumPy's, and no truth value."""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def number(
    value: Any,
    place: str,
    least: float = -math.inf,
    most: float = math.inf,
    *,
    below: float = math.inf,
    slack: float = 0.0,
) -> float:
    """Return ``value`` as a float, or raise ``InvalidInputError`` unless it is a finite number in these bounds.

    Args:
        value: What is checked.
        place: Named in the error.
        least: Lower bound.
        most: Upper bound.
        below: Upper bound that is itself not allowed.
        slack: How far rounding may have carried it past a bound.
    """
    try:
        found = float(value) if is_number(value) else math.nan
    except OverflowError:  # a whole number too large for a float
        found = math.inf
    if not math.isfinite(found) or not least - slack <= found <= most + slack or found >= below:
        ends = f"to below {below:g}" if below < math.inf else f"to {most:g}" if most < math.inf else ""
        bounds = f" from {least:g} {ends}" if ends else f" of at least {least:g}" * (least > -math.inf)
        raise InvalidInputError(f"{place}: {brief(value)}; expected a finite number{bounds}")
    return found


def floats(value: Any, place: str, expected: str) -> NDArray[np.float64]:
    """Return ``value`` as an array of floats, or raise ``InvalidInputError`` unless it is one of real numbers.

    Args:
        value: What is checked; it is not copied if it is of floats already.
        place: Named in the error.
        expected: What the error says is expected.
    """
    try:
        return np.asarray(value).astype(np.float64, casting="same_kind", copy=False)
    except (TypeError, ValueError) as error:  # texts, complex numbers, or rows of several lengths
        raise InvalidInputError(f"{place}: {brief(value)}; expected {expected}") from error


def finite_array(value: Any, place: str, shape: Sequence[int | None], expected: str) -> NDArray[np.float64]:
    """Return ``value`` as ``floats`` does, but only if it is of this shape, and squares of its numbers are finite.

    Args:
        value: What is checked.
        place: Named in the error.
        shape: ``None`` stands for any length.
        expected: What the error says is expected.
    """
    found = floats(value, place, expected)
    fits = len(shape) == found.ndim and all(want in (None, is_) for want, is_ in zip(shape, found.shape, strict=True))
    if not fits:
        raise InvalidInputError(f"{place}: shape {found.shape}; expected {expected}")
    if not (np.abs(found) <= GREATEST).all():
        n_infinite = int((~np.isfinite(found)).sum())
        what = f"{n_infinite} not finite" if n_infinite else f"{np.abs(found).max():g}"
        raise InvalidInputError(f"{place}: {what}; expected finite numbers{'' if n_infinite else f' to {GREATEST:g}'}")
    return found


def one_of(value: Any, place: str, known: Collection[str]) -> str:
    """Return ``value``, or raise ``InvalidInputError`` unless it is one of the texts ``known``."""
    if not isinstance(value, str) or value not in known:
        raise InvalidInputError(f"{place}: {brief(value)}; expected one of: {', '.join(known)}")
    return value


def distinct_names(value: Any, place: str) -> tuple[str, ...]:
    """Return ``value`` as a tuple, or raise ``InvalidInputError`` unless it is a sequence of different names."""
    is_sequence = isinstance(value, Sequence) and not isinstance(value, str)
    if not is_sequence or not value or not all(isinstance(name, str) for name in value) or len(set(value)) < len(value):
        raise InvalidInputError(f"{place}: {brief(value)}; expected at least one name, all different")
    return tuple(value)


def sequence(value: Any, place: str) -> Sequence[Any]:
    """Return ``value``, or raise ``InvalidInputError`` unless it has a length and an order, and is no text."""
    if not is_sequence(value):
        raise InvalidInputError(f"{place}: {brief(value)}; expected a sequence")
    found: Sequence[Any] = value
    return found


def is_sequence(value: Any) -> bool:
    """Return whether a value has a length and an order, and is no text."""
    has_order = not isinstance(value, (str, bytes, Mapping, Set))
    return has_order and hasattr(value, "__len__") and hasattr(value, "__iter__")


def plain_text(value: Any, place: str) -> str:
    """Return ``value``, or raise ``InvalidInputError`` unless it is a text of whole characters, and not empty."""
    if not isinstance(value, str) or not value:
        raise InvalidInputError(f"{place}: {brief(value)}; expected a text that is not empty")
    try:
        value.encode()
    except UnicodeError as error:  # JSON can say half a character
        raise InvalidInputError(f"{place}: {brief(value)}; expected a text of whole characters") from error
    return value


def listed(names: Iterable[str]) -> str:
    """Return names with commas between them; of many the first ones, and how many others there are."""
    known = list(names)
    more = f" and {len(known) - _LISTED} others" if len(known) > _LISTED else ""
    return ", ".join(name if len(name) <= 60 else f"{name[:57]}..." for name in known[:_LISTED]) + more


def instance(value: _Value, place: str, kind: type) -> _Value:
    """Return ``value``, or raise ``InvalidInputError`` unless it is of this class."""
    if not isinstance(value, kind):
        raise InvalidInputError(f"{place}: {brief(value)}; expected {kind.__name__}")
    return value


def title_or(value: Any, usual: str) -> str:
    """Return a title that was given, ``usual`` if none was, or raise ``InvalidInputError`` if it is no text."""
    return usual if value is None or (isinstance(value, str) and not value) else plain_text(value, "title")


def brief(value: Any) -> str:
    """Return what a value is, in at most 60 characters."""
    try:
        told = repr(value)
    except (ValueError, RecursionError):  # a number of thousands of digits, or lists in lists without end
        told = f"a {type(value).__name__} too long to be shown"
    return told if len(told) <= 60 else told[:57] + "..."
