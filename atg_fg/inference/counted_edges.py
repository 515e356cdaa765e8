"""Counted transitions of all hypotheses as arrays, and the states that they lead to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray


class Edges(NamedTuple):
    """Counted transitions of all hypotheses, one entry an edge, all arrays of shape [E]."""

    action: IntArray
    hypothesis: IntArray
    source: IntArray
    target: IntArray
    weight: FloatArray

    def followed_by(self, other: Edges) -> Edges:
        """Return the entries of both."""
        return Edges(
            np.concatenate((self.action, other.action)),
            np.concatenate((self.hypothesis, other.hypothesis)),
            np.concatenate((self.source, other.source)),
            np.concatenate((self.target, other.target)),
            np.concatenate((self.weight, other.weight)),
        )

    def chosen(self, which: IntArray | NDArray[np.bool_] | slice) -> Edges:
        """Return some of the entries."""
        return Edges(
            self.action[which], self.hypothesis[which], self.source[which], self.target[which], self.weight[which]
        )

    def of_action(self, action: int) -> IntArray:
        """Return which entries are of an action, shape [E']."""
        return np.flatnonzero(self.action == action)


class Targets(NamedTuple):
    """The distinct (action, hypothesis, state) that edges lead to, all arrays of shape [R].

    Attributes:
        action: Index of the action.
        hypothesis: Index of the hypothesis.
        state: State that the edges lead to.
        row: Flat index of (action, hypothesis).
        pattern: Flat index of (action, pattern that the state shows).
    """

    action: IntArray
    hypothesis: IntArray
    state: IntArray
    row: IntArray
    pattern: IntArray


def distinct(cells: IntArray, n_cells: int) -> tuple[IntArray, NDArray[np.bool_] | slice]:
    """Number the distinct values of ``cells`` [E], which are below ``n_cells``, without sorting them.

    Returns:
        The number of each entry's value, shape [E], and one entry of each value, in the order of the numbers.
    """
    entries = np.arange(len(cells))
    one_entry = np.empty(n_cells, dtype=np.int64)
    one_entry[cells] = entries  # one of those with this value, whichever
    representative = one_entry[cells]
    chosen = representative == entries
    if chosen.all():  # as a rule no two edges lead to the same state
        return entries, slice(None)
    return (np.cumsum(chosen) - 1)[representative], chosen
