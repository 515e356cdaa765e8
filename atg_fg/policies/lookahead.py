"""A policy that looks several actions ahead, where expected entropy (section 4 of the paper) looks one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Final, NamedTuple

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.belief_tree import BeliefNode, Observations
from atg_fg.inference.expected_entropy import TIE_TOLERANCE
from atg_fg.inference.interface import Inference
from atg_fg.policies.base import Choice, one_of_the_best

#: In nats: what can change the decision most is looked at first, and the rest only if that leaves it open.
_WEIGHTS: Final = (1e-2, 1e-4, 1e-6, 1e-8)


class Bounds(NamedTuple):
    """The least and the most that the expected entropy after several actions can be, by the first action.

    Attributes:
        low: Nats, shape [A].
        high: Nats, shape [A]; some plan that was examined attains this value.
    """

    low: FloatArray
    high: FloatArray

    @property
    def decide(self) -> bool:
        """Whether the action of least ``high`` is one of the best, whatever the values between the bounds are."""
        best = self.high.argmin()
        return bool((self.high[best] <= np.delete(self.low, best) + TIE_TOLERANCE).all())


class LookaheadPolicy:
    """Takes the action of least expected entropy of identity after ``horizon`` actions; ties are broken at random.

    Each later action is the best one for what will have been seen (expectimax over patterns):

        V_1(b) = min_a E[H(O | z, a)],    V_h(b) = min_a Σ_z p(z | a) V_{h−1}(b after a and z)

    The weight of a look z is what following it can change at most: p(z | a) H(O | z, a), or p(z | a) V_1 if two actions
    or more are to follow it. Looks that weigh little may be left to these bounds and 0; then the action of least upper
    bound is taken, which is the best one if the bounds decide.

    Args:
        horizon: h, the number of actions.
        least_weight: Looks of less weight, seen from now, are not followed, nats; with 0 the policy is exact.

    Raises:
        InvalidInputError: A value out of its range.
    """

    name: ClassVar[str] = "lookahead"

    def __init__(self, horizon: int, least_weight: float = 0.0) -> None:
        if horizon < 1:
            raise InvalidInputError(f"horizon: {horizon!r}; expected a whole number of at least 1")
        if not least_weight >= 0:
            raise InvalidInputError(f"least_weight: {least_weight!r}; expected nats, at least 0")
        self.horizon = horizon
        self.least_weight = least_weight

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the most informative action, with the upper bounds by first action."""
        expected = self.bounds(inference).high
        return Choice(one_of_the_best(expected, rng), expected)

    def bounds(self, inference: Inference) -> Bounds:
        """Return the least and the most that the expected entropy after ``horizon`` actions can be, by first action.

        Looks are followed until the decision is certain. If all have to be followed, the two agree up to rounding.
        """
        weights = [*(weight for weight in _WEIGHTS if weight > self.least_weight), self.least_weight]
        return bounds_ahead(inference.belief_tree(), self.horizon, weights)


def bounds_ahead(belief: BeliefNode, horizon: int, weights: Sequence[float]) -> Bounds:
    """Return the bounds of V_horizon by first action.

    Args:
        belief: The belief before the first action.
        horizon: Number of actions, at least 1.
        weights: Looks are followed whose weight is at least the first of these, in nats, then the second, and so on
            down to the last, until the bounds decide.
    """
    greedy = belief.expected_entropies()
    if horizon == 1:
        return Bounds(greedy, greedy)
    # More information can only lower expected entropy, and never below 0.
    bounds = Bounds(np.zeros_like(greedy), greedy.copy())
    branches = [_Branch(belief.after(action), horizon - 1, weights[-1]) for action in range(len(greedy))]
    for weight in weights:
        for action in np.argsort(bounds.high, kind="stable"):
            enough = float(bounds.high.min()) + TIE_TOLERANCE
            branches[action].follow(weight, enough)
            bounds.low[action], bounds.high[action] = branches[action].low, branches[action].high
        if bounds.decide:
            break
    return bounds


class _Branch:
    """What may come of one action: Σ_z p(z) V_horizon(z), at least and at most.

    Args:
        looks: What may be seen after the action.
        horizon: Number of actions after it, at least 1.
        least_weight: Looks of less weight, then or later, are not followed, nats.
    """

    def __init__(self, looks: Observations, horizon: int, least_weight: float) -> None:
        self._looks = looks
        self._horizon = horizon
        self._least_weight = least_weight
        self._probabilities = looks.probabilities
        self._high = self._probabilities * looks.entropies
        if horizon > 1:  # to look one action ahead after each look costs little beside looking two ahead after one
            possible = np.flatnonzero(self._probabilities > 0)
            self._high[possible] = self._one_ahead(possible)
        self._low = np.zeros_like(self._high)
        #: what following each look can change at most; 0 of those that were followed
        self._weights = self._high.copy()

    @property
    def low(self) -> float:
        """Return the least that it can be, nats."""
        return float(self._low.sum())

    @property
    def high(self) -> float:
        """Return the most that it can be, nats."""
        return float(self._high.sum())

    def follow(self, weight: float, enough: float) -> None:
        """Follow the looks of at least ``weight``, as long as the sum is not certain to be above ``enough``."""
        chosen = np.flatnonzero((self._weights > 0) & (self._weights >= weight))
        if self._horizon == 1:
            if len(chosen) and self.low <= enough:
                self._low[chosen] = self._high[chosen] = self._one_ahead(chosen)
                self._weights[chosen] = 0.0
            return
        # Looks with the greatest weight come first: so an action that cannot win is given up early.
        for look in chosen[np.argsort(-self._weights[chosen], kind="stable")]:
            if self.low > enough:
                return
            self._follow(int(look))
            self._weights[look] = 0.0

    def _one_ahead(self, looks: IntArray) -> FloatArray:
        """Return p(z) V_1(z) of some looks."""
        values: FloatArray = self._probabilities[looks] * self._looks.expected_entropies(looks).min(axis=1)
        return values

    def _follow(self, look: int) -> None:
        # The weights of looks after this one are relative to it.
        probability = self._probabilities[look]
        ahead = bounds_ahead(self._looks.belief(look), self._horizon, [self._least_weight / probability])
        self._low[look], self._high[look] = probability * ahead.low.min(), probability * ahead.high.min()
