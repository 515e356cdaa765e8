"""What peers share that answer queries on a Bayesian network of two time slices: O, X0, A, X1 and Z.

The belief after a look is p(O) and p(X0 | O) of the next query, so the network never grows.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.inference.expected_entropy import expected_entropies_of_table
from benchmarks.contestants import Contestant
from benchmarks.dense_tables import DenseModel

#: Arcs of the network.
ARCS = (("O", "X0"), ("O", "X1"), ("X0", "X1"), ("A", "X1"), ("O", "Z"), ("X1", "Z"))


class SlicesContestant(Contestant):
    """A filter by queries: p(O, X1 | a, z) after each look, p(O, Z | a) of all actions at once for a decision."""

    preset = "paper"

    def __init__(self, model: DenseModel) -> None:
        self._model = model
        self._belief = model.prior[:, None] * model.initial
        self._action: int | None = None

    def begin(self) -> None:
        """Begin a trial."""
        self._action = None
        self._belief = self._model.prior[:, None] * self._model.initial
        self._set_belief()

    def look(self, evidence: Evidence) -> None:
        """Take in a look at a whole pattern, after the action before it."""
        assert evidence.pattern is not None
        if self._action is None:
            # The first look is of X0 itself, which the network has no pattern for.
            joint = self._belief * self._model.observation[:, :, evidence.pattern]
            self._belief = joint / joint.sum()
        else:
            self._belief = self._next_belief(self._action, evidence.pattern)
        self._set_belief()

    def act(self, action: int) -> None:
        """Keep the action for the query after the next look."""
        self._action = action

    def decide(self) -> FloatArray:
        """Return the expected entropy of each action in nats, shape [A], from p(A, O, Z)."""
        joint = self._next_patterns() * self._model.n_actions
        return expected_entropies_of_table(joint, float(self._belief[-1].sum()), self._model.n_unseen)

    def identity(self) -> FloatArray:
        """Return p(O | z_0:t, a_1:t), shape [H]."""
        identity: FloatArray = self._belief.sum(axis=1)
        return identity

    def _split_belief(self) -> tuple[FloatArray, FloatArray]:
        """Return p(O), shape [H], and p(X0 | O), shape [H, W]; of an object that is ruled out, what it began with."""
        identity = self._belief.sum(axis=1)
        possible = identity > 0
        aspects = np.where(
            possible[:, None], self._belief / np.where(possible, identity, 1.0)[:, None], self._model.initial
        )
        return identity, aspects

    @abstractmethod
    def _set_belief(self) -> None:
        """Write ``self._belief`` into the network as p(O) and p(X0 | O)."""

    @abstractmethod
    def _next_belief(self, action: int, pattern: int) -> FloatArray:
        """Return p(O, X1 | action, pattern), shape [H, W]."""

    @abstractmethod
    def _next_patterns(self) -> FloatArray:
        """Return p(A, O, Z) with A uniform, shape [A, H, |𝒵|]."""
