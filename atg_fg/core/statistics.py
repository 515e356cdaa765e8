"""Intervals for measured rates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from atg_fg.core.errors import InvalidInputError

#: Two-sided 95 % point of the normal distribution.
Z_95: Final = 1.959963984540054


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


def mean(values: Sequence[float]) -> float | None:
    """Return the mean, or ``None`` if there is no value."""
    return math.fsum(values) / len(values) if values else None


def mean_interval(values: Sequence[float]) -> tuple[float, float] | None:
    """Return the normal 95 % interval of the mean, or ``None`` for fewer than two values."""
    centre, error = mean(values), standard_error(values)
    return None if centre is None or error is None else (centre - Z_95 * error, centre + Z_95 * error)


def standard_error(values: Sequence[float]) -> float | None:
    """Return the standard error of the mean, or ``None`` for fewer than two values."""
    if len(values) < 2:
        return None
    centre = math.fsum(values) / len(values)
    return math.sqrt(math.fsum((value - centre) ** 2 for value in values) / (len(values) - 1) / len(values))
