"""Register maps as structures: their evidence, and annealing on it. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within
from atg_fg.learning.kernels import TrialArrays, copy_into, draw_by_logarithm, shuffled

#: Maps whose evidence a chain has at hand: a later one takes the place of an earlier one.
_N_KNOWN = 4093
#: Entries of the table of histories: it begins anew when it is full.
_N_ENTRIES = 1 << 17

#: Without a sign: nobody asks of each index whether it counts from the end.
Indices = NDArray[np.uint32]
#: What a register has shown in a trial so far, each history once, the empty one first: which of the different looks
#: each one was [N, T, J], these looks [L, V], the history that each look makes of each, 0 if not known yet [H, L],
#: prior · Π likelihoods [H, V], ln of its sum [H], and how many are known [1]. Maps differ in which registers are
#: where, so that few histories come again and again.
Histories = tuple[Indices, FloatArray, Indices, FloatArray, FloatArray, Indices]


@compiled
def map_log_evidence(
    trials: TrialArrays, plain: FloatArray, sources: IntArray, n_slots: int, prior: FloatArray
) -> float:
    """Return Σ ln (p(trial | a fresh object that begins in pose 0) + p(trial | plain)) of register maps [A, P]."""
    return evidence_of(
        sources.astype(np.uint32),
        trials.actions.astype(np.uint32),
        trials.lengths,
        plain,
        histories_of(trials.looks, n_slots, prior),
    )


@compiled_within
def histories_of(looks: FloatArray, n_slots: int, prior: FloatArray) -> Histories:
    """Return histories of which none is known but the empty one."""
    n_trials, n_looks, n_symbols = len(looks), looks.shape[1], len(prior)
    number = np.empty((n_trials, n_looks, n_slots), np.uint32)
    rows, n_rows = np.empty((number.size, n_symbols)), 0
    for trial in range(n_trials):
        for time in range(n_looks):
            for slot in range(n_slots):
                row, symbol = 0, 0
                while row < n_rows and symbol < n_symbols:
                    if rows[row, symbol] == looks[trial, time, slot, symbol]:
                        symbol += 1
                    else:
                        row, symbol = row + 1, 0
                if row == n_rows:
                    for symbol in range(n_symbols):
                        rows[row, symbol] = looks[trial, time, slot, symbol]
                    n_rows += 1
                number[trial, time, slot] = row
    capacity = 2 * n_looks * n_slots + _N_ENTRIES // n_rows
    longer, product = np.empty((capacity, n_rows), np.uint32), np.empty((capacity, n_symbols))
    log_evidence, n_known = np.zeros(capacity), np.ones(1, np.uint32)
    longer[0] = 0
    for symbol in range(n_symbols):
        product[0, symbol] = prior[symbol]
    return number, rows, longer, product, log_evidence, n_known


@compiled_within
def evidence_of(
    sources: Indices, actions: Indices, lengths: IntArray, plain: FloatArray, histories: Histories
) -> float:
    """Return what ``map_log_evidence`` does, and add what registers showed to the histories that are known."""
    number, rows, longer, product, log_evidence, n_known = histories
    n_registers, n_slots = sources.shape[1], number.shape[2]
    places = np.empty((number.shape[1] + 1, n_registers), np.uint32)
    history = np.empty(n_registers, np.uint32)
    total = 0.0
    for trial in range(len(lengths)):
        if n_known[0] + number[trial].size > len(longer):
            n_known[0], longer[0] = 1, 0
        for register in range(n_registers):
            places[0, register], history[register] = register, 0
        for time in range(lengths[trial]):
            action = actions[trial, time]
            for register in range(n_registers):
                places[time + 1, register] = places[time, sources[action, register]]
            for slot in range(n_slots):
                register, row = places[time, slot], number[trial, time, slot]
                before = history[register]
                after = longer[before, row]
                if after == 0:
                    after = n_known[0]
                    n_known[0] += 1
                    longer[before, row] = after
                    evidence = 0.0
                    for symbol in range(rows.shape[1]):
                        product[after, symbol] = product[before, symbol] * rows[row, symbol]
                        evidence += product[after, symbol]
                    log_evidence[after] = np.log(max(evidence, 1e-300))
                    longer[after] = 0
                history[register] = after
        evidence = 0.0
        for register in range(n_registers):
            evidence += log_evidence[history[register]]
        total += evidence if plain[trial] == -np.inf else np.logaddexp(evidence, plain[trial])
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
    now, actions = sources.astype(np.uint32), trials.actions.astype(np.uint32)
    histories = histories_of(trials.looks, n_slots, prior)
    best, kept = -np.inf, now.copy()
    n_options = 2 * n_registers if copies else n_registers
    scores = np.empty(n_options)
    scored, known = np.empty(_N_KNOWN), np.full((_N_KNOWN, n_actions, n_registers), np.uint16(65535))
    for beta in coldness:
        for action in range(n_actions):
            for register in shuffled(n_registers, rng):
                mine = now[action, register]
                for option in range(n_options):
                    other = option % n_registers
                    theirs = now[action, other]
                    now[action, register] = theirs if option < n_registers else other
                    if option < n_registers:
                        now[action, other] = mine
                    # Once a chain is cold, most maps that it looks at are those that it looked at before.
                    key = np.uint32(0)
                    for row in range(n_actions):
                        for column in range(n_registers):
                            key = np.uint32(key * np.uint32(31) + now[row, column])
                    number, is_known = key % np.uint32(_N_KNOWN), True
                    for row in range(n_actions):
                        for column in range(n_registers):
                            is_known = is_known and known[number, row, column] == now[row, column]
                    if not is_known:
                        copy_into(known[number], now)
                        scored[number] = evidence_of(now, actions, trials.lengths, plain, histories)
                    scores[option] = scored[number]
                    if copies:
                        scores[option] -= copy_cost * count_losses(now)
                    if scores[option] > best:
                        best = scores[option]
                        copy_into(kept, now)
                    now[action, other], now[action, register] = theirs, mine
                option = draw_by_logarithm(scores, beta, rng)
                other = option % n_registers
                if option < n_registers:
                    now[action, register], now[action, other] = now[action, other], mine
                else:
                    now[action, register] = other
    copy_into(sources, kept)
    return best


@compiled_within
def count_losses(sources: Indices) -> int:
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
