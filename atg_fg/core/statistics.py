"""Intervals for measured rates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

from atg_fg.core import checks
from atg_fg.core.errors import InvalidInputError

#: Two-sided 95 % point of the normal distribution.
Z_95: Final = 1.959963984540054
#: Degrees of freedom beyond which Student's distribution is the normal one, but for less than 0.001.
_NORMAL: Final = 2400


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a rate; (0, 1) if there was no trial.

    Raises:
        InvalidInputError: Not 0 ≤ successes ≤ trials.
    """
    if not 0 <= successes <= trials:
        raise InvalidInputError(f"Wilson interval: {successes} of {trials}; expected 0 ≤ successes ≤ trials")
    if trials == 0:
        return 0.0, 1.0
    rate, z_squared = successes / trials, Z_95**2
    centre = rate + z_squared / (2 * trials)
    margin = Z_95 * math.sqrt(rate * (1 - rate) / trials + z_squared / (4 * trials**2))
    scale = 1 + z_squared / trials
    # At the ends the bound is the rate itself; rounding must not carry it past.
    low = 0.0 if successes == 0 else (centre - margin) / scale
    high = 1.0 if successes == trials else (centre + margin) / scale
    return low, high


def rate_document(count: int, of: int) -> dict[str, Any]:
    """Return a counted rate as JSON knows it, with its interval; ``None`` for the rate of nothing."""
    low, high = wilson_interval(count, of)
    return {"count": count, "of": of, "rate": count / of if of else None, "interval95": [low, high]}


def mean(values: Sequence[float]) -> float | None:
    """Return the mean, or ``None`` if there is no value."""
    return math.fsum(values) / len(values) if values else None


def mean_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Return Student's 95 % interval of the mean, or ``None`` for fewer than two values."""
    centre, error = mean(values), standard_error(values)
    if centre is None or error is None:
        return None
    margin = student_95(len(values) - 1) * error
    return centre - margin, centre + margin


def student_95(degrees_of_freedom: int) -> float:
    """Return the two-sided 95 % point of Student's t distribution, by halving: its share within ±t is a finite sum."""
    if degrees_of_freedom > _NORMAL:
        return Z_95
    low, high = Z_95, 13.0
    while high - low > 1e-12 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if _within(middle, degrees_of_freedom) < 0.95 else (low, middle)
    return high


def _within(t: float, degrees_of_freedom: int) -> float:
    """Return the share of Student's t distribution within ±t (Abramowitz & Stegun 26.7.3 and 26.7.4)."""
    angle, is_odd = math.atan(t / math.sqrt(degrees_of_freedom)), degrees_of_freedom % 2
    term = math.cos(angle) if is_odd else 1.0
    total = 0.0
    for number in range(is_odd, degrees_of_freedom - 1, 2):
        total += term
        term *= (number + 1) / (number + 2) * math.cos(angle) ** 2
    return 2 / math.pi * (angle + math.sin(angle) * total) if is_odd else math.sin(angle) * total


def standard_error(values: Sequence[float]) -> float | None:
    """Return the standard error of the mean, or ``None`` for fewer than two values."""
    if len(values) < 2:
        return None
    centre = math.fsum(values) / len(values)
    return math.sqrt(math.fsum((value - centre) ** 2 for value in values) / (len(values) - 1) / len(values))


class Rate(NamedTuple):
    """A rate of success, its 95 % interval, and what they are of.

    Attributes:
        names: Of the policy, or of the world, the noise and the variant.
        actions: A trial.
        success: Fraction of trials.
        low: Lower end of the interval.
        high: Upper end of the interval.
    """

    names: tuple[str, ...]
    actions: float
    success: float
    low: float
    high: float


def rates_of(points: Any, place: str, keys: Sequence[str]) -> list[Rate]:
    """Return what mappings with "actions", "success", "interval95" and names under these keys say.

    Raises:
        InvalidInputError: There is none, one lacks something, or a value is no name, number or fraction.
    """
    found = [_rate(point, f"{place}[{index}]", keys) for index, point in enumerate(checks.sequence(points, place))]
    if not found:
        raise InvalidInputError(f"{place}: none given; expected at least one")
    return found


def _rate(point: Any, place: str, keys: Sequence[str]) -> Rate:
    for key in (*keys, "actions", "success", "interval95"):
        if key not in checks.instance(point, place, Mapping):
            raise InvalidInputError(f"{place}: {checks.brief(dict(point))}; expected the key {key!r}")
    ends = f"{place}, key 'interval95'"
    if len(checks.sequence(point["interval95"], ends)) != 2:
        raise InvalidInputError(f"{ends}: {checks.brief(point['interval95'])}; expected two numbers")
    names = tuple(checks.plain_text(point[key], f"{place}, key {key!r}") for key in keys)
    fractions = [checks.number(point["success"], f"{place}, key 'success'", 0, 1)]
    fractions += [checks.number(end, ends, 0, 1) for end in point["interval95"]]
    checks.number(point["actions"], f"{place}, key 'actions'", 0, 1e9)
    return Rate(names, point["actions"], *fractions)
