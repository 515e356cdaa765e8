"""Chains of Gibbs sampling over structures, many side by side, for the search.

A move takes one register of one action. It swaps its source with that of another register, or, in chains that copy as
well, sets its source to any register, so that the action may become irreversible, or a permutation again. All these
neighbours, which the present state is among, are scored together, and one of them is drawn by its score at the present
temperature. Nothing is rejected, so few steps do.
"""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.learning.quick_score import QuickScore, loses_content
from atg_fg.learning.shared_structure import SharedStructure, log_map_priors


class Chains:
    """C chains, in order of their numbers of registers, padded with registers that every action leaves alone.

    Args:
        score: Of structures on trials.
        sizes: P of each chain, shape [C], ascending.
        sources: Where each begins, shape [C, A, P of the largest].
        tolerant: Which of them let each trial be plain rather than follow the structure, shape [C]; the rest see the
            way downhill from where they explain nothing yet.
        copies: Whether they copy sources too, in half of their moves.

    Attributes:
        n_evaluations: Candidates that were scored so far.
    """

    def __init__(
        self, score: QuickScore, sizes: IntArray, sources: IntArray, tolerant: IntArray, *, copies: bool = False
    ) -> None:
        self._score, self._sizes, self._sources, self._tolerant, self._copies = score, sizes, sources, tolerant, copies
        self._best_scores = np.full(len(sizes), -np.inf)
        self._best_sources = sources.copy()
        #: All pairs (chain, register to swap with, or to copy), shape [2, B]
        self._pairs: IntArray = np.array(
            [(chain, register) for chain, size in enumerate(sizes.tolist()) for register in range(size)]
        ).T
        priors = np.array([log_map_priors(size) for size in sizes.tolist()])
        #: What an irreversible action costs in each chain, in nats, shape [C]
        self._cost = priors[:, 0] - priors[:, 1]
        self.n_evaluations = 0

    def move(self, temperature: float, rng: np.random.Generator) -> None:
        """Let each chain draw one of its neighbours."""
        n_chains = len(self._sizes)
        actions = rng.integers(self._sources.shape[1], size=n_chains)
        registers = rng.integers(self._sizes)
        chain, other = self._pairs
        rows = np.arange(len(chain))
        candidates = self._sources[chain]
        action, register = actions[chain], registers[chain]
        mine, theirs = candidates[rows, action, register], candidates[rows, action, other]
        if self._copies:
            is_copied = rng.integers(2, size=n_chains)[chain] == 1
            mine, theirs = np.where(is_copied, theirs, mine), np.where(is_copied, other, theirs)
        candidates[rows, action, other], candidates[rows, action, register] = mine, theirs
        scores = self._totals(candidates, chain)
        self.n_evaluations += len(scores)
        self._keep_best(candidates, scores)
        drawn = _best_of_each(scores / temperature + rng.gumbel(size=len(scores)), chain, n_chains)
        self._sources = candidates[drawn]

    def _totals(self, candidates: IntArray, chain: IntArray) -> FloatArray:
        if self._copies:
            scores = self._score.from_any_start(candidates)
            cost = self._cost[chain] * loses_content(candidates).sum(axis=1)
        else:
            scores, cost = self._score(candidates), np.zeros(len(candidates))
        totals: FloatArray = scores.sum(axis=1)
        tolerant = self._tolerant[chain] == 1
        totals[tolerant] = np.logaddexp(scores[tolerant], self._score.plain).sum(axis=1)
        totals -= cost
        return totals

    def _keep_best(self, candidates: IntArray, scores: FloatArray) -> None:
        best = _best_of_each(scores, self._pairs[0], len(self._sizes))
        better = scores[best] > self._best_scores
        self._best_scores = np.where(better, scores[best], self._best_scores)
        self._best_sources[better] = candidates[best[better]]

    def best_structures(self, n_slots: int) -> list[SharedStructure]:
        """Return the best structure of each chain, with all its registers, in order of their number."""
        return [
            SharedStructure(n_slots, tuple(tuple(each[:size]) for each in sources.tolist()))
            for size, sources in zip(self._sizes.tolist(), self._best_sources, strict=True)
        ]


def padded(structures: list[SharedStructure]) -> IntArray:
    """Return the sources of structures, shape [C, A, P of the largest]."""
    widest = max(structure.n_registers for structure in structures)
    sources = np.broadcast_to(np.arange(widest), (len(structures), structures[0].n_actions, widest)).copy()
    for row, structure in zip(sources, structures, strict=True):
        row[:, : structure.n_registers] = structure.sources
    return sources


def _best_of_each(values: FloatArray, group: IntArray, n_groups: int) -> IntArray:
    """Return the index of the greatest value of each group; ``group`` is ascending and has all of them."""
    order = np.lexsort((-values, group))
    first = np.searchsorted(group, np.arange(n_groups))
    result: IntArray = order[first]
    return result
