"""Register maps as structures: their evidence, and annealing on it. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within
from atg_fg.learning.kernels import TrialArrays, copy_into, draw_by_logarithm, shuffled

#: Maps whose evidence a chain has at hand: a later one takes the place of an earlier one.
_N_KNOWN = 4093


@compiled
def map_log_evidence(
    trials: TrialArrays, plain: FloatArray, sources: IntArray, n_slots: int, prior: FloatArray
) -> float:
    """Return Σ ln (p(trial | a fresh object that begins in pose 0) + p(trial | plain)) of register maps [A, P]."""
    n_registers = sources.shape[1]
    place, moved = np.empty(n_registers, np.int64), np.empty(n_registers, np.int64)
    local, is_seen = np.empty((n_registers, len(prior))), np.empty(n_registers, np.bool_)
    total = 0.0
    for trial in range(len(trials.lengths)):
        for register in range(n_registers):
            place[register] = register
            is_seen[register] = False
        for time in range(trials.lengths[trial]):
            for slot in range(n_slots):
                register = place[slot]
                if not is_seen[register]:
                    is_seen[register] = True
                    for symbol in range(len(prior)):
                        local[register, symbol] = prior[symbol]
                for symbol in range(len(prior)):
                    local[register, symbol] *= trials.looks[trial, time, slot, symbol]
            if time + 1 < trials.lengths[trial]:
                for register in range(n_registers):
                    moved[register] = place[sources[trials.actions[trial, time], register]]
                for register in range(n_registers):
                    place[register] = moved[register]
        evidence = 0.0
        for register in range(n_registers):
            if is_seen[register]:
                evidence += np.log(max(local[register].sum(), 1e-300))
        total += np.logaddexp(evidence, plain[trial])
    return total


@compiled
def anneal_maps(
    trials: TrialArrays,
    plain: FloatArray,
    sources: IntArray,
    n_slots: int,
    prior: FloatArray,
    coldness: FloatArray,
    copies: bool,
    copy_cost: float,
    rng: np.random.Generator,
) -> float:
    """Anneal register maps by Gibbs moves on the exact evidence; leave the best there was, and return its evidence.

    A move takes one register of one action, and swaps its source with that of another, or, where copies are allowed,
    sets it to any register.

    Args:
        trials: Scored as those of fresh objects.
        plain: ln p(trial | it does not follow the maps), shape [N]; −∞ if all do.
        sources: Where to begin, shape [A, P]; changed in place.
        n_slots: J.
        prior: Of the symbols, shape [V].
        coldness: β of each sweep over all registers of all actions.
        copies: Whether an action may lose content.
        copy_cost: What each action that does so costs, in nats.
        rng: Draws.
    """
    n_actions, n_registers = sources.shape
    best, kept = -np.inf, sources.copy()
    n_options = 2 * n_registers if copies else n_registers
    scores = np.empty(n_options)
    scored, known = np.empty(_N_KNOWN), np.full((_N_KNOWN, n_actions, n_registers), -1)
    for beta in coldness:
        for action in range(n_actions):
            for register in shuffled(n_registers, rng):
                mine = sources[action, register]
                for option in range(n_options):
                    other = option % n_registers
                    theirs = sources[action, other]
                    if option < n_registers:
                        sources[action, register], sources[action, other] = theirs, mine
                    else:
                        sources[action, register] = other
                    # Once a chain is cold, most maps that it looks at are those that it looked at before.
                    key, is_known = 0, True
                    for row in range(n_actions):
                        for column in range(n_registers):
                            key = key * 31 + sources[row, column]
                    number = key % len(scored)
                    for row in range(n_actions):
                        for column in range(n_registers):
                            is_known = is_known and known[number, row, column] == sources[row, column]
                    if not is_known:
                        known[number] = sources
                        scored[number] = map_log_evidence(trials, plain, sources, n_slots, prior)
                    scores[option] = scored[number]
                    if copies:
                        scores[option] -= copy_cost * count_losses(sources)
                    if scores[option] > best:
                        best = scores[option]
                        copy_into(kept, sources)
                    sources[action, other], sources[action, register] = theirs, mine
                option = draw_by_logarithm(scores, beta, rng)
                other = option % n_registers
                if option < n_registers:
                    sources[action, register], sources[action, other] = sources[action, other], mine
                else:
                    sources[action, register] = other
    copy_into(sources, kept)
    return best


@compiled_within
def count_losses(sources: IntArray) -> int:
    """Return how many actions lose content."""
    n_losses = 0
    for action in range(len(sources)):
        for register in range(sources.shape[1]):
            is_kept = False
            for other in range(sources.shape[1]):
                if sources[action, other] == register:
                    is_kept = True
                    break
            if not is_kept:
                n_losses += 1
                break
    return n_losses
