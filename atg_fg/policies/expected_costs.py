"""Acting on a belief: what each first action costs in whatever situation there may be, and the best of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference.belief_components import Situation
from atg_fg.policies.base import one_of_the_best

#: What an action costs of which no known path leads on: as much as a cube has aspects. More than any known path in an
#: ARcube's ATG needs, but in expectations it must not drown what is probable.
NO_PATH_COST: Final = 24.0


class Outlook(NamedTuple):
    """What the robot is to expect of its actions in one situation.

    Attributes:
        probability: Of the situation.
        belief: Probability of each aspect in it; improbable ones may be left out.
        costs: Of each first action from each aspect, shape [A]; ∞ where no known path leads on.
    """

    probability: float
    belief: Mapping[int, float]
    costs: Mapping[int, FloatArray]

    @classmethod
    def on(cls, situation: Situation, costs: Mapping[int, FloatArray]) -> Outlook:
        """Return the outlook of a situation with these costs."""
        return cls(situation.probability, situation.belief, costs)

    @property
    def share_with_a_path(self) -> float:
        """Probability to be at an aspect from which some action leads on."""
        return sum(each for aspect, each in self.belief.items() if np.isfinite(self.costs[aspect]).any())


def share_with_a_path(outlooks: Sequence[Outlook]) -> float:
    """Return the share of all probability that is where some action leads on."""
    total = sum(outlook.probability for outlook in outlooks)
    led_on = sum(outlook.probability * outlook.share_with_a_path for outlook in outlooks)
    return led_on / total if total > 0 else 0.0


def best_by_expectation(outlooks: Sequence[Outlook], n_actions: int, rng: np.random.Generator) -> int:
    """Return an action of least expected cost; ties are broken at random."""
    expected = np.zeros(n_actions)
    for outlook in outlooks:
        for aspect, probability in outlook.belief.items():
            expected += outlook.probability * probability * np.minimum(outlook.costs[aspect], NO_PATH_COST)
    return one_of_the_best(expected, rng)
