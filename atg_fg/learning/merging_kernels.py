"""Merging of states, compiled: an automaton whose states are merged and taken apart again."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from atg_fg.core.patterns import IntArray
from atg_fg.inference.kernels.compilation import NONE, ZERO, compiled, compiled_within, written_out

#: Looks that one integer has a bit for.
_BITS = 62
#: Columns of ``Automaton.counts``.
_ADDED, _LEFT, _CHANGES = range(3)


class Automaton(NamedTuple):
    """K states, of which there are as many as were added; the first M · J are the places in view, mode by mode.

    Attributes:
        parent: The state that each was merged into, its own if into none, shape [K].
        mode: Shape [K].
        place: The place in view, or J if it is out of view, shape [K].
        looks: At which looks a symbol was in it, as bits, shape [K, W].
        n_looks: How many these are, shape [K].
        edges: Where each action leads to, then what each action came from in each mode; −1 if unknown, shape [K, E].
        known: Which edges are known, in the order in which they became so, shape [K, E].
        n_known: How many these are, shape [K].
        changes: That can be undone: a state and the edge it got, or −1 − the one it was merged into, shape [C, 2].
        counts: Of states that were added, of those that are left, and of changes, shape [3].
    """

    parent: IntArray
    mode: IntArray
    place: IntArray
    looks: IntArray
    n_looks: IntArray
    edges: IntArray
    known: IntArray
    n_known: IntArray
    changes: IntArray
    counts: IntArray


@compiled
def root(parent: IntArray, state: int) -> int:
    """Return the state that a state was merged into in the end."""
    above = parent[state]
    while above != parent[above]:
        above = parent[above]
    return int(above)


@compiled
def add(automaton: Automaton, mode: int, place: int, look: int) -> int:
    """Add a state that a symbol was in at one look, at none if it is −1; return it."""
    state = int(automaton.counts[_ADDED])
    automaton.parent[state], automaton.mode[state], automaton.place[state] = state, mode, place
    automaton.looks[state] = 0
    automaton.n_looks[state] = 0
    if look >= 0:
        automaton.looks[state, look // _BITS] = 1 << (look % _BITS)
        automaton.n_looks[state] = 1
    automaton.edges[state] = -1
    automaton.n_known[state] = 0
    automaton.counts[_ADDED] += 1
    automaton.counts[_LEFT] += 1
    return state


@compiled_within
def note(automaton: Automaton, state: int, change: int) -> None:
    """Note a change, so that it can be undone."""
    number = automaton.counts[_CHANGES]
    automaton.changes[number, 0], automaton.changes[number, 1] = state, change
    automaton.counts[_CHANGES] += 1


@compiled_within
def learn_edge(automaton: Automaton, state: int, edge: int, target: int) -> None:
    """Let an edge that was unknown lead to a state."""
    automaton.edges[state, edge] = target
    automaton.known[state, automaton.n_known[state]] = edge
    automaton.n_known[state] += 1
    note(automaton, state, edge)


@compiled
def unite(automaton: Automaton, one: int, two: int, to_do: IntArray) -> bool:
    """Make one of two states, and of all that this makes one; return whether they do not contradict.

    They do if they are in different modes or places, or two symbols would be in one place. Then what was done till that
    came out is to be undone.
    """
    parent, n_left = automaton.parent, 1
    to_do[0, 0], to_do[0, 1] = one, two
    while n_left:
        n_left -= 1
        one, two = root(parent, to_do[n_left, 0]), root(parent, to_do[n_left, 1])
        if one == two:
            continue
        if automaton.mode[one] != automaton.mode[two] or automaton.place[one] != automaton.place[two]:
            return False
        # Two symbols of one look would sooner or later be in different slots: that they contradict is said at once.
        for word in range(automaton.looks.shape[1]):
            if automaton.looks[one, word] & automaton.looks[two, word]:
                return False
        if automaton.n_known[one] < automaton.n_known[two]:
            one, two = two, one
        parent[two] = one
        for word in range(automaton.looks.shape[1]):
            automaton.looks[one, word] |= automaton.looks[two, word]
        automaton.n_looks[one] += automaton.n_looks[two]
        automaton.counts[_LEFT] -= 1
        note(automaton, two, -1 - one)
        for number in range(automaton.n_known[two]):
            edge = automaton.known[two, number]
            target = automaton.edges[two, edge]
            if automaton.edges[one, edge] >= 0:
                to_do[n_left, 0], to_do[n_left, 1] = automaton.edges[one, edge], target
                n_left += 1
            else:
                learn_edge(automaton, one, edge, target)
    return True


@compiled_within
def link(automaton: Automaton, state: int, edge: int, target: int, to_do: IntArray) -> bool:
    """Let an edge lead to a state, which becomes one with where it led so far; return as ``unite`` does."""
    known = root(automaton.parent, state)
    if automaton.edges[known, edge] >= 0:
        return unite(automaton, automaton.edges[known, edge], target, to_do)
    learn_edge(automaton, known, edge, target)
    return True


@compiled_within
def undo(automaton: Automaton, n_added: int, n_left: int) -> None:
    """Take back all changes, and the states that were added with them."""
    while automaton.counts[_CHANGES]:
        automaton.counts[_CHANGES] -= 1
        state, change = automaton.changes[automaton.counts[_CHANGES]]
        if change >= 0:
            automaton.n_known[state] -= 1
            automaton.edges[state, change] = -1
        else:
            into = -1 - change
            automaton.parent[state] = state
            for word in range(automaton.looks.shape[1]):
                automaton.looks[into, word] ^= automaton.looks[state, word]
            automaton.n_looks[into] -= automaton.n_looks[state]
    automaton.counts[_ADDED], automaton.counts[_LEFT] = n_added, n_left


@compiled_within
def has(symbols: IntArray, symbol: int) -> bool:
    """Return whether a symbol is among those of some looks."""
    for look in range(len(symbols)):
        for slot in range(symbols.shape[1]):
            if symbols[look, slot] == symbol:
                return True
    return False


@compiled_within
def insert(
    automaton: Automaton,
    next_modes: IntArray,
    trial: tuple[IntArray, IntArray],
    mode: int,
    first_look: int,
    to_do: IntArray,
) -> bool:
    """Take in a trial that begins in a mode; return whether it does not contradict, else it is to be undone.

    Args:
        automaton: Changed in place.
        next_modes: The mode that each action leads to, shape [M, A].
        trial: The symbol in each slot at each look, shape [T, J], and the actions between these, shape [T − 1].
        mode: Of the first look.
        first_look: Number of the first look.
        to_do: Room for pairs of states.
    """
    symbols, actions = trial
    n_looks, n_slots = symbols.shape
    n_actions = next_modes.shape[1]
    for first in range(n_looks):
        for slot in range(n_slots):
            symbol = symbols[first, slot]
            if has(symbols[:first], symbol):
                continue  # it has been followed
            now, previous, before = mode, NONE, NONE
            for time in range(n_looks):
                if time > 0:
                    before, now = now, next_modes[now, actions[time - 1]]
                place = n_slots
                for other in range(n_slots):
                    if symbols[time, other] == symbol:
                        place = other
                state = add(automaton, now, place, first_look + time)
                if previous >= 0:
                    action = actions[time - 1]
                    back = n_actions * (1 + before) + action
                    if not link(automaton, previous, action, state, to_do):
                        return False
                    if not link(automaton, state, back, previous, to_do):
                        return False
                if place < n_slots and not unite(automaton, now * n_slots + place, state, to_do):
                    return False
                previous = state
    return True


@written_out
def merge_hidden(automaton: Automaton, n_slots: int, most: int, to_do: IntArray) -> bool:
    """Merge states out of view while they do not contradict; return whether they are no more than can be tried.

    The merge that leaves fewest states is first, and of these the one of most looks. A merge that is refused once is
    refused for good, as further ones only add to what it contradicts.
    """
    counts = automaton.counts
    hidden, n_hidden = np.empty(counts[_ADDED], np.int64), 0
    for state in range(counts[_ADDED]):
        if automaton.parent[state] == state and automaton.place[state] == n_slots:
            hidden[n_hidden] = state
            n_hidden += 1
    if n_hidden > most:
        return False
    refused = np.zeros((n_hidden, n_hidden), np.bool_)
    while True:
        chosen, other, best_left, best_seen = NONE, NONE, 0, 0
        for first in range(n_hidden):
            one = hidden[first]
            for second in range(first + 1, n_hidden):
                two = hidden[second]
                if automaton.parent[one] != one or automaton.parent[two] != two or refused[first, second]:
                    continue
                n_added, n_left = counts[_ADDED], counts[_LEFT]
                seen = min(automaton.n_looks[one], automaton.n_looks[two])
                if unite(automaton, one, two, to_do):
                    left = counts[_LEFT]
                    if chosen < 0 or left < best_left or (left == best_left and seen > best_seen):
                        chosen, other, best_left, best_seen = one, two, left, seen
                else:
                    refused[first, second] = True
                undo(automaton, n_added, n_left)
        if chosen < 0:
            return True
        unite(automaton, chosen, other, to_do)
        counts[_CHANGES] = 0


@compiled
def merge(
    symbols: IntArray,
    actions: IntArray,
    lengths: IntArray,
    next_modes: IntArray,
    n_states: int,
    limits: tuple[int, int],
) -> tuple[int, Automaton]:
    """Return how many trials an automaton takes without contradiction, 0 if it is given up, and the automaton.

    Each trial begins in the mode that leaves fewest states.

    Args:
        symbols: The symbol in each slot at each look, shape [N, T, J].
        actions: Between the looks, shape [N, T − 1].
        lengths: Number of looks of each trial, shape [N].
        next_modes: The mode that each action leads to, shape [M, A].
        n_states: That the symbols of all trials are in, one for each look of their trial.
        limits: After how many trials to give up if more than one of them contradicts, and how many states out of view
            are still merged with each other.
    """
    n_trials, _, n_slots = symbols.shape
    n_modes, n_actions = next_modes.shape
    first_trials, most_hidden = limits
    size, n_words = n_states + n_modes * n_slots, lengths.sum() // _BITS + 1
    n_edges = n_actions * (1 + n_modes)
    automaton = Automaton(
        np.empty(size, np.int64),
        np.empty(size, np.int64),
        np.empty(size, np.int64),
        np.empty((size, n_words), np.int64),
        np.empty(size, np.int64),
        np.empty((size, n_edges), np.int64),
        np.empty((size, n_edges), np.int64),
        np.empty(size, np.int64),
        np.empty((size * (n_edges + 1), 2), np.int64),
        np.zeros(3, np.int64),
    )
    to_do = np.empty((size * n_edges + 1, 2), np.int64)
    for mode in range(n_modes):
        for slot in range(n_slots):
            add(automaton, mode, slot, NONE)
    n_taken, n_looks = 0, ZERO
    for number in range(n_trials):
        length = lengths[number]
        trial = (symbols[number, :length], actions[number])
        n_added, n_left = automaton.counts[_ADDED], automaton.counts[_LEFT]
        chosen, fewest = NONE, 0
        for mode in range(n_modes):
            fits = insert(automaton, next_modes, trial, mode, n_looks, to_do)
            if fits and (chosen < 0 or automaton.counts[_LEFT] < fewest):
                chosen, fewest = mode, automaton.counts[_LEFT]
            undo(automaton, n_added, n_left)
        if chosen >= 0:
            insert(automaton, next_modes, trial, chosen, n_looks, to_do)
            automaton.counts[_CHANGES] = 0
            n_taken += 1
            n_looks += length
        if number + 1 == first_trials and n_taken < first_trials - 1:
            return 0, automaton
    if n_taken < 2 or not merge_hidden(automaton, n_slots, most_hidden, to_do):
        return 0, automaton
    return n_taken, automaton
