"""Search for structures that explain trials: many chains of Gibbs sampling at once, cooled step by step.

A move takes one register of one action and swaps its source with that of another register, or leaves it: all these
neighbours are scored together, and one of them is drawn by its score at the present temperature. Nothing is rejected,
so few steps do; they are bounded in number, whatever the clock says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from atg_fg.assumptions import Assumptions
from atg_fg.patterns import FloatArray, IntArray
from atg_fg.structure.quick_score import QuickScore
from atg_fg.structure.shared_structure import SharedStructure
from atg_fg.structure.trials import RawTrial

#: Nats that a structure may be worse than none by the quick score, and still be proposed.
HOPELESS: Final = 5.0


@dataclass(frozen=True)
class SearchPlan:
    """How much is searched.

    Attributes:
        max_hidden: Hidden registers of the largest structure looked at.
        n_chains: Chains for each number of registers.
        n_steps: Moves of each chain.
        hottest: First temperature, in nats.
        coldest: Last temperature, in nats.
        n_looks: Looks in the pieces of trials that are looked at, drawn at random if there are more.
        n_actions: Actions in a piece: a slip spoils what comes after it, so long trials are cut.
    """

    max_hidden: int = 6
    n_chains: int = 3
    n_steps: int = 120
    hottest: float = 6.0
    coldest: float = 0.5
    n_looks: int = 132
    n_actions: int = 10


class Proposals(NamedTuple):
    """What a search came upon.

    Attributes:
        structures: In canonical form, all different, best first by the quick score; without those that are
            ``HOPELESS`` by it.
        n_evaluations: Candidates that were scored.
    """

    structures: tuple[SharedStructure, ...]
    n_evaluations: int


def propose_structures(
    trials: Sequence[RawTrial],
    assumptions: Assumptions,
    rng: np.random.Generator,
    *,
    plan: SearchPlan | None = None,
    incumbents: Sequence[SharedStructure] = (),
) -> Proposals:
    """Return the best structure that each chain met.

    Args:
        trials: Raw trials; with none there is nothing to propose.
        assumptions: Actions and alphabet.
        rng: Draws the pieces of trials, the chains' beginnings and their moves.
        plan: How much to search.
        incumbents: Structures that chains of their size begin from, the first of a size each.
    """
    plan = plan or SearchPlan()
    pieces = _drawn_pieces(trials, rng, plan)
    if not pieces:
        return Proposals((), 0)
    chains = _Chains(QuickScore(pieces, assumptions), assumptions, rng, plan, incumbents)
    for step in range(plan.n_steps):
        cooled = step / max(plan.n_steps - 1, 1)
        chains.move(plan.hottest * (plan.coldest / plan.hottest) ** cooled)
    return Proposals(chains.best_structures(), chains.n_evaluations)


def _drawn_pieces(trials: Sequence[RawTrial], rng: np.random.Generator, plan: SearchPlan) -> list[RawTrial]:
    """Return all pieces of trials, or a random choice of them that has about as many looks as planned."""
    pieces = [piece for trial in trials for piece in trial.pieces(plan.n_actions)]
    n_looks = np.array([len(piece.detections) for piece in pieces])
    if n_looks.sum() <= plan.n_looks:
        return pieces
    order = rng.permutation(len(pieces))
    n_drawn = max(int(np.searchsorted(np.cumsum(n_looks[order]), plan.n_looks, side="right")), 1)
    return [pieces[index] for index in np.sort(order[:n_drawn])]


class _Chains:
    """C chains, each with its own number of registers, padded with registers that every action leaves alone."""

    def __init__(
        self,
        score: QuickScore,
        assumptions: Assumptions,
        rng: np.random.Generator,
        plan: SearchPlan,
        incumbents: Sequence[SharedStructure],
    ) -> None:
        self._score, self._rng = score, rng
        self._n_slots, self._n_actions = len(assumptions.alphabet.slots), len(assumptions.actions)
        sizes = np.arange(self._n_slots, self._n_slots + plan.max_hidden + 1)
        #: P of each chain, shape [C]
        self._sizes: IntArray = np.repeat(sizes, plan.n_chains)
        self._sources = self._beginnings(incumbents)
        #: Every other chain lets each trial be plain rather than follow the structure; the rest see the way downhill
        #: from where they explain nothing yet.
        self._tolerant = np.arange(len(self._sizes)) % 2 == 1
        self._best_scores = np.full(len(self._sizes), -np.inf)
        self._best_sources = self._sources.copy()
        #: All pairs (chain, register to swap with), shape [2, B]
        self._swaps: IntArray = np.array(
            [(chain, register) for chain, size in enumerate(self._sizes) for register in range(size)]
        ).T
        self.n_evaluations = 0

    def _beginnings(self, incumbents: Sequence[SharedStructure]) -> IntArray:
        """Return random permutations, or an incumbent for the first chain of its size, shape [C, A, P]."""
        known = {structure.n_registers: structure for structure in reversed(incumbents)}
        widest = int(self._sizes.max())
        sources = np.broadcast_to(np.arange(widest), (len(self._sizes), self._n_actions, widest)).copy()
        for chain, size in enumerate(self._sizes.tolist()):
            structure = known.pop(size, None)
            for action in range(self._n_actions):
                drawn = self._rng.permutation(size)
                sources[chain, action, :size] = drawn if structure is None else structure.sources[action]
        return sources

    def move(self, temperature: float) -> None:
        """Let each chain draw one of its neighbours, which its present state is among."""
        n_chains = len(self._sizes)
        actions = self._rng.integers(self._n_actions, size=n_chains)
        registers = self._rng.integers(self._sizes)
        chain, other = self._swaps
        rows = np.arange(len(chain))
        candidates = self._sources[chain]
        action, register = actions[chain], registers[chain]
        swapped = candidates[rows, action, register], candidates[rows, action, other]
        candidates[rows, action, other], candidates[rows, action, register] = swapped
        scores = self._totals(candidates, self._tolerant[chain])
        self.n_evaluations += len(scores)
        self._keep_best(candidates, scores)
        drawn = _best_of_each(scores / temperature + self._rng.gumbel(size=len(scores)), chain, n_chains)
        self._sources = candidates[drawn]

    def _totals(self, candidates: IntArray, tolerant: np.ndarray) -> FloatArray:
        scores = self._score(candidates)
        totals: FloatArray = scores.sum(axis=1)
        totals[tolerant] = np.logaddexp(scores[tolerant], self._score.plain).sum(axis=1)
        return totals

    def _keep_best(self, candidates: IntArray, scores: FloatArray) -> None:
        best = _best_of_each(scores, self._swaps[0], len(self._sizes))
        better = scores[best] > self._best_scores
        self._best_scores = np.where(better, scores[best], self._best_scores)
        self._best_sources[better] = candidates[best[better]]

    def best_structures(self) -> tuple[SharedStructure, ...]:
        """Return the best structure of each chain, canonical and without repeats, best first."""
        totals: dict[SharedStructure, float] = {}
        for size, sources in zip(self._sizes.tolist(), self._best_sources, strict=True):
            permutations = tuple(tuple(each[:size]) for each in sources.tolist())
            structure = SharedStructure(self._n_slots, permutations).canonical()
            if structure not in totals:
                score = np.logaddexp(self._score(np.array([structure.sources]))[0], self._score.plain).sum()
                totals[structure] = float(score) + structure.log_prior
        least = float(self._score.plain.sum()) - HOPELESS
        hopeful = [structure for structure, total in totals.items() if total >= least]
        return tuple(sorted(hopeful, key=lambda structure: -totals[structure]))


def _best_of_each(values: FloatArray, group: IntArray, n_groups: int) -> IntArray:
    """Return the index of the greatest value of each group; ``group`` is ascending and has all of them."""
    order = np.lexsort((-values, group))
    first = np.searchsorted(group, np.arange(n_groups))
    result: IntArray = order[first]
    return result
