"""Loops of the filter over pose and contents, compiled: its rows are many and short."""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import ZERO, compiled, compiled_within
from atg_fg.learning.kernels import add_share, copy_into
from atg_fg.learning.rates import AGAIN, FAILED, FAILED_BEFORE, REPEAT, REVEAL, SLIP, WRONG
from atg_fg.learning.register_contents import SAME, TINY

#: Rows less probable than this are dropped.
NEGLIGIBLE = 1e-9
_LEAST = np.finfo(np.float64).tiny

#: Owner, start, pose, weight, table and events of each row, as ``atg_fg.learning.pose_filter`` has them.
Rows = tuple[IntArray, IntArray, IntArray, FloatArray, IntArray, FloatArray]
#: What is known of the symbols in the registers of each table, and the probability to be shown, both [K, P, S].
Known = tuple[FloatArray, FloatArray]


@compiled_within
def probability_of_look(
    rows: Rows, registers: IntArray, possible: FloatArray, shown: FloatArray, seen: IntArray
) -> FloatArray:
    """Return p(what was seen | row, the look is not wrong), shape [R].

    Args:
        rows: What is believed.
        registers: The register in each slot of each pose, shape [P', J].
        possible: 1 where slots show different registers, else 0, of each pose, shape [P'].
        shown: The probability of each symbol in each register of each table, shape [K, P, S].
        seen: The symbol in each slot, of each owner, shape [H, J].
    """
    owner, _, pose, _, table, _ = rows
    result = np.empty(len(owner))
    n_slots = seen.shape[1]
    for row in range(len(owner)):
        probability = possible[pose[row]] / max(different(shown[table[row]], registers[pose[row]]), TINY)
        for slot in range(n_slots):
            probability *= shown[table[row], registers[pose[row], slot], seen[owner[row], slot]]
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
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return which rows are left after a look, how probably it was not wrong under each, and their weights.

    Args:
        owner: Of each row, shape [R].
        weight: p(row | owner), shape [R].
        likelihoods: Of the look being right, shape [R], and of its being wrong, shape [H].
        log_evidence: ln p(what was seen | owner), shape [H]; the look's is added.
        log_weights: ln of the weight of each owner, shape [H]; of shape [0] if each is a trial of its own.
    """
    right, wrong = likelihoods
    n_rows, n_owners = len(owner), len(log_evidence)
    total = np.zeros(n_owners)
    for row in range(n_rows):
        total[owner[row]] += weight[row] * (right[row] + wrong[owner[row]])
    for each in range(n_owners):
        log_evidence[each] += np.log(total[each])
    importance = importance_of(log_evidence, log_weights)
    kept, truth, weights, n_kept = np.empty(n_rows, np.int64), np.empty(n_rows), np.empty(n_rows), 0
    for row in range(n_rows):
        both = right[row] + wrong[owner[row]]
        own = weight[row] * both / max(total[owner[row]], _LEAST)
        if own * importance[owner[row]] > NEGLIGIBLE:
            kept[n_kept], truth[n_kept], weights[n_kept] = row, right[row] / both, own
            n_kept += 1
    return kept[:n_kept], truth[:n_kept], weights[:n_kept]


@compiled_within
def importance_of(log_evidence: FloatArray, log_weights: FloatArray) -> FloatArray:
    """Return p(owner | what was seen), shape [H], or 1 where ``log_weights`` is empty: each is a trial of its own."""
    importance, peak, whole = np.ones(len(log_evidence)), -np.inf, 0.0
    for each in range(len(log_weights)):
        peak = max(peak, log_weights[each] + log_evidence[each])
    for each in range(len(log_weights)):
        importance[each] = np.exp(log_weights[each] + log_evidence[each] - peak) if peak > -np.inf else 0.0
        whole += importance[each]
    for each in range(len(log_weights)):
        importance[each] /= max(whole, _LEAST)
    return importance


@compiled_within
def reveal(
    rows: Rows, known: Known, registers: IntArray, seen: IntArray, truth: FloatArray, repeat: float
) -> tuple[FloatArray, IntArray]:
    """Return the tables that a look changes, shape [I, P, S], and the rows whose they are, shape [I].

    Args:
        rows: Repeated symbols and revealed registers, the last two of ``events``, are added.
        known: What is known, and so shown, in each table.
        registers: The register in each slot of each pose, shape [P', J].
        seen: The symbol in each slot, of each owner, shape [H, J].
        truth: The probability that the look was not wrong, of each row, shape [R].
        repeat: κ.
    """
    owner, _, pose, _, of_row, events = rows
    contents, shown = known
    n_symbols = contents.shape[2]
    changed, n_changed = np.empty(len(owner), np.int64), 0
    for row in range(len(owner)):
        if truth[row] <= SAME:
            continue
        is_known = True
        for slot in range(seen.shape[1]):
            register, symbol = registers[pose[row], slot], seen[owner[row], slot]
            before, rest = contents[of_row[row], register, symbol], 0.0
            # What shows nothing but what is known for certain leaves a table as it is.
            is_known = is_known and before > 1.0 - SAME
            for each in range(n_symbols):
                rest += contents[of_row[row], register, each]
            expected = shown[of_row[row], register, symbol]
            revealed = truth[row] * (1.0 - before / max(expected, TINY))
            from_all = repeat / n_symbols * max(1.0 - rest, 0.0)
            events[row, REPEAT] += revealed * min(from_all / max(expected - before, TINY), 1.0)
            events[row, REVEAL] += revealed
        if not is_known:
            changed[n_changed] = row
            n_changed += 1
    tables = np.empty((n_changed, contents.shape[1], n_symbols))
    for index in range(n_changed):
        row, table = changed[index], tables[index]
        copy_into(table, contents[of_row[row]])
        for slot in range(seen.shape[1]):
            register, symbol = registers[pose[row], slot], seen[owner[row], slot]
            for each in range(n_symbols):
                table[register, each] *= 1.0 - truth[row]
            table[register, symbol] += truth[row]
    return tables, changed[:n_changed]


@compiled
def merged(
    rows: Rows, known: Known, tables: FloatArray, changed: IntArray, sizes: tuple[int, int], repeat: float
) -> tuple[Rows, Known]:
    """Make one row of those with the same owner, start and pose, and keep each different table once.

    Args:
        rows: With tables as they were.
        known: What is known, and so shown, in each table.
        tables: New ones, shape [I, P, S].
        changed: Index of the row that each belongs to, shape [I].
        sizes: How many starts and poses there are.
        repeat: κ.

    Returns:
        The rows, whose tables are the mean of those that each is made of, and the tables that are left.
    """
    owner, start, pose, weight, of_row, events = rows
    contents, shown = known
    n_starts, n_poses = sizes
    n_rows, n_old, n_new = len(owner), len(contents), 0
    n_tables = n_old + len(tables)  # the new ones have the next numbers
    table, key, n_owners = of_row.copy(), np.empty(n_rows, np.int64), ZERO
    for index in range(len(changed)):
        table[changed[index]] = n_old + index
    for row in range(n_rows):
        key[row] = (owner[row] * n_starts + start[row]) * n_poses + pose[row]
        n_owners = max(n_owners, owner[row] + 1)
    order = in_order(owner, n_owners, in_order(start, n_starts, in_order(pose, n_poses, np.arange(n_rows))))
    begins, weights, numbers = np.empty(n_rows, np.int64), np.zeros(n_rows), np.empty(n_rows, np.int64)
    last = np.empty(n_rows, np.int64)
    expected, is_used, n_mixed = np.zeros((n_rows, events.shape[1])), np.zeros(n_tables, np.bool_), 0
    place = 0
    while place < n_rows:
        first, is_mixed = place, False
        while place < n_rows and key[order[place]] == key[order[first]]:
            weights[n_new] += weight[order[place]]
            is_mixed = is_mixed or table[order[place]] != table[order[first]]
            place += 1
        for again in range(first, place):
            member = order[again]
            share = weight[member] / max(weights[n_new], _LEAST)
            for event in range(events.shape[1]):
                expected[n_new, event] += share * events[member, event]
        numbers[n_new] = -1 if is_mixed else table[order[first]]
        if is_mixed:
            n_mixed += 1
        else:
            is_used[numbers[n_new]] = True
        begins[n_new], last[n_new] = first, order[place - 1]
        n_new += 1
    number, n_left = np.empty(n_tables, np.int64), 0
    left = np.zeros((is_used.sum() + n_mixed, contents.shape[1], contents.shape[2]))
    shown_left = np.empty_like(left)
    for old in range(n_tables):
        if is_used[old]:
            number[old] = n_left
            if old < n_old:
                copy_into(left[n_left], contents[old])
                copy_into(shown_left[n_left], shown[old])
            else:
                copy_into(left[n_left], tables[old - n_old])
                show(left[n_left], repeat, shown_left[n_left])
            n_left += 1
    for new in range(n_new):
        if numbers[new] >= 0:
            numbers[new] = number[numbers[new]]
            continue
        for place in range(begins[new], n_rows):
            member = order[place]
            if key[member] != key[last[new]]:
                break
            share = weight[member] / max(weights[new], _LEAST)
            if table[member] < n_old:
                add_share(share, contents[table[member]], left[n_left])
            else:
                add_share(share, tables[table[member] - n_old], left[n_left])
        show(left[n_left], repeat, shown_left[n_left])
        numbers[new] = n_left
        n_left += 1
    last = last[:n_new]
    kept = (owner[last], start[last], pose[last], weights[:n_new], numbers[:n_new], expected[:n_new])
    return kept, (left, shown_left)


@compiled_within
def in_order(numbers: IntArray, n_numbers: int, order: IntArray) -> IntArray:
    """Return an order of rows by numbers below a limit, and where these are equal, as before.

    ``np.argsort`` takes seconds to compile.
    """
    places, result = np.zeros(n_numbers + 1, np.int64), np.empty_like(order)
    for row in range(len(order)):
        places[numbers[row] + 1] += 1
    for number in range(n_numbers):
        places[number + 1] += places[number]
    for row in order:
        result[places[numbers[row]]] = row
        places[numbers[row]] += 1
    return result


@compiled_within
def show(contents: FloatArray, repeat: float, shown: FloatArray) -> None:
    """Fill in the probability of each symbol in each register of a table, as ``symbol_probabilities`` has it."""
    n_registers, n_symbols = contents.shape
    absent = np.ones(n_symbols)
    for register in range(n_registers):
        for symbol in range(n_symbols):
            absent[symbol] *= max(1.0 - contents[register, symbol], TINY)
    for register in range(n_registers):
        known, total = 0.0, 0.0
        for symbol in range(n_symbols):  # by itself: the compiler then has several divisions done at once
            shown[register, symbol] = absent[symbol] / max(1.0 - contents[register, symbol], TINY)
        for symbol in range(n_symbols):
            known += contents[register, symbol]
            total += shown[register, symbol]
        rest = max(1.0 - known, 0.0)
        for symbol in range(n_symbols):
            drawn = (1.0 - repeat) * (shown[register, symbol] / total) + repeat / n_symbols
            shown[register, symbol] = contents[register, symbol] + rest * drawn


@compiled
def follow(
    rows: Rows,
    known: Known,
    structure: tuple[IntArray, IntArray, FloatArray, int],
    actions: IntArray,
    seen: IntArray,
    rates: tuple[float, float, float, float, float],
    log_evidence: FloatArray,
    log_weights: FloatArray,
) -> tuple[Rows, Known]:
    """Take in looks that showed every slot, and the actions between them.

    Args:
        rows: What is believed.
        known: What is known, and so shown, in each table.
        structure: Successors of each pose [P', A], the register in each slot of each pose [P', J], 1 where these are
            different, else 0, of each pose [P'], and how many starts there are.
        actions: Of each owner between the looks, shape [T − 1, H].
        seen: The symbol in each slot at each look, of each owner, shape [T, H, J].
        rates: Of slips, ε and ε′, of wrong looks and of one that shows a pattern, and κ.
        log_evidence: ln p(what was seen | owner), shape [H]; that of the looks is added.
        log_weights: ln of the weight of each owner, shape [H]; of shape [0] if each is a trial of its own.
    """
    successors, registers, possible, n_starts = structure
    slip, slip_again, wrong, wrong_pattern, repeat = rates
    for look in range(len(seen)):
        if look > 0:
            rows = act(rows, successors, actions[look - 1], (slip, slip_again))
        right = probability_of_look(rows, registers, possible, known[1], seen[look])
        for row in range(len(right)):
            right[row] *= 1.0 - wrong
        wrong_look = np.full(len(log_evidence), wrong_pattern)
        kept, truth, weight = weigh(rows[0], rows[3], (right, wrong_look), log_evidence, log_weights)
        rows = rows_with(rows, kept, weight)
        events = rows[5]
        for row in range(len(truth)):
            events[row, WRONG] += 1.0 - truth[row]
        tables, changed = reveal(rows, known, registers, seen[look], truth, repeat)
        rows, known = merged(rows, known, tables, changed, (n_starts, len(registers)), repeat)
    return rows, known


@compiled
def act(rows: Rows, successors: IntArray, actions: IntArray, slips: tuple[float, float]) -> Rows:
    """Move each row by the action of its owner, and leave a second one behind for a slip, after all that moved.

    A slip is the more probable the more probably the action failed when it was last done.
    """
    n_rows = len(rows[0])
    both, weights = np.empty(2 * n_rows, np.int64), np.empty(2 * n_rows)
    for row in range(n_rows):
        both[row] = both[n_rows + row] = row
        weights[row] = weights[n_rows + row] = rows[3][row]
    acted = rows_with(rows, both, weights)
    owner, _, pose, weight, _, events = acted
    for row in range(n_rows):
        stayed, action = n_rows + row, actions[owner[row]]
        failed_before = events[row, FAILED + action]
        again = failed_before * slips[1]
        slip = (1.0 - failed_before) * slips[0] + again
        pose[row] = successors[pose[row], action]
        weight[row] *= 1.0 - slip
        weight[stayed] *= slip
        events[row, FAILED_BEFORE] += (failed_before - again) / (1.0 - slip)
        events[row, FAILED + action] = 0.0
        events[stayed, SLIP] += 1.0
        events[stayed, AGAIN] += again / slip
        events[stayed, FAILED_BEFORE] += again / slip
        events[stayed, FAILED + action] = 1.0
    return acted


@compiled_within
def rows_with(rows: Rows, index: IntArray, weight: FloatArray) -> Rows:
    """Return the rows with these indices, and with other weights."""
    owner, start, pose, _, table, events = rows
    owners, starts, poses = np.empty_like(index), np.empty_like(index), np.empty_like(index)
    tables, all_events = np.empty_like(index), np.empty((len(index), events.shape[1]))
    for place in range(len(index)):
        row = index[place]
        owners[place], starts[place], poses[place], tables[place] = owner[row], start[row], pose[row], table[row]
        for event in range(events.shape[1]):
            all_events[place, event] = events[row, event]
    return owners, starts, poses, weight, tables, all_events
