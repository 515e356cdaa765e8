"""Objects that follow structures, or none, and trials of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.patterns import Detection, PatternAlphabet
from atg_fg.learning.rates import Rates
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure
from atg_fg.worlds.arcube import ACTION_SOURCES, SUCCESSORS, make_arcubes, shown_pattern

ARCUBES = arcube_assumptions()
#: Places of the cube with those in view first: front, top, and then back, left, right, bottom.
_PLACES = (0, 4, 1, 2, 3, 5)
CUBE = SharedStructure(
    2, tuple(tuple(_PLACES.index(sources[place]) for place in _PLACES) for sources in ACTION_SOURCES.values())
).canonical()
#: Three registers in a ring, two of them in view; one action turns the ring, the other swaps what is in view.
RING = SharedStructure(2, ((1, 2, 0), (1, 0, 2)))
#: Two walls of which one is in front, a lid in view on top, and what is inside: one action takes the lid off for good,
#: so that the top shows the inside; the other turns the walls.
BOX = SharedStructure(2, ((0, 3, 2, 3), (2, 1, 0, 3))).canonical()
#: One register in view may come into both slots, which then cannot show it: slots never show the same.
DOUBLE = SharedStructure(2, ((0, 2, 2), (1, 0, 2)))


def _prism() -> SharedStructure:
    """A hexagonal prism, by its geometry: 6 sides in the order of a turn to the left, and 2 ends.

    While it stands, a side is in front and an end on top; while it lies, an end in front and a side on top.
    """

    def standing(turn: int) -> int:
        return 0 if turn % 6 == 0 else turn % 6 + 1

    def lying(turn: int) -> int:
        return 1 if turn % 6 == 0 else turn % 6 + 1

    maps = []
    for place, end, mirrored, other, ends in ((standing, 1, False, lying, (7, 0)), (lying, 0, True, standing, (1, 7))):
        # What a tip makes of it: seen from the other end, sides go round the other way.
        tip = [0] * 8
        for turn in range(6):
            tip[place(turn)] = other(turn) if not mirrored else other(3 - turn)
        tip[end], tip[7] = ends
        turned = []
        for step in (1, -1):
            row = [0] * 8
            row[end], row[7] = end, 7
            for turn in range(6):
                row[place(turn)] = place(turn + step)
            turned.append(tuple(row))
        maps.append((tuple(tip), *turned))
    # A map belongs to the mode before the action: the tip that makes it stand is that of lying.
    (stand, *rolls), (lie, *rolls_lying) = maps
    return SharedStructure(2, (lie, *rolls, stand, *rolls_lying), PRISM_MODES)


#: Where flip, left and right lead from standing and from lying.
PRISM_MODES = ((1, 0, 0), (0, 1, 1))
PRISM = _prism().canonical()
RING_WORLD = Assumptions(4, 6, ("turn", "swap"), PatternAlphabet(("left", "right"), 5))
#: Nothing goes wrong, as far as rates allow.
NEVER = Rates(slip=1e-12, wrong=1e-12, repeat=1e-12)


@dataclass(frozen=True)
class Object:
    """What an object shows in each state, and where each action leads from each state."""

    patterns: Sequence[tuple[int, ...]]
    successors: Sequence[Sequence[int]]


def cubes(n: int, seed: int = 0) -> list[Object]:
    return [
        Object([shown_pattern(cube, orientation) for orientation in range(24)], SUCCESSORS)
        for cube in make_arcubes(n, seed)
    ]


def objects_of(structure: SharedStructure, contents: Sequence[Sequence[int]]) -> list[Object]:
    poses = structure.poses()
    in_view = poses.registers[:, : structure.n_slots]
    return [Object([tuple(row) for row in np.array(each)[in_view].tolist()], poses.successors) for each in contents]


def prisms(n: int, seed: int = 0) -> list[Object]:
    rng = np.random.default_rng(seed)
    return objects_of(PRISM, [rng.permutation(12)[:8].tolist() for _ in range(n)])


def random_objects(n: int, rng: np.random.Generator, n_states: int = 24) -> list[Object]:
    """Random ATGs: any patterns, and each action any permutation of the states."""
    patterns = ARCUBES.alphabet.patterns
    return [
        Object(
            [patterns[index] for index in rng.permutation(len(patterns))[:n_states]],
            np.stack([rng.permutation(n_states) for _ in ARCUBES.actions], axis=1),
        )
        for _ in range(n)
    ]


def trial_of(
    shown: Object,
    n_actions: int,
    rng: np.random.Generator,
    *,
    slip: float = 0.0,
    wrong: float = 0.0,
    missing: float = 0.0,
    choose: Callable[[], int] | None = None,
) -> RawTrial:
    """A trial of random actions."""
    state = int(rng.integers(len(shown.patterns)))
    n_symbols = 1 + max(max(pattern) for pattern in shown.patterns)
    choices = len(shown.successors[0])

    def look() -> Detection:
        pattern: Sequence[int] = shown.patterns[state]
        if rng.random() < wrong:
            pattern = rng.permutation(n_symbols)[: len(pattern)].tolist()
        return tuple(None if rng.random() < missing else int(symbol) for symbol in pattern)

    detections, actions = [look()], []
    for _ in range(n_actions):
        actions.append(int(rng.integers(choices)) if choose is None else choose())
        if rng.random() >= slip:
            state = int(shown.successors[state][actions[-1]])
        detections.append(look())
    return RawTrial(tuple(detections), tuple(actions))


def uncertain_object(rng: np.random.Generator, n_states: int = 8, n_successors: int = 2) -> Object:
    """An object of which each action leads to one of some states from each state, by chance."""
    patterns = [ARCUBES.alphabet.patterns[index] for index in rng.permutation(132)[:n_states]]
    return Object(patterns, rng.integers(n_states, size=(n_states, 3, n_successors)))


def uncertain_trial(shown: Object, n_actions: int, rng: np.random.Generator) -> RawTrial:
    """A trial of random actions with an object whose actions are uncertain."""
    state = int(rng.integers(len(shown.patterns)))
    looks, actions = [shown.patterns[state]], []
    for _ in range(n_actions):
        action = int(rng.integers(3))
        state = int(rng.choice(np.asarray(shown.successors)[state, action]))
        actions.append(action)
        looks.append(shown.patterns[state])
    return RawTrial(tuple(looks), tuple(actions))
