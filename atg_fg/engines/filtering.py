"""What engines share that carry a belief forward from look to look."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction, mixed
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.log_math import log_of
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.inference.interface import Inference, TrialSetup
from atg_fg.inference.recognition_model import widened


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
