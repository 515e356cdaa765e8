"""Search for register maps that explain trials: annealed Gibbs sampling on the exact evidence of fresh objects."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.learning import map_kernels
from atg_fg.learning.kernels import TrialArrays
from atg_fg.learning.shared_structure import SharedStructure, log_map_priors

#: Hidden registers of the largest structure looked at.
MAX_HIDDEN: Final = 6
#: Sweeps of a chain, and how hot it begins.
N_SWEEPS: Final = 40
HOTTEST: Final = 0.15
#: The same of a chain that goes on among all maps from the best permutations, which copy sources too.
N_COPYING_SWEEPS: Final = 12
HOTTEST_COPYING: Final = 0.5
#: Trials that are searched on, the newest ones.
N_TRIALS: Final = 24


def search_registers(
    trials: TrialArrays, plain: FloatArray, n_slots: int, n_actions: int, n_chains: int, rng: np.random.Generator
) -> list[SharedStructure]:
    """Return the best structure of each chain, in canonical form, without repeats, best first.

    Args:
        trials: As those of fresh objects, at least one.
        plain: ln p(trial | it follows no structure), shape [N].
        n_slots: J.
        n_actions: A.
        n_chains: For each number of registers.
        rng: Draws.
    """
    n_symbols = trials.looks.shape[-1]
    prior = np.full(n_symbols, 1.0 / n_symbols)
    newest = slice(max(len(plain) - N_TRIALS, 0), None)
    window = TrialArrays(trials.looks[newest], trials.actions[newest], trials.lengths[newest])
    fresh = map_kernels.fresh_trials(window, np.ascontiguousarray(plain[newest]), n_slots, prior)
    cooling, cooling_again = np.geomspace(HOTTEST, 1.0, N_SWEEPS), np.geomspace(HOTTEST_COPYING, 1.0, N_COPYING_SWEEPS)
    found: list[SharedStructure] = []
    for n_registers in range(n_slots, n_slots + MAX_HIDDEN + 1):
        known = map_kernels.no_maps(n_actions)
        best, best_sources = -np.inf, np.zeros((0, 0), dtype=np.int64)
        for _ in range(n_chains):
            sources = np.array([rng.permutation(n_registers) for _ in range(n_actions)])
            score = map_kernels.anneal_maps(fresh, known, sources, cooling, False, 0.0, rng)
            found.append(_structure(n_slots, sources))
            if score > best:
                best, best_sources = score, sources
        permutation, other = log_map_priors(n_registers)
        sources, cost = best_sources.copy(), permutation - other
        map_kernels.anneal_maps(fresh, known, sources, cooling_again, True, cost, rng)
        found.append(_structure(n_slots, sources))

    def score_of(structure: SharedStructure) -> float:
        return map_kernels.map_log_evidence(fresh, np.array(structure.sources)) + structure.log_prior

    return sorted(dict.fromkeys(found), key=score_of, reverse=True)


def n_scored(n_slots: int, n_actions: int, n_chains: int) -> int:
    """Return how many structures a search scores."""
    sizes = range(n_slots, n_slots + MAX_HIDDEN + 1)
    return sum(n_actions * size**2 * (n_chains * N_SWEEPS + 2 * N_COPYING_SWEEPS) for size in sizes)


def _structure(n_slots: int, sources: Sequence[Sequence[int]] | np.ndarray) -> SharedStructure:
    return SharedStructure(n_slots, tuple(tuple(map(int, each)) for each in sources)).canonical()
