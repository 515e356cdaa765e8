"""Register maps as structures: their evidence, and annealing on it. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import NONE, ZERO, compiled, compiled_within, written_out
from atg_fg.learning.kernels import TrialArrays, copy_into, draw_by_logarithm, shuffled

#: Maps whose evidence is at hand, 2 to the power of this: a later one takes the place of an earlier one.
_KNOWN_BITS = 13
#: Histories whose evidence is at hand, 2 to the power of this.
_HISTORY_BITS = 16
#: Maps that are followed side by side: of each, a place has so many bits of one number. No map that is searched for has
#: as many as 256 registers.
_LANES, _LANE_BITS, _LANE = 8, np.uint64(8), np.uint64(0xFF)
_EVERY_LANE = np.uint64(0x0101010101010101)
#: Of two numbers this far apart the smaller adds nothing to ln (exp + exp).
_NOTHING = 40.0
#: The sources of an action in one number, four bits each; fewer than 16 registers never have the last one.
_MAX_REGISTERS, _NO_ACTION = 15, 2**64 - 1
#: An odd number without a pattern, whose multiples spread over all numbers.
_SPREAD = np.uint64(0x9E3779B97F4A7C15)

#: Without a sign: nobody asks of each index whether it counts from the end.
Indices = NDArray[np.uint32]
Codes = NDArray[np.uint64]
#: What a register shows in a trial is a sum of names: which of the different looks each slot has at each time
#: [N, T, J], these looks [L, V], their names [L], p(symbol) of a register [V], and the sums whose evidence is at hand
#: [H], with ln Σ prior · Π likelihoods of each [H]. A later one takes the place of an earlier one. Maps differ in which
#: registers are where, so that few sums come again and again. Names have 64 bits that look random: different looks next
#: to never have the same sum.
Histories = tuple[Indices, FloatArray, Codes, FloatArray, Codes, FloatArray]
#: Trials of fresh objects: actions [N, T], lengths [N], ln p(trial | it follows no maps) [N], −∞ if all do, histories.
FreshTrials = tuple[Indices, IntArray, FloatArray, Histories]
#: Maps of as many registers: each action's sources as one number, and the evidence less what lost content costs
#: [M, A + 1]; the same as numbers of 64 bits of the one kind, and of the other. A map's columns are fetched together.
KnownMaps = tuple[Codes, FloatArray]
#: Room for the register in each place at each look, in all lanes [T, P], and what each has shown, in each [lanes, P];
#: for the looks that one register has shown [T · J + 1], and the product of their likelihoods [V]; for what moves in
#: each lane next to a register, and the new sources of both [3, lanes].
Work = tuple[Codes, Codes, Indices, FloatArray, Indices]


@compiled
def fresh_trials(trials: TrialArrays, plain: FloatArray, n_slots: int, prior: FloatArray) -> FreshTrials:
    """Return trials of which no history is known but the empty one; ``prior`` is of the symbols, shape [V]."""
    return trials.actions.astype(np.uint32), trials.lengths, plain, histories_of(trials.looks, n_slots, prior)


def no_maps(n_actions: int) -> KnownMaps:
    """Return room for known maps."""
    codes = np.full((1 << _KNOWN_BITS, n_actions + 1), _NO_ACTION, np.uint64)
    return codes, codes.view(np.float64)


@compiled
def map_log_evidence(fresh: FreshTrials, sources: IntArray) -> float:
    """Return Σ ln (p(trial | a fresh object that begins in pose 0) + p(trial | plain)) of register maps [A, P]."""
    now, result = sources.astype(np.uint32), np.empty(1)
    evidence_after(now, ZERO, ZERO, np.zeros(1, np.int64), fresh, room_for(fresh, now.shape[1]), result)
    return float(result[0])


@compiled_within
def room_for(fresh: FreshTrials, n_registers: int) -> Work:
    """Return room for the register in each place at each look, and for what each register has shown, by lane."""
    _, n_looks, n_slots = fresh[3][0].shape
    places, history = np.empty((n_looks, n_registers), np.uint64), np.empty((_LANES, n_registers), np.uint64)
    shown, product = np.empty(n_looks * n_slots + 1, np.uint32), np.empty(fresh[3][1].shape[1])
    return places, history, shown, product, np.empty((3, _LANES), np.uint32)


@compiled_within
def histories_of(looks: FloatArray, n_slots: int, prior: FloatArray) -> Histories:
    """Return histories of which none is known."""
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
    names, n_known = np.empty(n_rows, np.uint64), 1 << _HISTORY_BITS
    for row in range(n_rows):
        names[row] = spread(np.uint64(row + 1))
    return number, rows, names, prior, np.zeros(n_known, np.uint64), np.zeros(n_known)


@compiled_within
def spread(number: np.uint64) -> np.uint64:
    """Return 64 bits that look random (the finaliser of SplitMix64; Steele, Lea & Flood 2014)."""
    bits = number * _SPREAD
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return bits ^ (bits >> np.uint64(31))


@compiled_within
def evidence_after(
    sources: Indices,
    action: int,
    register: int,
    lanes: IntArray,
    fresh: FreshTrials,
    work: Work,
    result: FloatArray,
) -> None:
    """Fill in what ``map_log_evidence`` is of the maps after some moves, and add to the histories at hand.

    Args:
        sources: Before the moves, shape [A, P].
        action: Whose sources move.
        register: That moves.
        lanes: Numbers of some moves, at most ``_LANES``, as ``moved`` has them.
        fresh: Trials of fresh objects.
        work: Of ``room_for``.
        result: Of each move, shape [M].
    """
    actions, lengths, plain, (number, _, names, _, known, log_evidence) = fresh
    places, history, shown_looks, product, moves = work
    n_registers, n_lanes = sources.shape[1], len(lanes)
    for lane in range(n_lanes):
        moves[0, lane], moves[1, lane], moves[2, lane] = moved(sources[action], register, lanes[lane])
        result[lanes[lane]] = 0.0
    for trial in range(len(lengths)):
        for place in range(n_registers):
            places[0, place] = np.uint64(place) * _EVERY_LANE
            for lane in range(n_lanes):
                history[lane, place] = _SPREAD
        for time in range(lengths[trial]):
            if time > 0:
                done = actions[trial, time - 1]
                for place in range(n_registers):
                    places[time, place] = places[time - 1, sources[done, place]]
                if done == action:
                    for lane in range(n_lanes):
                        other, mine = moves[0, lane], _LANE << (_LANE_BITS * np.uint64(lane))
                        places[time, register] &= ~mine
                        places[time, register] |= places[time - 1, moves[1, lane]] & mine
                        places[time, other] &= ~mine
                        places[time, other] |= places[time - 1, moves[2, lane]] & mine
            for slot in range(number.shape[2]):
                shown, name = places[time, slot], names[number[trial, time, slot]]
                for lane in range(n_lanes):
                    history[lane, shown & _LANE] += name
                    shown >>= _LANE_BITS
        for lane in range(n_lanes):
            evidence = 0.0
            for place in range(n_registers):
                name = history[lane, place]
                row = (name * _SPREAD) >> np.uint64(64 - _HISTORY_BITS)
                if known[row] != name:
                    known[row] = name
                    shift = _LANE_BITS * np.uint64(lane)
                    looks = number[trial, : lengths[trial]]
                    log_evidence[row] = log_evidence_of(place, shift, looks, fresh[3], places, shown_looks, product)
                evidence += log_evidence[row]
            most, least = max(evidence, plain[trial]), min(evidence, plain[trial])
            result[lanes[lane]] += most if most - least > _NOTHING else np.logaddexp(most, least)


@compiled_within
def log_evidence_of(
    register: int,
    shift: np.uint64,
    looks: Indices,
    histories: Histories,
    places: Codes,
    shown: Indices,
    product: FloatArray,
) -> float:
    """Return ln of how probable it is that a register shows what it does in a trial.

    Args:
        register: Where the trial begins.
        shift: Bits below those of the lane in ``places``.
        looks: Number of the look of each slot at each time, shape [T, J].
        histories: For the looks that these numbers mean.
        places: The register in each place at each look, in all lanes, shape [T, P].
        shown: Room for the looks that the register shows, shape [T · J + 1].
        product: Room for the product of their likelihoods, shape [V].
    """
    _, rows, _, prior, _, _ = histories
    n_shown = 0
    for time in range(len(looks)):
        for slot in range(looks.shape[1]):
            shown[n_shown] = looks[time, slot]
            n_shown += (places[time, slot] >> shift) & _LANE == register
    for symbol in range(len(product)):
        product[symbol] = prior[symbol]
    for look in range(n_shown):
        for symbol in range(len(product)):
            product[symbol] *= rows[shown[look], symbol]
    total = 0.0
    for symbol in range(len(product)):
        total += product[symbol]
    return float(np.log(max(total, 1e-300)))


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
    n_actions, n_registers = sources.shape
    n_moves = 2 * n_registers if copies else n_registers
    now, kept, best, work = sources.astype(np.uint32), sources.astype(np.uint32), -np.inf, room_for(fresh, n_registers)
    code, tried = np.empty(n_actions, np.uint64), (np.empty(n_moves, np.int64), np.empty((2, n_moves), np.uint64))
    for action in range(n_actions):
        code[action] = code_of(now[action])
    # What moves lead to is as it was when a register was last looked at, if none was made since then.
    scores, looked_at, n_made = np.empty((n_actions, n_registers, n_moves)), np.full((n_actions, n_registers), NONE), 0
    for beta in coldness:
        for action in range(n_actions):
            for register in shuffled(n_registers, rng):
                own = scores[action, register]
                if looked_at[action, register] != n_made:
                    score_moves(now, code, action, register, fresh, known, tried, work, copy_cost, own)
                    looked_at[action, register] = n_made
                    if own.max() > best:
                        best = own.max()
                        copy_into(kept, now)
                        make(kept[action], register, own.argmax())
                move = draw_by_logarithm(own, beta, rng)
                if move != register:
                    make(now[action], register, move)
                    code[action] = code_of(now[action])
                    n_made += 1
    copy_into(sources, kept)
    return best


@compiled_within
def moved(sources: Indices, register: int, move: int) -> tuple[int, int, int]:
    """Return what else moves when a register does, and the new sources of both: swaps, and then copies, of each."""
    if move < len(sources):
        return move, sources[move], sources[register]
    return register, move - len(sources), move - len(sources)


@compiled_within
def make(sources: Indices, register: int, move: int) -> None:
    """Make one of the moves of a register."""
    other, source, other_source = moved(sources, register, move)
    sources[register] = source
    sources[other] = other_source


@compiled_within
def in_code(register: int, source: int) -> np.uint64:
    """Return what the source of a register adds to the code of an action."""
    return np.uint64(source) << np.uint64(4 * (register % 16))


@compiled_within
def code_of(sources: Indices) -> np.uint64:
    """Return the sources of an action as one number."""
    code = np.uint64(0)
    for register in range(len(sources)):
        code += in_code(register, sources[register])
    return code


@written_out
def score_moves(
    sources: Indices,
    code: Codes,
    action: int,
    register: int,
    fresh: FreshTrials,
    known: KnownMaps,
    tried: tuple[IntArray, Codes],
    work: Work,
    copy_cost: float,
    scores: FloatArray,
) -> None:
    """Fill in the evidence of the maps after each move, less what actions cost that lose content.

    Once a chain is cold, most maps that it looks at are those that it looked at before.

    Args:
        sources: Before the moves, shape [A, P].
        code: The sources of each action as one number, shape [A].
        action: Whose sources move.
        register: That moves.
        fresh: Trials of fresh objects.
        known: Maps whose evidence is at hand; others are added.
        tried: Room for the moves that lead to other maps [M], and for where each map is in the table, and the code of
            the action in it [2, M].
        work: Of ``room_for``.
        copy_cost: What each action that loses content costs, in nats.
        scores: Filled in, shape [M].
    """
    (codes, known_scores), (missing, numbers) = known, tried
    own, n_missing = sources[action], 0
    # A map's place in the table: the top bits of a sum over actions, to which this one adds its share.
    others, factor, power = np.uint64(0), np.uint64(0), np.uint64(1)
    for row in range(len(code)):
        power *= _SPREAD
        if row == action:
            factor = power
        else:
            others += code[row] * power
    rest = code[action] - in_code(register, own[register])
    for move in range(len(scores)):
        other, source, other_source = moved(own, register, move)
        coded = rest + in_code(register, source)
        if other != register:
            coded += in_code(other, other_source) - in_code(other, own[other])
        number = (others + coded * factor) >> np.uint64(64 - _KNOWN_BITS)
        is_known = len(own) <= _MAX_REGISTERS
        for row in range(len(code)):
            is_known = is_known and codes[number, row] == (coded if row == action else code[row])
        numbers[0, move], numbers[1, move] = number, coded
        scores[move] = known_scores[number, len(code)]
        if not is_known:
            missing[n_missing] = move
            n_missing += 1
    for begin in range(0, n_missing, _LANES):
        lanes = missing[begin : min(begin + _LANES, n_missing)]
        evidence_after(sources, action, register, lanes, fresh, work, scores)
    for place in range(n_missing):
        move = missing[place]
        number = numbers[0, move]
        for row in range(len(code)):
            codes[number, row] = numbers[1, move] if row == action else code[row]
        if copy_cost > 0:
            other = moved(own, register, move)[0]
            mine, theirs = own[register], own[other]
            make(own, register, move)
            scores[move] -= copy_cost * count_losses(sources)
            own[other], own[register] = theirs, mine
        known_scores[number, len(code)] = scores[move]


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
