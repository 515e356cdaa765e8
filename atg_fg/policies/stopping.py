"""A policy that ends the trial when identity or novelty is settled."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.inference.interface import Inference
from atg_fg.policies.base import Choice, Policy


class StoppingPolicy:
    """Leaves the choice to another policy until the verdict is settled, and then ends the trial.

    Args:
        policy: Chooses the actions.
        settled: Entropy of O in nats, with *unseen* as one state, at which the trial ends or below which.

    Raises:
        InvalidInputError: ``settled`` is not a finite entropy above 0.
    """

    name: ClassVar[str] = "stopping"

    def __init__(self, policy: Policy, settled: float) -> None:
        self.policy = policy
        self.settled = check_settled(settled, "settled")

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the next action, or none with purpose ``settled``."""
        if inference.identity().entropy_of_verdict <= self.settled:
            return Choice(None, None, "settled")
        return self.policy.choose(inference, rng)


def check_settled(settled: float, place: str) -> float:
    """Return an entropy below which a verdict is settled.

    Raises:
        InvalidInputError: Not a finite number above 0; the message begins with ``place``.
    """
    if not 0 < settled < math.inf:
        raise InvalidInputError(f"{place}: {settled!r}; expected a finite entropy above 0 nats")
    return settled
