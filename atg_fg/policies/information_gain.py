"""Policies of recognition: the paper's expected entropy (section 4), and chance."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from atg_fg.inference.interface import Inference
from atg_fg.policies.base import Choice, one_of_the_best


class EntropyPolicy:
    """Takes the action of least expected entropy of identity (eq. 3); ties are broken at random."""

    name: ClassVar[str] = "entropy"

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the most informative action."""
        expected = inference.expected_entropies()
        return Choice(one_of_the_best(expected, rng), expected)


class RandomPolicy:
    """Takes any action, each with the same probability."""

    name: ClassVar[str] = "random"

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return an action drawn uniformly."""
        return Choice(int(rng.integers(inference.model.n_actions)), None)
