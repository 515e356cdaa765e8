"""Search for structures that explain trials: many chains of Gibbs sampling at once, cooled step by step.

First only permutations are looked at, of which there are few enough. Then one chain for each number of registers goes
on from the best of these among all maps, most of which are a copy or two away from some permutation. The steps are
bounded in number, whatever the clock says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import IntArray
from atg_fg.learning.annealing import Chains, padded
from atg_fg.learning.quick_score import QuickScore
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure, is_permutation

#: Nats that a structure may be worse than none by the quick score, and still be proposed.
HOPELESS: Final = 5.0


@dataclass(frozen=True)
class SearchPlan:
    """How much is searched.

    Attributes:
        max_hidden: Hidden registers of the largest structure looked at.
        n_chains: Chains for each number of registers, among permutations.
        n_steps: Moves of each of them.
        n_copying_steps: Moves of each chain among all maps.
        hottest: First temperature, in nats.
        hottest_copying: The same among all maps: cool, as these chains begin from the best permutations.
        coldest: Last temperature, in nats.
        n_looks: Looks in the pieces of trials that are looked at, drawn at random if there are more.
        n_actions: Actions in a piece: a slip spoils what comes after it, so long trials are cut.
    """

    max_hidden: int = 6
    n_chains: int = 3
    n_steps: int = 120
    n_copying_steps: int = 60
    hottest: float = 6.0
    hottest_copying: float = 2.0
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

    A structure with an irreversible action is proposed only if its quick score beats that of every permutation.

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
    search = _Search(QuickScore(pieces, assumptions), assumptions, plan)
    reversible = [each for each in incumbents if all(map(is_permutation, each.sources))]
    permutations = search.permutations(reversible, rng)
    irreversible = [each for each in incumbents if each not in reversible]
    # A generator of its own, so that the permutations are searched for as if there were nothing else.
    maps = search.maps(permutations, irreversible, rng.spawn(1)[0])
    found = search.totals(permutations)
    best = max(found.values())
    found |= {structure: total for structure, total in search.totals(maps).items() if total > best}
    least = search.plain - HOPELESS
    hopeful = sorted((each for each, total in found.items() if total >= least), key=lambda each: -found[each])
    return Proposals(tuple(hopeful), search.n_evaluations)


def _drawn_pieces(trials: Sequence[RawTrial], rng: np.random.Generator, plan: SearchPlan) -> list[RawTrial]:
    """Return all pieces of trials, or a random choice of them that has about as many looks as planned."""
    pieces = [piece for trial in trials for piece in trial.pieces(plan.n_actions)]
    n_looks = np.array([len(piece.detections) for piece in pieces])
    if n_looks.sum() <= plan.n_looks:
        return pieces
    order = rng.permutation(len(pieces))
    n_drawn = max(int(np.searchsorted(np.cumsum(n_looks[order]), plan.n_looks, side="right")), 1)
    return [pieces[index] for index in np.sort(order[:n_drawn])]


class _Search:
    """The two parts of a search, with what they have in common."""

    def __init__(self, score: QuickScore, assumptions: Assumptions, plan: SearchPlan) -> None:
        self._score, self._plan = score, plan
        self._n_slots, self._n_actions = len(assumptions.alphabet.slots), len(assumptions.actions)
        self._sizes = range(self._n_slots, self._n_slots + plan.max_hidden + 1)
        self.plain = float(score.plain.sum())
        self.n_evaluations = 0

    def permutations(self, incumbents: Sequence[SharedStructure], rng: np.random.Generator) -> list[SharedStructure]:
        """Return the best structure of permutations that each chain met."""
        known = {structure.n_registers: structure for structure in reversed(incumbents)}
        beginnings = []
        for size in np.repeat(self._sizes, self._plan.n_chains).tolist():
            drawn = tuple(tuple(rng.permutation(size).tolist()) for _ in range(self._n_actions))
            beginnings.append(known.pop(size, SharedStructure(self._n_slots, drawn)))
        every_other = np.arange(len(beginnings)) % 2
        return self._cooled(beginnings, every_other, self._plan.n_steps, rng, copies=False)

    def maps(
        self,
        permutations: Sequence[SharedStructure],
        incumbents: Sequence[SharedStructure],
        rng: np.random.Generator,
    ) -> list[SharedStructure]:
        """Return the best structure that each chain met which began from an incumbent or the best permutations."""
        totals = self.totals(permutations)
        best_first = sorted(totals, key=lambda structure: -totals[structure])
        # Idle registers beside the best are what an irreversible action may take contents from.
        begin = {
            size: _with_idle_registers(next(each for each in best_first if each.n_registers <= size), size)
            for size in self._sizes
        }
        begin |= {structure.n_registers: structure for structure in reversed(incumbents)}
        beginnings = [begin[size] for size in self._sizes]
        tolerant = np.ones(len(beginnings), dtype=np.int64)
        return self._cooled(beginnings, tolerant, self._plan.n_copying_steps, rng, copies=True)

    def totals(self, structures: Sequence[SharedStructure]) -> dict[SharedStructure, float]:
        """Return structures in canonical form, without repeats, with ln of their prior and quick score."""
        different = dict.fromkeys(structure.canonical() for structure in structures)
        return {structure: self._total(structure) + structure.log_prior for structure in different}

    def _total(self, structure: SharedStructure) -> float:
        scores = self._score.from_any_start(np.array([structure.sources]))[0]
        return float(np.logaddexp(scores, self._score.plain).sum())

    def _cooled(
        self,
        beginnings: list[SharedStructure],
        tolerant: IntArray,
        n_steps: int,
        rng: np.random.Generator,
        *,
        copies: bool,
    ) -> list[SharedStructure]:
        sizes = np.array([structure.n_registers for structure in beginnings])
        chains = Chains(self._score, sizes, padded(beginnings), tolerant, copies=copies)
        coldest = self._plan.coldest
        hottest = self._plan.hottest_copying if copies else self._plan.hottest
        for step in range(n_steps):
            chains.move(hottest * (coldest / hottest) ** (step / max(n_steps - 1, 1)), rng)
        self.n_evaluations += chains.n_evaluations
        return chains.best_structures(self._n_slots)


def _with_idle_registers(structure: SharedStructure, n_registers: int) -> SharedStructure:
    """Return a structure with hidden registers added that every action leaves alone."""
    idle = tuple(range(structure.n_registers, n_registers))
    return SharedStructure(structure.n_slots, tuple((*sources, *idle) for sources in structure.sources))
