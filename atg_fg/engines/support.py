"""The support of the belief, for engines whose own numbers do not tell the impossible from the improbable."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.actions import AnyAction
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.interface import Inference, TrialSetup
from atg_fg.inference.recognition_model import Revelation


class SupportedInference(Inference):
    """Engines that carry the support of p(O, X_t | z_0:t): which states have a positive probability.

    The support is exact, whatever the engine approximates and however small the probabilities. So evidence is refused
    if and only if the model gives it probability zero.

    Attributes:
        support: Whether p(O, X_t | z_0:t, a_1:t) > 0, shape [H, W].
    """

    def __init__(self, setup: TrialSetup) -> None:
        super().__init__(setup)
        self.support: NDArray[np.bool_] = (self.model.prior[:, None] * self.model.base_row) > 0

    def _check_possible(self, likelihood: FloatArray) -> None:
        """Condition the support on a look by p(z | x, i), shape [H, W]; raise before any change if it is impossible."""
        support = self.support & (likelihood > 0)
        if not support.any():
            raise self.impossible_evidence()
        self.support = support

    def learn_from_look(self) -> Revelation | None:
        """Let the tables and the support learn from the last look; return how the belief is to be divided, if so."""
        revelation = super().learn_from_look()
        if revelation is not None:
            mass = np.pad(self.support.astype(np.float64), ((0, 0), (0, self.model.n_states - self.support.shape[1])))
            revelation.move(mass)
            self.support = mass > 0
        return revelation

    def _predict_support(self, action: AnyAction) -> FloatArray:
        """Predict the support, and return p(x' | x, a, i), shape [H, W, W]."""
        transition = self.model.transition(action)
        self.support = np.matmul(self.support[:, None, :].astype(np.float64), transition)[:, 0, :] > 0
        return transition
