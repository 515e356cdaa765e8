"""A belief as few numbers: the observation of an agent from a library of reinforcement learning."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.interface import Inference

#: Remembered objects whose probabilities are given one by one.
TOP: Final = 5
#: Expected gains up to this are none, in nats.
_NO_GAIN: Final = 1e-9


class BeliefFeatures:
    """The state of a trial after a look as a vector of fixed length, every entry from 0 to 1.

    Its entries, in this order:

    - the probabilities of the ``top`` most probable remembered objects, the greatest first, 0 where there are fewer;
    - the probability of *unseen*;
    - the entropy of identity, as a fraction of ln |O|;
    - one divided by the number of looks so far;
    - the entropy that each action is expected to take away (by eq. 3), as a share of what the best one is, and 0 where
      none is expected to take any away, unless these are left out;
    - for each slot, the probability of each symbol by the last look alone.

    It does not depend on how many objects are remembered, so an agent that was trained with one memory can be used
    with another.

    Args:
        assumptions: Of the memory.
        top: How many objects are given one by one.
        expected_entropies: Whether the expected entropies are among the entries.

    Raises:
        InvalidInputError: ``top`` is below one.
    """

    def __init__(self, assumptions: Assumptions, top: int = TOP, *, expected_entropies: bool = True) -> None:
        whole_number(top, "top", least=1)
        self.assumptions, self.top, self.expected_entropies = assumptions, top, expected_entropies

    @property
    def length(self) -> int:
        """The number of entries."""
        alphabet = self.assumptions.alphabet
        n_expected = len(self.assumptions.actions) if self.expected_entropies else 0
        return self.top + 3 + n_expected + len(alphabet.slots) * alphabet.n_symbols

    @property
    def space(self) -> spaces.Space[NDArray[np.float32]]:
        """The gymnasium space of all features."""
        box: spaces.Space[Any] = spaces.Box(0.0, 1.0, (self.length,), np.float32)
        return box

    def of(self, inference: Inference) -> NDArray[np.float32]:
        """Return the features of a trial after a look, shape [``length``].

        Raises:
            InvalidInputError: The trial is under other assumptions, or before a look.
        """
        if inference.memory.assumptions != self.assumptions:
            raise InvalidInputError("belief features: the trial is under other assumptions than they are")
        if inference.history.awaits_evidence:
            raise InvalidInputError("belief features: asked before the look; expected an observation first")
        belief = inference.identity()
        best = np.zeros(self.top)
        found = np.sort(belief.objects)[::-1][: self.top]
        best[: len(found)] = found
        most = np.log(max(self.assumptions.n_objects, 2))
        plain = [belief.unseen, belief.entropy / most, 1 / len(inference.history.evidence)]
        gains = self._gains(inference, belief.entropy)
        entries: FloatArray = np.concatenate([best, plain, gains, self._symbols(inference)])
        # The entropy can exceed ln |O| if the memory holds more objects than the assumptions say there are.
        return entries.clip(0.0, 1.0).astype(np.float32)

    def _gains(self, inference: Inference, entropy: float) -> FloatArray:
        """Return the entropy that each action is expected to take away, as a share of what the best one is, shape [A].

        Shares are given because gains are small compared with ln |O|; a network learns little from small differences.
        """
        if not self.expected_entropies:
            return np.empty(0)
        gains = (entropy - inference.expected_entropies()).clip(0.0)
        return gains / gains.max() if gains.max() > _NO_GAIN else np.zeros_like(gains)

    def _symbols(self, inference: Inference) -> FloatArray:
        """Return the probability of each symbol in each slot by the last look alone, shape [slots · symbols]."""
        alphabet = self.assumptions.alphabet
        likelihood = inference.history.evidence[-1].likelihood
        weights = likelihood / likelihood.sum()
        slots = [np.bincount(column, weights, alphabet.n_symbols) for column in alphabet.symbols.T]
        return np.concatenate(slots)
