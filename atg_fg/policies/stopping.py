"""A policy that ends the trial when identity or novelty is settled."""

from __future__ import annotations

import sys
from typing import ClassVar

import numpy as np

from atg_fg.core.checks import brief, is_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.inference.interface import Inference
from atg_fg.policies.agent import as_policy
from atg_fg.policies.base import Choice, Policy


class StoppingPolicy:
    """Leaves the choice to another policy until the verdict is settled, and then ends the trial.

    Args:
        policy: Chooses the actions.
        entropy_threshold: The trial ends when the entropy of O, with *unseen* as one state, is at most this, nats.

    Raises:
        InvalidInputError: The threshold is not a finite entropy above 0.
    """

    name: ClassVar[str] = "stopping"

    def __init__(self, policy: Policy, entropy_threshold: float) -> None:
        self.policy = as_policy(policy)
        self.entropy_threshold = check_entropy_threshold(entropy_threshold, "entropy_threshold")

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the next action, or none with purpose ``settled``."""
        if inference.identity().entropy_of_verdict <= self.entropy_threshold:
            return Choice(None, None, "settled")
        return self.policy.choose(inference, rng)


def check_entropy_threshold(threshold: float, place: str) -> float:
    """Return a threshold of entropy.

    Raises:
        InvalidInputError: Not a finite number above 0; the message begins with ``place``.
    """
    if not (is_number(threshold) and 0 < threshold <= sys.float_info.max):
        raise InvalidInputError(f"{place}: {brief(threshold)}; expected a finite entropy above 0 nats")
    return threshold
