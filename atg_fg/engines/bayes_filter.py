"""The paper's own method: a Bayes filter.

A transition row is ``prior_weight · base_row`` plus a few counted edges (``atg_fg.inference.recognition_model``), so a
step costs what the known edges cost. Where Numba is installed the loops over them are compiled
(``atg_fg.inference.kernels``), and the model's tables are only made if something asks for them; else NumPy computes the
same.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

from atg_fg.core.actions import AnyAction
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.engines.filtering import FilterInference, FilterState
from atg_fg.engines.tables_on_demand import TablesOnDemand
from atg_fg.inference.kernels import compilation
from atg_fg.inference.recognition_model import RecognitionModel

if TYPE_CHECKING:
    from atg_fg.inference.kernels.compiled_filter import CompiledFilter


class BayesFilter(FilterInference):
    """Exact filtering and forward-backward smoothing on plain arrays."""

    name: ClassVar[str] = "bayes-filter"
    exact: ClassVar[bool] = True

    _compiled: CompiledFilter | None = None

    def make_tables(self) -> RecognitionModel:
        """Return the tables in force when the trial begins."""
        if not compilation.are_wanted():
            return super().make_tables()
        return TablesOnDemand(self.memory, self.parameters, self.prior, graphs=list(self.memory))

    def _begin(self) -> None:
        if not isinstance(self.model, TablesOnDemand):
            super()._begin()
            return
        from atg_fg.inference.kernels.compiled_filter import CompiledFilter  # it loads Numba

        self._compiled = CompiledFilter(self.memory, self.parameters, self.model.prior)

    @property
    def _belief(self) -> FilterState:
        return super()._belief if self._compiled is None else FilterState(*self._compiled.state())

    @property
    def _log_identity(self) -> FloatArray:
        """Ln p(O | z_0:t, a_1:t), shape [H]."""
        return super()._belief.log_identity if self._compiled is None else self._compiled.log_identity

    def identity(self) -> IdentityBelief:
        """Return p(O | z_0:t, a_1:t) (eq. 1 and 2)."""
        if self._compiled is None:
            return super().identity()
        return IdentityBelief.of(self._compiled.identity, self.model.n_unseen)

    def update(self, evidence: Evidence) -> None:
        """Condition on a look, the last of ``history``, and learn from it."""
        if self._compiled is None:
            super().update(evidence)
            return
        seen = self.history.step(len(self.history.evidence) - 1)
        log_probability = self._compiled.look(evidence.likelihood, seen)
        if not math.isfinite(log_probability):
            raise self.impossible_evidence()
        if evidence.measured:
            log_probability += self._compiled.weigh(self.model.objects.likelihood(evidence.measured))
            self.model.feel(evidence.measured)
        self.scaled_log_evidence += log_probability
        self.model.learn(*seen)

    def predict(self, action: AnyAction) -> None:
        """Predict the effect of an action, the last of ``history``."""
        if self._compiled is None:
            super().predict(action)
        else:
            self._compiled.act(action)

    def compute_expected_entropies(self) -> FloatArray:
        """Return E[H(O | z_{t+1}, a, …)] of each action (eq. 3), nats, shape [A]."""
        if self._compiled is None or self.model.objects.senses:
            return super().compute_expected_entropies()
        return self._compiled.expected_entropies(self.model.n_unseen)

    def propagate(self, aspects: FloatArray, action: int) -> FloatArray:
        """Return p(X_{t+1} | O, a, z_0:t) from p(X_t | O, z_0:t), both of shape [H, W]."""
        return self.model.predict(aspects, action)

    def correct(self, aspects: FloatArray, likelihood: FloatArray) -> FloatArray:
        """Return p(X_t, z_t | O, z_0:t-1), shape [H, W]."""
        return aspects * likelihood
