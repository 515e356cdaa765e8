"""The paper's own method: a Bayes filter, in NumPy.

A transition row is ``prior_weight · base_row`` plus a few counted edges (``atg_fg.inference.recognition_model``), so a
step costs what the known edges cost.
"""

from __future__ import annotations

from typing import ClassVar

from atg_fg.core.patterns import FloatArray
from atg_fg.engines.filtering import FilterInference
from atg_fg.inference.chain import forward_backward
from atg_fg.inference.expected_entropy import expected_entropies_of


class BayesFilter(FilterInference):
    """Exact filtering and forward-backward smoothing on plain arrays."""

    name: ClassVar[str] = "bayes-filter"
    exact: ClassVar[bool] = True

    def _propagate(self, aspects: FloatArray, action: int) -> FloatArray:
        return self.model.predict(aspects, action)

    def _correct(self, aspects: FloatArray, likelihood: FloatArray) -> FloatArray:
        return aspects * likelihood

    def _expected_entropies(self) -> FloatArray:
        """Return eq. 3 for each action, shape [A]."""
        return expected_entropies_of(self.model, self.aspect_belief)

    def _smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s by forward-backward."""
        return forward_backward(self.chain(hypothesis))
