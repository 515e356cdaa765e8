"""The paper's own method: a Bayes filter.

A transition row is ``prior_weight · base_row`` plus a few counted edges (``atg_fg.inference.recognition_model``), so a
step costs what the known edges cost. Where Numba is installed the loops over them are compiled
(``atg_fg.inference.kernels``), and the model's tables are only made if something asks for them; else NumPy computes the
same.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction, mixed
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.log_math import log_of
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.engines.tables_on_demand import TablesOnDemand
from atg_fg.inference.interface import Inference, TrialSetup
from atg_fg.inference.kernels import compilation
from atg_fg.inference.recognition_model import RecognitionModel, widened

if TYPE_CHECKING:
    from atg_fg.inference.kernels.compiled_filter import CompiledFilter


class FilterState(NamedTuple):
    """A filter's state: ln p(O | z), shape [H], and p(X_t | O, z), shape [H, W]."""

    log_identity: FloatArray
    aspects: FloatArray


class FilterInference(Inference):
    """Engines that carry p(O, X_t | z_0:t) forward.

    The belief is kept as ln p(O) and p(X_t | O). So an object that has been improbable for a thousand steps can come
    back when the evidence turns, where a plain product would have underflowed to zero.
    """

    scaled_log_evidence: float = 0.0

    def __init__(self, setup: TrialSetup) -> None:
        super().__init__(setup)
        self._begin()

    def _begin(self) -> None:
        self._state = FilterState(log_of(self.model.prior), self.model.base_row)

    @property
    def _belief(self) -> FilterState:
        """The belief; an engine that keeps it in a form of its own overrides this."""
        return self._state

    def identity(self) -> IdentityBelief:
        """Return p(O | z_0:t, a_1:t) (eq. 1 and 2)."""
        probabilities = np.exp(self._belief.log_identity)
        return IdentityBelief.of(probabilities, self.model.n_unseen)

    @property
    def aspect_belief(self) -> FloatArray:
        """p(O, X_t | z_0:t, a_1:t), shape [H, W]."""
        return np.exp(self._belief.log_identity)[:, None] * self._belief.aspects

    def update(self, evidence: Evidence) -> None:
        """Condition on a look, the last of ``history``, and learn from it."""
        self._condition(self.model.likelihood(evidence))
        revelation = self.learn_from_look()
        if revelation is not None:
            aspects = widened(self._state.aspects, self.model.n_states)
            revelation.move(aspects)
            self._state = FilterState(self._state.log_identity, aspects)

    def _condition(self, likelihood: FloatArray) -> None:
        joint = self.correct(self._state.aspects, likelihood)
        given_object = joint.sum(axis=1)
        possible = given_object > 0
        log_joint = self._state.log_identity + log_of(given_object)
        peak = log_joint.max()
        if not np.isfinite(peak):
            raise self.impossible_evidence()
        log_probability = float(peak + np.log(np.exp(log_joint - peak).sum()))
        aspects = joint / np.where(possible, given_object, 1.0)[:, None]
        if not possible.all():
            # A hypothesis that is ruled out keeps its prediction; its weight is zero from here on.
            aspects[~possible] = self._state.aspects[~possible]
        self._state = FilterState(log_joint - log_probability, aspects)
        self.scaled_log_evidence += log_probability

    def predict(self, action: AnyAction) -> None:
        """Predict the effect of an action, the last of ``history``."""
        before = self._state.aspects
        aspects = mixed(action, lambda index: self.propagate(before, index), before)
        self._state = FilterState(self._state.log_identity, aspects)

    @abstractmethod
    def propagate(self, aspects: FloatArray, action: int) -> FloatArray:
        """Return p(X_{t+1} | O, a, z_0:t) from p(X_t | O, z_0:t), both of shape [H, W]."""

    @abstractmethod
    def correct(self, aspects: FloatArray, likelihood: FloatArray) -> FloatArray:
        """Return p(X_t, z_t | O, z_0:t-1), shape [H, W]."""


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
