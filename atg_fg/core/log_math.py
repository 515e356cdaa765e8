"""Logarithms of probabilities, zeros included."""

from __future__ import annotations

from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray

#: Smallest normal number: x ln x of what is below it is zero up to rounding.
_LEAST: Final = float(np.finfo(np.float64).tiny)


def x_log_x(x: FloatArray) -> FloatArray:
    """Return x ln x, elementwise, with 0 ln 0 = 0."""
    # A logarithm of all elements is several times as quick as one of those that are positive.
    return x * np.log(np.maximum(x, _LEAST))


def log_of(x: FloatArray) -> FloatArray:
    """Return ln x, elementwise, with ln 0 = −∞."""
    return np.log(x, out=np.full_like(x, -np.inf), where=x > 0)


def log_sum_exp(logarithms: FloatArray) -> float:
    """Return ln Σ exp of logarithms, of which −∞ stands for zero."""
    peak = float(logarithms.max())
    return peak + float(np.log(np.exp(logarithms - peak).sum())) if np.isfinite(peak) else peak
