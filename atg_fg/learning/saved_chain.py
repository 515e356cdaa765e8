"""A chain of samples as it is kept."""

from __future__ import annotations

from typing import NamedTuple

from atg_fg.learning.shared_structure import SharedStructure


class SavedChain(NamedTuple):
    """A chain as it is kept: all else follows from this and the raw trials.

    Attributes:
        maps: Register maps that it follows, or ``None`` if it has an automaton.
        successors: Of the automaton: the state that each action leads to, shape [A, S].
        own: Clusters that have automata of their own, each with these.
        owner: Cluster of each trial, shape [N].
        start: First state of each trial, shape [N].
        slips: Pairs (trial, action) of those that failed.
        slip: ε.
        score: ln of the joint probability of all that it believes and saw.
        wrong: Pairs (trial, look) of looks that are wrong in all slots at once.
        error: Probability of that.
        rival: Number of its population, and the evidence of that, if there are several.
    """

    maps: SharedStructure | None
    successors: tuple[tuple[int, ...], ...]
    own: tuple[tuple[int, tuple[tuple[int, ...], ...]], ...]
    owner: tuple[int, ...]
    start: tuple[int, ...]
    slips: tuple[tuple[int, int], ...]
    slip: float
    score: float
    rival: tuple[int, float] | None = None
    wrong: tuple[tuple[int, int], ...] = ()
    error: float = 0.1
