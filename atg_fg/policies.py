"""Policies that choose the next action (section 4 of the paper). A new policy is one class and one registry line."""

from __future__ import annotations

from typing import ClassVar, Final, NamedTuple, Protocol

import numpy as np

from atg_fg.engines.base import Inference
from atg_fg.errors import unknown_name
from atg_fg.patterns import FloatArray

#: Expected entropies closer than this, in nats, are a tie.
TIE_TOLERANCE: Final = 1e-9


class Choice(NamedTuple):
    """The chosen action, and the expected entropy of each, shape [A], if the policy looked at it."""

    action: int
    expected_entropies: FloatArray | None


class Policy(Protocol):
    """Chooses an action from the belief after a look; all randomness comes from the trial's generator."""

    name: ClassVar[str]

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the next action."""


def best_actions(expected_entropies: FloatArray) -> list[int]:
    """Return all actions whose expected entropy is the least, up to ``TIE_TOLERANCE``."""
    least = expected_entropies.min()
    return [int(action) for action in np.flatnonzero(expected_entropies <= least + TIE_TOLERANCE)]


class EntropyPolicy:
    """Takes the action of least expected entropy of identity (eq. 3); ties are broken at random."""

    name: ClassVar[str] = "entropy"

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the most informative action."""
        expected = inference.expected_entropies()
        ties = best_actions(expected)
        return Choice(ties[rng.integers(len(ties))], expected)


class RandomPolicy:
    """Takes any action, each with the same probability."""

    name: ClassVar[str] = "random"

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return an action drawn uniformly."""
        return Choice(int(rng.integers(inference.model.n_actions)), None)


POLICIES: Final[dict[str, type[Policy]]] = {policy.name: policy for policy in (EntropyPolicy, RandomPolicy)}


def make_policy(name: str) -> Policy:
    """Return the policy named ``name``, or raise ``UnknownNameError``."""
    if name not in POLICIES:
        raise unknown_name("policy", name, POLICIES)
    return POLICIES[name]()
