"""Acting on a belief: what each first action costs in each component of the belief, and the best of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference.interface import Inference
from atg_fg.inference.known_transitions import TransitionGraph
from atg_fg.policies.base import one_of_the_best

#: What an action costs of which no known path leads on: as much as a cube has aspects. More than any known path in an
#: ARcube's ATG needs, but in expectations it must not drown what is probable.
NO_PATH_COST: Final = 24.0


class ExpectedCosts(NamedTuple):
    """What the first actions cost in one component of the belief.

    Attributes:
        probability: Of the component.
        belief: Probability of each aspect in it; improbable ones may be left out.
        costs: Of each first action from each aspect, shape [A]; ∞ where no known path leads on.
    """

    probability: float
    belief: Mapping[int, float]
    costs: Mapping[int, FloatArray]

    @property
    def share_with_a_path(self) -> float:
        """Probability that the object is at an aspect from which some action leads on."""
        return sum(each for aspect, each in self.belief.items() if np.isfinite(self.costs[aspect]).any())


def by_component(
    inference: Inference, costs: Callable[[TransitionGraph], Mapping[int, FloatArray]]
) -> list[ExpectedCosts]:
    """Return the costs in each component of a belief, from a function of the transitions that are known there."""
    return [ExpectedCosts(each.probability, each.belief, costs(each.graph)) for each in inference.belief_components()]


def share_with_a_path(components: Sequence[ExpectedCosts]) -> float:
    """Return the probability that the object is where some action leads on."""
    total = sum(component.probability for component in components)
    led_on = sum(component.probability * component.share_with_a_path for component in components)
    return led_on / total if total > 0 else 0.0


def best_by_expectation(components: Sequence[ExpectedCosts], n_actions: int, rng: np.random.Generator) -> int:
    """Return an action of least expected cost; ties are broken at random."""
    expected = np.zeros(n_actions)
    for component in components:
        for aspect, probability in component.belief.items():
            expected += component.probability * probability * np.minimum(component.costs[aspect], NO_PATH_COST)
    return one_of_the_best(expected, rng)
