"""Register maps as structures: their evidence, and annealing on it. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within, written_out
from atg_fg.learning.kernels import TrialArrays, copy_into, draw_by_logarithm, shuffled

#: Maps whose evidence is at hand, 2 to the power of this: a later one takes the place of an earlier one.
_KNOWN_BITS = 13
#: Entries of the table of histories: it begins anew when it is full.
_N_ENTRIES = 1 << 17
#: The sources of an action in one number, four bits each; fewer than 16 registers never have the last one.
_MAX_REGISTERS, _NO_ACTION = 15, 2**64 - 1
#: An odd number without a pattern, whose multiples spread over all numbers.
_SPREAD = np.uint64(0x9E3779B97F4A7C15)

#: Without a sign: nobody asks of each index whether it counts from the end.
Indices = NDArray[np.uint32]
Codes = NDArray[np.uint64]
#: What a register has shown in a trial so far, each history once, the empty one first: which of the different looks
#: each one was [N, T, J], these looks [L, V], the history that each look makes of each, 0 if not known yet [H, L],
#: prior · Π likelihoods [H, V], ln of its sum [H], and how many are known [1]. Maps differ in which registers are
#: where, so that few histories come again and again.
Histories = tuple[Indices, FloatArray, Indices, FloatArray, FloatArray, Indices]
#: Trials of fresh objects: actions [N, T], lengths [N], ln p(trial | it follows no maps) [N], −∞ if all do, histories.
FreshTrials = tuple[Indices, IntArray, FloatArray, Histories]
#: Maps of as many registers, each action's sources as one number [M, A], their evidence [M], and how many actions lose
#: content [M].
KnownMaps = tuple[Codes, FloatArray, IntArray]


@compiled
def fresh_trials(trials: TrialArrays, plain: FloatArray, n_slots: int, prior: FloatArray) -> FreshTrials:
    """Return trials of which no history is known but the empty one; ``prior`` is of the symbols, shape [V]."""
    return trials.actions.astype(np.uint32), trials.lengths, plain, histories_of(trials.looks, n_slots, prior)


def no_maps(n_actions: int) -> KnownMaps:
    """Return room for known maps."""
    n_maps = 1 << _KNOWN_BITS
    return np.full((n_maps, n_actions), _NO_ACTION, np.uint64), np.empty(n_maps), np.empty(n_maps, np.int64)


@compiled
def map_log_evidence(fresh: FreshTrials, sources: IntArray) -> float:
    """Return Σ ln (p(trial | a fresh object that begins in pose 0) + p(trial | plain)) of register maps [A, P]."""
    return evidence_of(sources.astype(np.uint32), fresh, room_for(fresh, sources.shape[1]))


@compiled_within
def room_for(fresh: FreshTrials, n_registers: int) -> tuple[Indices, Indices]:
    """Return room for the register in each place at each look, and for what each register has shown."""
    return np.empty((fresh[3][0].shape[1] + 1, n_registers), np.uint32), np.empty(n_registers, np.uint32)


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


@written_out
def evidence_of(sources: Indices, fresh: FreshTrials, work: tuple[Indices, Indices]) -> float:
    """Return what ``map_log_evidence`` does, and add what registers showed to the histories that are known."""
    actions, lengths, plain, (number, rows, longer, product, log_evidence, n_known) = fresh
    n_registers, n_slots = sources.shape[1], number.shape[2]
    places, history = work
    total = 0.0
    for trial in range(len(lengths)):
        if n_known[0] + number.shape[1] * n_slots > len(longer):
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
                    for look in range(longer.shape[1]):
                        longer[after, look] = 0
                history[register] = after
        evidence = 0.0
        for register in range(n_registers):
            evidence += log_evidence[history[register]]
        total += evidence if plain[trial] == -np.inf else np.logaddexp(evidence, plain[trial])
    return total


@compiled
def anneal_maps(
    fresh: FreshTrials,
    known: KnownMaps,
    sources: IntArray,
    coldness: FloatArray,
    copies: bool,
    copy_cost: float,
    rng: np.random.Generator,
) -> float:
    """Anneal register maps by Gibbs moves on the exact evidence; leave the best there was, and return its evidence.

    A move takes one register of one action, and swaps its source with that of another, or, where copies are allowed,
    sets it to any register.

    Args:
        fresh: Trials of fresh objects.
        known: Maps whose evidence is at hand; others are added.
        sources: Where to begin, shape [A, P]; changed in place.
        coldness: β of each sweep over all registers of all actions.
        copies: Whether an action may lose content.
        copy_cost: What each action that does so costs, in nats.
        rng: Draws.
    """
    codes, evidence, losses = known
    n_actions, n_registers = sources.shape
    now, code, unit = sources.astype(np.uint32), np.zeros(n_actions, np.uint64), np.ones(n_registers, np.uint64)
    for register in range(n_registers):
        unit[register] <<= np.uint64(4 * (register % 16))
        for action in range(n_actions):
            code[action] += now[action, register] * unit[register]
    best, kept, work = -np.inf, now.copy(), room_for(fresh, n_registers)
    n_options = 2 * n_registers if copies else n_registers
    scores, coded = np.empty(n_options), np.empty(n_options, np.uint64)
    for beta in coldness:
        for action in range(n_actions):
            for register in shuffled(n_registers, rng):
                mine, before = now[action, register], code[action]
                for option in range(n_options):
                    other = option if option < n_registers else option - n_registers
                    theirs = now[action, other]
                    if option < n_registers:
                        now[action, register], now[action, other] = theirs, mine
                        coded[option] = before + (np.uint64(theirs) - np.uint64(mine)) * (unit[register] - unit[other])
                    else:
                        now[action, register] = other
                        coded[option] = before + (np.uint64(other) - np.uint64(mine)) * unit[register]
                    code[action] = coded[option]
                    # Once a chain is cold, most maps that it looks at are those that it looked at before.
                    key, is_known = np.uint64(0), n_registers <= _MAX_REGISTERS
                    for row in range(n_actions):
                        key = (key + code[row]) * _SPREAD
                    number = key >> np.uint64(64 - _KNOWN_BITS)
                    for row in range(n_actions):
                        is_known = is_known and codes[number, row] == code[row]
                    if not is_known:
                        for row in range(n_actions):
                            codes[number, row] = code[row]
                        evidence[number] = evidence_of(now, fresh, work)
                        losses[number] = count_losses(now) if copies else 0
                    scores[option] = evidence[number] - copy_cost * losses[number]
                    if scores[option] > best:
                        best = scores[option]
                        copy_into(kept, now)
                    now[action, other], now[action, register] = theirs, mine
                option = draw_by_logarithm(scores, beta, rng)
                code[action] = coded[option]
                other = option if option < n_registers else option - n_registers
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
