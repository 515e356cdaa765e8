"""Structures proposed by merging states: where a symbol goes is a small automaton, the same for all objects of a kind.

Symbols of one object differ, so within a trial a symbol names its register. A state is a mode and a place; where a
symbol is at a look is an unknown state, in view or out of view. All that is in one slot in one mode is in one place,
and an action maps the places of a mode one to one, so that states which are merged fold together what goes before them
and what comes after. Two symbols of one trial are never in one place. What is left to choose is which mode each action
leads to, and in which mode a trial begins. It takes no more than few trials of an object that nothing goes wrong with;
a trial that contradicts the others is left out.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final, NamedTuple

from atg_fg.core.patterns import Detection
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure

#: Structures with more registers are not proposed.
MAX_REGISTERS: Final = 9
#: States out of view that are still merged with each other: each pair of them is tried.
MAX_HIDDEN: Final = 200
#: Of the first trials so many are looked at before an automaton is given up that less than all but one of them follow.
FIRST_TRIALS: Final = 4

NextModes = tuple[tuple[int, ...], ...]


class ContradictionError(Exception):
    """Two states that cannot be one."""


class Merged(NamedTuple):
    """What trials were merged into.

    Attributes:
        structure: In canonical form; what no trial says of its maps is filled up.
        n_trials: Trials that it explains without an error.
    """

    structure: SharedStructure
    n_trials: int


def merge_states(trials: Sequence[RawTrial], next_modes: NextModes) -> Merged | None:
    """Return the structure that most of the trials follow without any error; ``None`` if there is none.

    Args:
        trials: At least one, those first that are most probably of one kind. Trials with missing symbols, or with a
            symbol twice in a look, are left out.
        next_modes: For each mode, the mode that each action leads to.
    """
    whole = [trial for trial in trials if all(_is_whole(look) for look in trial.detections)]
    if not whole:
        return None
    automaton = _Automaton(next_modes, len(whole[0].detections[0]))
    n_taken = 0
    for number, trial in enumerate(whole):
        n_taken += automaton.take(trial)
        if number + 1 == FIRST_TRIALS and n_taken < FIRST_TRIALS - 1:
            return None
    if n_taken < 2 or not automaton.merge_hidden():
        return None
    structure = automaton.structure()
    return Merged(structure, n_taken) if structure is not None else None


def _is_whole(look: Detection) -> bool:
    return None not in look and len(set(look)) == len(look)


@lru_cache(maxsize=8)
def mode_automata(n_modes: int, n_actions: int) -> tuple[NextModes, ...]:
    """Return the ways in which actions may lead from mode to mode, each up to the names of the modes.

    From some mode all others are reached.
    """
    if n_modes == 1:
        return (((0,) * n_actions,),)
    found: dict[NextModes, None] = {}
    for rows in itertools.product(itertools.product(range(n_modes), repeat=n_actions), repeat=n_modes):
        least = min(
            tuple(tuple(name[target] for target in rows[name.index(mode)]) for mode in range(n_modes))
            for name in itertools.permutations(range(n_modes))
        )
        if any(_n_reached(least, mode) == n_modes for mode in range(n_modes)):
            found[least] = None
    return tuple(found)


def _n_reached(next_modes: NextModes, first: int) -> int:
    reached = [first]
    for mode in reached:  # grows while it is walked
        reached += [target for target in dict.fromkeys(next_modes[mode]) if target not in reached]
    return len(reached)


class _Automaton:
    """States that are merged and can be taken apart again.

    Each state has a place in view, or J if it is out of view, and the looks at which a symbol was in it, as bits.
    """

    def __init__(self, next_modes: NextModes, n_slots: int) -> None:
        self._next_modes, self._n_slots = next_modes, n_slots
        self._parent: list[int] = []
        self._label: list[tuple[int, int]] = []
        self._looks: list[int] = []
        self._edges: list[dict[object, int]] = []
        self._log: list[tuple[Any, Any, Any]] = []
        self._n_looks, self.n_states = 0, 0
        self._in_view = [[self._add((mode, slot), 0) for slot in range(n_slots)] for mode in range(len(next_modes))]

    def take(self, trial: RawTrial) -> bool:
        """Take in a trial from the first mode that leaves fewest states, if there is one without contradiction."""
        possible = []
        for mode in range(len(self._next_modes)):
            mark = self._mark()
            try:
                self._insert(trial, mode)
                possible.append((self.n_states, mode))
            except ContradictionError:
                pass
            self._undo(mark)
        if not possible:
            return False
        self._insert(trial, min(possible)[1])
        self._n_looks += len(trial.detections)
        return True

    def merge_hidden(self) -> bool:
        """Merge states out of view while they do not contradict; return whether they are few enough for that.

        The merge that leaves fewest states is first, and of these the one of most looks. A merge that is refused once
        is refused for good, as further ones only add to what it contradicts.
        """
        refused: set[tuple[int, int]] = set()
        while True:
            hidden = [state for state in self._states() if self._label[state][1] == self._n_slots]
            if len(hidden) > MAX_HIDDEN:
                return False
            seen = {state: self._looks[state].bit_count() for state in hidden}
            possible = []
            for one, two in itertools.combinations(hidden, 2):
                if (one, two) in refused:
                    continue
                mark = self._mark()
                try:
                    self._unite(one, two)
                    possible.append((self.n_states, -min(seen[one], seen[two]), one, two))
                except ContradictionError:
                    refused.add((one, two))
                self._undo(mark)
            if not possible:
                return True
            self._unite(*min(possible)[2:])

    def structure(self) -> SharedStructure | None:
        """Return what the states are registers of; ``None`` if there are too many."""
        n_modes, n_actions = len(self._next_modes), len(self._next_modes[0])
        name = {self._find(state): slot for states in self._in_view for slot, state in enumerate(states)}
        numbers = [self._n_slots] * n_modes
        for state in self._states():
            if state not in name:
                mode = self._label[state][0]
                name[state] = numbers[mode]
                numbers[mode] += 1
        n_registers = max(numbers)
        if n_registers > MAX_REGISTERS:
            return None
        maps = [[-1] * n_registers for _ in range(n_modes * n_actions)]
        for state in name:
            for action, target in self._edges[state].items():
                if isinstance(action, int):
                    mode = self._label[state][0]
                    maps[mode * n_actions + action][name[self._find(target)]] = name[state]
        sources = tuple(_filled_up(row) for row in maps)
        return SharedStructure(self._n_slots, sources, self._next_modes if n_modes > 1 else ()).canonical()

    def _states(self) -> list[int]:
        return [state for state, parent in enumerate(self._parent) if state == parent]

    def _add(self, label: tuple[int, int], looks: int) -> int:
        self._parent.append(len(self._parent))
        self._label.append(label)
        self._looks.append(looks)
        self._edges.append({})
        self.n_states += 1
        return len(self._parent) - 1

    def _insert(self, trial: RawTrial, mode: int) -> None:
        modes = [mode]
        for action in trial.actions:
            modes.append(self._next_modes[modes[-1]][action])
        for symbol in dict.fromkeys(symbol for look in trial.detections for symbol in look):
            previous = -1
            for time, look in enumerate(trial.detections):
                place = look.index(symbol) if symbol in look else self._n_slots
                state = self._add((modes[time], place), 1 << (self._n_looks + time))
                if previous >= 0:
                    self._link(previous, trial.actions[time - 1], state)
                if place < self._n_slots:
                    self._unite(self._in_view[modes[time]][place], state)
                previous = state

    def _link(self, before: int, action: int, after: int) -> None:
        back = (self._label[before][0], action)
        for state, key, other in ((before, action, after), (after, back, before)):
            edges = self._edges[self._find(state)]
            if key in edges:
                self._unite(edges[key], other)
            else:
                self._set(edges, key, other)

    def _unite(self, one: int, two: int) -> None:
        """Make one of two states, and of all that this makes one.

        Raises:
            ContradictionError: They are in different modes or slots, or two symbols would be in one place.
        """
        to_do = [(one, two)]
        while to_do:
            one, two = map(self._find, to_do.pop())
            if one == two:
                continue
            # Two symbols of one look would sooner or later be in different slots: that they contradict is said at once.
            if self._label[one] != self._label[two] or self._looks[one] & self._looks[two]:
                raise ContradictionError
            if len(self._edges[one]) < len(self._edges[two]):
                one, two = two, one
            self._set(self._parent, two, one)
            self._set(self._looks, one, self._looks[one] | self._looks[two])
            self.n_states -= 1
            for key, target in self._edges[two].items():
                if key in self._edges[one]:
                    to_do.append((self._edges[one][key], target))
                else:
                    self._set(self._edges[one], key, target)

    def _find(self, state: int) -> int:
        while self._parent[state] != state:
            state = self._parent[state]
        return state

    def _set(self, table: Any, key: Any, value: Any) -> None:
        self._log.append((table, key, table.get(key) if isinstance(table, dict) else table[key]))
        table[key] = value

    def _mark(self) -> tuple[int, int, int]:
        return len(self._log), len(self._parent), self.n_states

    def _undo(self, mark: tuple[int, int, int]) -> None:
        n_changes, n_states, self.n_states = mark
        while len(self._log) > n_changes:
            table, key, old = self._log.pop()
            if old is None:
                del table[key]
            else:
                table[key] = old
        for states in (self._parent, self._label, self._looks, self._edges):
            del states[n_states:]


def _filled_up(row: Sequence[int]) -> tuple[int, ...]:
    """Return a permutation that is this one where it is known, and leaves places alone where it can."""
    filled = [source if source >= 0 or place in row else place for place, source in enumerate(row)]
    left = iter([place for place in range(len(row)) if place not in filled])
    return tuple(source if source >= 0 else next(left) for source in filled)
