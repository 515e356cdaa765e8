"""Brute force over every state of (O, X_0:t): slow, small, and too simple to be wrong."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from atg_fg.core.actions import AnyAction
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import TooLargeError
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.inference.interface import Inference, TrialSetup

#: Most explanations (O, X_0:t) that are enumerated: 160 MB of weights.
MAX_EXPLANATIONS = 20_000_000
#: Most axes of a NumPy array.
MAX_AXES = 64


class Enumeration(Inference):
    """Keeps p(o, x_0, …, x_t | z_0:t, a_1:t) of every explanation, shape [H, W_0, …, W_t].

    Raises:
        TooLargeError: A step would need over ``MAX_EXPLANATIONS`` weights.
    """

    name: ClassVar[str] = "enumeration"
    exact: ClassVar[bool] = True
    scaled_log_evidence: float = 0.0

    def __init__(self, setup: TrialSetup) -> None:
        super().__init__(setup)
        self.weights: FloatArray = self.model.prior[:, None] * self.model.base_row

    def identity(self) -> IdentityBelief:
        """Return p(O | z_0:t, a_1:t) (eq. 1 and 2)."""
        return self._identity_of(self.weights)

    def compute_smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s."""
        weights = self.weights[hypothesis] / (self.weights[hypothesis].sum() or 1.0)
        times = range(weights.ndim)
        return [weights.sum(axis=tuple(other for other in times if other != time)) for time in times]

    def _identity_of(self, weights: FloatArray) -> IdentityBelief:
        by_object = weights.reshape(len(weights), -1).sum(axis=1) / weights.sum()
        return IdentityBelief.of(by_object, self.model.n_unseen)

    def update(self, evidence: Evidence) -> None:
        """Condition on a look, the last of ``history``, and learn from it."""
        weights = self._times_last(self.weights, self.model.likelihood(evidence))
        total = weights.sum()
        if not total > 0:
            raise self.impossible_evidence()
        self.weights = weights / total
        self.scaled_log_evidence += float(np.log(total))
        revelation = self.learn_from_look()
        if revelation is not None:
            padding = [(0, 0)] * (self.weights.ndim - 1) + [(0, self.model.n_states - self.weights.shape[-1])]
            weights = np.moveaxis(np.pad(self.weights, padding), 0, -2)  # a copy with axes [W_0, …, H, W_t]
            revelation.move(weights)
            self.weights = np.moveaxis(weights, -2, 0)

    def predict(self, action: AnyAction) -> None:
        """Predict the effect of an action, the last of ``history``."""
        self.weights = self._extended(self.weights, action)

    def _extended(self, weights: FloatArray, action: AnyAction) -> FloatArray:
        """Every explanation followed by every next aspect, shape [H, W_0, …, W_t, W_t+1]."""
        if weights.size * self.model.n_states > MAX_EXPLANATIONS or weights.ndim == MAX_AXES:
            raise TooLargeError(
                f"engine 'enumeration': {weights.size * self.model.n_states} explanations after "
                f"{len(self.history.evidence)} observations; expected at most {MAX_EXPLANATIONS} and at most "
                f"{MAX_AXES - 1} observations, so use another engine"
            )
        transition = self.model.transition(action)
        past = (1,) * (weights.ndim - 2)
        return weights[..., None] * transition.reshape(len(weights), *past, *transition.shape[1:])

    @staticmethod
    def _times_last(weights: FloatArray, likelihood: FloatArray) -> FloatArray:
        past = (1,) * (weights.ndim - 2)
        return weights * likelihood.reshape(len(weights), *past, likelihood.shape[1])

    def compute_expected_entropies(self) -> FloatArray:
        """Add every hypothetical action and then every hypothetical pattern and reading, as eq. 3 is written.

        What is to come depends on the past through X_t alone, so explanations that end alike are summed first.
        """
        entropies = np.zeros(self.model.n_actions)
        last = self.weights.sum(axis=tuple(range(1, self.weights.ndim - 1)))
        total = last.sum()
        for action in range(self.model.n_actions):
            predicted = self._extended(last, action)
            revealed = self.model.objects.revealed_by(self.memory.assumptions.actions[action])
            readings = self.model.objects.readings(revealed, last.sum(axis=1) / total)
            for pattern in range(self.model.n_patterns):
                likelihood = np.zeros(self.model.n_patterns)
                likelihood[pattern] = 1.0
                observed = self._times_last(predicted, self.model.likelihood(Evidence(likelihood)))
                for weight, density in zip(readings.weights, readings.densities, strict=True):
                    felt = self._times_last(observed, density[:, None])
                    probability = weight * felt.sum() / total
                    if probability > 0:
                        entropies[action] += probability * self._identity_of(felt).entropy
        return entropies
