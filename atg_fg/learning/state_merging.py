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
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from atg_fg.core.patterns import Detection
from atg_fg.learning.raw_trials import RawTrial, side_by_side
from atg_fg.learning.shared_structure import SharedStructure

# Compiled code takes longer to load than all else, so it is loaded where it is used.
if TYPE_CHECKING:
    from atg_fg.learning.merging_kernels import Automaton

#: Structures with more registers are not proposed.
MAX_REGISTERS: Final = 9
#: States out of view that are still merged with each other: each pair of them is tried.
MAX_HIDDEN: Final = 200
#: Of the first trials so many are looked at before an automaton is given up that less than all but one of them follow.
FIRST_TRIALS: Final = 4
#: Draws of so many trials that are merged, for one mode and for more. Where most trials of a draw follow with one mode,
#: no further ones are needed.
N_DRAWS: Final = (24, 8)
DRAWN: Final = 16
MOST: Final = 0.75

NextModes = tuple[tuple[int, ...], ...]


class Merged(NamedTuple):
    """What trials were merged into.

    Attributes:
        structure: In canonical form; what no trial says of its maps is filled up.
        n_trials: Trials that it explains without an error.
    """

    structure: SharedStructure
    n_trials: int


def merged_draws(
    trials: Sequence[RawTrial], n_actions: int, rng: np.random.Generator
) -> tuple[list[SharedStructure], int]:
    """Return the structures that draws of trials merge into, best first, and how many were tried.

    The best is the one that most trials of a draw follow, and of these the most probable one beforehand.

    Args:
        trials: Perhaps of one kind, as no structure at hand explains them.
        n_actions: A.
        rng: Draws.
    """
    found: dict[SharedStructure, int] = {}
    n_tried = 0
    for n_modes, n_draws in enumerate(N_DRAWS, start=1):
        for _ in range(n_draws):
            drawn = [trials[number] for number in rng.permutation(len(trials))[:DRAWN].tolist()]
            merged = merge_states(drawn, mode_automata(n_modes, n_actions))
            n_tried += len(merged)
            for each in merged:
                if each is not None and each.structure.is_believable:
                    found[each.structure] = max(each.n_trials, found.get(each.structure, 0))
        if max(found.values(), default=0) > MOST * min(DRAWN, len(trials)):
            break
    return sorted(found, key=lambda structure: (-found[structure], -structure.log_prior)), n_tried


def merge_states(trials: Sequence[RawTrial], automata: Sequence[NextModes]) -> list[Merged | None]:
    """Return the structure that most of the trials follow without any error, for each automaton; ``None`` if none.

    Args:
        trials: At least one, those first that are most probably of one kind. Trials with missing symbols, or with a
            symbol twice in a look, are left out.
        automata: Each has for each mode the mode that each action leads to.
    """
    from atg_fg.learning import merging_kernels  # they load Numba

    whole = [trial for trial in trials if all(_is_whole(look) for look in trial.detections)]
    if not whole:
        return [None] * len(automata)
    symbols, actions = side_by_side(whole)
    lengths = np.array([len(trial.detections) for trial in whole])
    n_states = sum(len(trial.detections) * len(set(itertools.chain(*trial.detections))) for trial in whole)
    limits, found = (FIRST_TRIALS, MAX_HIDDEN), list[Merged | None]()
    for next_modes in automata:
        n_taken, automaton = merging_kernels.merge(symbols, actions, lengths, np.array(next_modes), n_states, limits)
        structure = _structure(automaton, next_modes, symbols.shape[2]) if n_taken else None
        found.append(None if structure is None else Merged(structure, n_taken))
    return found


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


def _structure(automaton: Automaton, next_modes: NextModes, n_slots: int) -> SharedStructure | None:
    """Return what the states of an automaton are registers of; ``None`` if there are too many."""
    from atg_fg.learning.merging_kernels import root

    n_modes, n_actions = len(next_modes), len(next_modes[0])
    merged = [root(automaton.parent, state) for state in range(automaton.counts[0])]
    name = {merged[mode * n_slots + slot]: slot for mode in range(n_modes) for slot in range(n_slots)}
    numbers = [n_slots] * n_modes
    for state, into in enumerate(merged):
        if state == into and state not in name:
            mode = automaton.mode[state]
            name[state] = numbers[mode]
            numbers[mode] += 1
    n_registers = max(numbers)
    if n_registers > MAX_REGISTERS:
        return None
    maps = [[-1] * n_registers for _ in range(n_modes * n_actions)]
    for state in name:
        for action, target in enumerate(automaton.edges[state, :n_actions].tolist()):
            if target >= 0:
                maps[automaton.mode[state] * n_actions + action][name[merged[target]]] = name[state]
    sources = tuple(_filled_up(row) for row in maps)
    return SharedStructure(n_slots, sources, next_modes if n_modes > 1 else ()).canonical()


def _filled_up(row: Sequence[int]) -> tuple[int, ...]:
    """Return a permutation that is this one where it is known, and leaves places alone where it can."""
    filled = [source if source >= 0 or place in row else place for place, source in enumerate(row)]
    left = iter([place for place in range(len(row)) if place not in filled])
    return tuple(source if source >= 0 else next(left) for source in filled)
