"""The joint normal density, in plain words: to import SciPy's takes a second of each worker of the tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atg_fg.core.patterns import FloatArray


def log_density(values: Sequence[float], mean: float, covariance: FloatArray) -> float:
    """ln p(values) of a normal distribution with one mean of all and this covariance, shape [n, n]."""
    away = np.array(values) - mean
    _, log_determinant = np.linalg.slogdet(2 * np.pi * covariance)
    return float(-(away @ np.linalg.solve(covariance, away) + log_determinant) / 2)
