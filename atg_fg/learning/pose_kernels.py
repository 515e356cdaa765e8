"""Loops of the filter over pose and contents, compiled: its rows are many and short."""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within

#: Keeps divisions by what can be zero in range.
_TINY = 1e-12
_LEAST = np.finfo(np.float64).tiny


@compiled
def probability_of_look(
    owner: IntArray, table: IntArray, in_view: IntArray, possible: FloatArray, shown: FloatArray, seen: IntArray
) -> FloatArray:
    """Return p(what was seen | row, the look is not wrong), shape [R].

    Args:
        owner: Of each row, shape [R].
        table: Of each row, shape [R].
        in_view: The register in each slot, shape [R, J].
        possible: 1 where slots show different registers, else 0, shape [R].
        shown: The probability of each symbol in each register of each table, shape [K, P, S].
        seen: The symbol in each slot, of each owner, shape [H, J].
    """
    result = np.empty(len(owner))
    n_slots = seen.shape[1]
    for row in range(len(owner)):
        of = shown[table[row]]
        probability = possible[row] / max(different(of, in_view[row]), _TINY)
        for slot in range(n_slots):
            probability *= of[in_view[row, slot], seen[owner[row], slot]]
        result[row] = probability
    return result


@compiled_within
def different(shown: FloatArray, registers: IntArray) -> float:
    """Return the probability that independent draws of the symbols of some registers are all different."""
    n_slots, n_symbols = len(registers), shown.shape[1]
    if n_slots == 1:
        return 1.0
    if n_slots == 2:
        same = 0.0
        for symbol in range(n_symbols):
            same += shown[registers[0], symbol] * shown[registers[1], symbol]
        return 1.0 - same
    # Of a set of symbols: the probability that the slots so far show these, all different.
    total, choice = 0.0, np.full(n_slots, -1)
    product = np.ones(n_slots + 1)
    slot = 0
    while slot >= 0:
        choice[slot] += 1
        if choice[slot] == n_symbols:
            choice[slot] = -1
            slot -= 1
            continue
        is_new = True
        for other in range(slot):
            is_new = is_new and choice[other] != choice[slot]
        if not is_new:
            continue
        product[slot + 1] = product[slot] * shown[registers[slot], choice[slot]]
        if slot + 1 == n_slots:
            total += product[n_slots]
        elif product[slot + 1] > 0:
            slot += 1
    return total


@compiled
def weigh(
    owner: IntArray,
    weight: FloatArray,
    likelihoods: tuple[FloatArray, FloatArray],
    log_evidence: FloatArray,
    log_weights: FloatArray,
    negligible: float,
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return which rows are left after a look, how probably it was not wrong under each, and their weights.

    Args:
        owner: Of each row, shape [R].
        weight: p(row | owner), shape [R].
        likelihoods: Of the look being right, shape [R], and of its being wrong, shape [H].
        log_evidence: ln p(what was seen | owner), shape [H]; the look's is added.
        log_weights: ln of the weight of each owner, shape [H]; of shape [0] if each is a trial of its own.
        negligible: Rows less probable than this are dropped.
    """
    right, wrong = likelihoods
    n_rows, n_owners = len(owner), len(log_evidence)
    total = np.zeros(n_owners)
    for row in range(n_rows):
        total[owner[row]] += weight[row] * (right[row] + wrong[owner[row]])
    log_evidence += np.log(total)
    importance = np.ones(n_owners)
    if len(log_weights):
        peak = (log_weights + log_evidence).max()
        importance[:] = 0.0
        if peak > -np.inf:
            importance = np.exp(log_weights + log_evidence - peak)
            importance /= importance.sum()
    kept, truth, weights, n_kept = np.empty(n_rows, np.int64), np.empty(n_rows), np.empty(n_rows), 0
    for row in range(n_rows):
        both = right[row] + wrong[owner[row]]
        own = weight[row] * both / max(total[owner[row]], _LEAST)
        if own * importance[owner[row]] > negligible:
            kept[n_kept], truth[n_kept], weights[n_kept] = row, right[row] / both, own
            n_kept += 1
    return kept[:n_kept], truth[:n_kept], weights[:n_kept]


@compiled
def reveal(
    tables: FloatArray,
    in_view: IntArray,
    shown: FloatArray,
    of: tuple[IntArray, IntArray],
    seen: IntArray,
    truth: FloatArray,
    events: FloatArray,
    repeat: float,
) -> None:
    """Let tables learn what a look shows of the registers in view.

    Args:
        tables: What is known of the registers in each row, shape [R, P, S]; changed in place.
        in_view: The register in each slot, shape [R, J].
        shown: The probability of each symbol in each register of each table, shape [K, P, S].
        of: Owner and table of each row.
        seen: The symbol in each slot, of each owner, shape [H, J].
        truth: The probability that the look was not wrong, shape [R].
        events: Of each row, shape [R, 4]; repeated symbols and revealed registers, the last two, are added.
        repeat: κ.
    """
    owner, number = of
    n_symbols = tables.shape[2]
    for row in range(len(tables)):
        for slot in range(seen.shape[1]):
            register, symbol = in_view[row, slot], seen[owner[row], slot]
            known, rest = tables[row, register, symbol], 0.0
            for each in range(n_symbols):
                rest += tables[row, register, each]
                tables[row, register, each] *= 1.0 - truth[row]
            tables[row, register, symbol] += truth[row]
            expected = shown[number[row], register, symbol]
            revealed = truth[row] * (1.0 - known / max(expected, _TINY))
            from_all = repeat / n_symbols * max(1.0 - rest, 0.0)
            events[row, 2] += revealed * min(from_all / max(expected - known, _TINY), 1.0)
            events[row, 3] += revealed


@compiled
def merge_rows(
    order: IntArray, key: IntArray, weight: FloatArray, table: IntArray, events: FloatArray, contents: FloatArray
) -> tuple[IntArray, FloatArray, IntArray, FloatArray, FloatArray, IntArray]:
    """Make one row of those with the same key, whose table has their mean, and keep each different table once.

    Args:
        order: Of the rows by their key, shape [R].
        key: Shape [R].
        weight: Shape [R].
        table: Shape [R].
        events: Shape [R, 4].
        contents: All tables, shape [K, P, S].

    Returns:
        The last of the rows that each new one is made of, the weights, tables and events of these, the contents of all
        tables that are left, and which of the old ones those are that come first.
    """
    n_rows, n_old, n_new = len(order), len(contents), 0
    begins, weights, tables = np.empty(n_rows, np.int64), np.zeros(n_rows), np.empty(n_rows, np.int64)
    last = np.empty(n_rows, np.int64)
    expected, is_used, n_mixed = np.zeros((n_rows, events.shape[1])), np.zeros(n_old, np.bool_), 0
    place = 0
    while place < n_rows:
        first, is_mixed = place, False
        while place < n_rows and key[order[place]] == key[order[first]]:
            weights[n_new] += weight[order[place]]
            is_mixed = is_mixed or table[order[place]] != table[order[first]]
            place += 1
        for again in range(first, place):
            member = order[again]
            expected[n_new] += weight[member] / max(weights[n_new], _LEAST) * events[member]
        tables[n_new] = -1 if is_mixed else table[order[first]]
        if is_mixed:
            n_mixed += 1
        else:
            is_used[tables[n_new]] = True
        begins[n_new], last[n_new] = first, order[place - 1]
        n_new += 1
    used, number, n_left = np.empty(n_old, np.int64), np.empty(n_old, np.int64), 0
    for old in range(n_old):
        if is_used[old]:
            used[n_left], number[old] = old, n_left
            n_left += 1
    left = np.zeros((n_left + n_mixed, contents.shape[1], contents.shape[2]))
    used = used[:n_left]
    for old in range(n_left):
        left[old] = contents[used[old]]
    for new in range(n_new):
        if tables[new] >= 0:
            tables[new] = number[tables[new]]
            continue
        for place in range(begins[new], n_rows):
            member = order[place]
            if key[member] != key[last[new]]:
                break
            left[n_left] += weight[member] / max(weights[new], _LEAST) * contents[table[member]]
        tables[new] = n_left
        n_left += 1
    return last[:n_new], weights[:n_new], tables[:n_new], expected[:n_new], left, used
