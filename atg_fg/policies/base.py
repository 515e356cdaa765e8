"""What a policy is, and how one is chosen among actions that are equally good."""

from __future__ import annotations

from typing import ClassVar, NamedTuple, Protocol

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference.expected_entropy import best_actions
from atg_fg.inference.interface import Inference


class Choice(NamedTuple):
    """What a policy decides after a look.

    Attributes:
        action: Index of the chosen action; ``None`` ends the trial.
        expected_entropies: Of each action in nats, shape [A], if the policy looked at them; if the policy looks
            several actions ahead, those after that many actions.
        purpose: What the action is for, or why the trial ends, if the policy has more than one.
    """

    action: int | None
    expected_entropies: FloatArray | None
    purpose: str | None = None


class Policy(Protocol):
    """Chooses an action from the belief after a look; all randomness comes from the trial's generator."""

    name: ClassVar[str]

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the next action."""


def one_of_the_best(costs: FloatArray, rng: np.random.Generator) -> int:
    """Return an action of least cost; ties are broken at random, since a fixed choice would favour one action."""
    ties = best_actions(costs)
    return ties[rng.integers(len(ties))]
