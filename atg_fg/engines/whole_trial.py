"""Engines that answer from the whole trial, anew after every step."""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.patterns import Evidence, FloatArray, protect
from atg_fg.engines.support import SupportedInference
from atg_fg.inference.chain import Chain
from atg_fg.inference.interface import TrialSetup


class Posterior(NamedTuple):
    """What an engine infers of one trial, exactly or not.

    Attributes:
        identity: p(O | z_0:t, a_1:t), shape [H].
        joint: p(O, X_t | z_0:t, a_1:t), shape [H, W_t].
        log_evidence: ln p(z_0:t | a_1:t).
    """

    identity: FloatArray
    joint: FloatArray
    log_evidence: float


class WholeTrialInference(SupportedInference):
    """Engines that make a ``Posterior`` of the trial's chain at the first question after a step, and keep it."""

    def __init__(self, setup: TrialSetup) -> None:
        super().__init__(setup)
        self._posterior: Posterior | None = None

    @property
    def posterior(self) -> Posterior:
        """What is inferred of the trial so far; before the first look it is the prior."""
        if self._posterior is None:
            self._posterior = self._solve_scaled() if self.history.evidence else self._prior()
            protect(self._posterior)
        return self._posterior

    def identity(self) -> IdentityBelief:
        """Return p(O | z_0:t, a_1:t) (eq. 1 and 2)."""
        probabilities = self.posterior.identity
        return IdentityBelief.of(probabilities, self.model.n_unseen)

    @property
    def scaled_log_evidence(self) -> float:
        """Return ln p(z_0:t | a_1:t), or what the engine takes it to be."""
        return self.posterior.log_evidence

    @property
    def aspect_belief(self) -> FloatArray:
        """p(O, X_t | z_0:t, a_1:t), shape [H, W], or what the engine takes it to be."""
        return self.posterior.joint

    def _prior(self) -> Posterior:
        return Posterior(self.model.prior, self.model.prior[:, None] * self.model.base_row, 0.0)

    def _solve_scaled(self) -> Posterior:
        chain, log_scale = self.chain().scaled()
        identity, joint, log_evidence = self.solve(chain)
        return Posterior(identity, joint, log_evidence + log_scale)

    def update(self, evidence: Evidence) -> None:
        """Condition on a look, the last of ``history``, and learn from it."""
        self._check_possible(self.model.likelihood(evidence))
        self.learn_from_look()
        self._posterior = None

    def predict(self, action: AnyAction) -> None:
        """Predict the effect of an action, the last of ``history``."""
        self._predict_support(action)
        self._posterior = None

    @abstractmethod
    def solve(self, chain: Chain) -> Posterior:
        """Return the posterior of a chain whose likelihoods are at most one."""


def joint_of(identity: FloatArray, aspects: FloatArray) -> FloatArray:
    """Return p(O, X), shape [H, W], from p(O), shape [H], and weights of p(X | O) that need not be normalised."""
    total = aspects.sum(axis=1)
    joint: FloatArray = (identity / np.where(total > 0, total, 1.0))[:, None] * aspects
    return joint
