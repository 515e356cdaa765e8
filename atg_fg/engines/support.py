"""What is possible at all, for engines whose own numbers do not tell the impossible from the improbable."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.interface import Inference
from atg_fg.inference.recognition_model import Revelation


class SupportedInference(Inference):
    """Engines that carry the support of p(O, X_t | z_0:t): which states have a positive probability.

    The support is exact, whatever the engine approximates and however small the probabilities. So evidence is refused
    if and only if the model gives it probability zero.

    Attributes:
        support: Whether p(O, X_t | z_0:t, a_1:t) > 0, shape [H, W].
    """

    def __init__(self, memory: RobotMemory, parameters: ModelParameters, prior: IdentityBelief | None = None) -> None:
        super().__init__(memory, parameters, prior)
        self.support: NDArray[np.bool_] = (self.model.prior[:, None] * self.model.base) > 0

    def _update(self, likelihood: FloatArray) -> None:
        support = self.support & (likelihood > 0)
        if not support.any():
            raise self._impossible()
        self._condition(likelihood)
        self.support = support

    def _divide(self, revelation: Revelation) -> None:
        mass = np.pad(self.support.astype(np.float64), ((0, 0), (0, self.model.n_states - self.support.shape[1])))
        revelation.move(mass)
        self.support = mass > 0
        self._share(revelation)

    def _predict(self, action: int) -> None:
        transition = self.model.transition(action)
        self.support = np.matmul(self.support[:, None, :].astype(np.float64), transition)[:, 0, :] > 0
        self._advance(transition)

    @abstractmethod
    def _condition(self, likelihood: FloatArray) -> None:
        """Take in a look that is possible, with p(z | x, i), shape [H, W]."""

    @abstractmethod
    def _share(self, revelation: Revelation) -> None:
        """Divide the belief in collection nodes with the aspects just found."""

    @abstractmethod
    def _advance(self, transition: FloatArray) -> None:
        """Take in an action with p(x' | x, a, i), shape [H, W, W]."""
