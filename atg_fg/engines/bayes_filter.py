"""The paper's own method: a Bayes filter, in NumPy.

A transition row is ``prior_weight · base_row`` plus a few counted edges (``atg_fg.inference.recognition_model``), so a
step costs what the known edges cost.
"""

from __future__ import annotations

from typing import ClassVar

from atg_fg.core.patterns import FloatArray
from atg_fg.engines.filtering import FilterInference


class BayesFilter(FilterInference):
    """Exact filtering and forward-backward smoothing on plain arrays."""

    name: ClassVar[str] = "bayes-filter"
    exact: ClassVar[bool] = True

    def _propagate(self, aspects: FloatArray, action: int) -> FloatArray:
        return self.model.predict(aspects, action)

    def _correct(self, aspects: FloatArray, likelihood: FloatArray) -> FloatArray:
        return aspects * likelihood
