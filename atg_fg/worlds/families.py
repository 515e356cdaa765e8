"""Families of objects to recognise besides ARcubes: prisms, locks, boxes, random graphs; ``docs/worlds.md``."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, Final, TypeAlias

import numpy as np

from atg_fg.core.checks import MANY, number, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import Pattern, PatternAlphabet
from atg_fg.worlds.arcube import ACTION_SOURCES, BACK, FACES, FRONT, N_TAGS, ORIENTATIONS, SUCCESSORS, shown_pattern
from atg_fg.worlds.base import probability_option
from atg_fg.worlds.finite_objects import FiniteObject, Mechanism, ObjectFamily, closed_mechanism

_Draw: TypeAlias = Callable[[np.random.Generator], FiniteObject]
#: Draws in a row without a new object after which it is taken that there are no more.
_MOST_DRAWS: Final = 1000
_CUBE_ACTIONS: Final = tuple(ACTION_SOURCES)
_CUBE_ALPHABET: Final = PatternAlphabet(("front", "top"), N_TAGS)
_CUBE: Final = Mechanism.deterministic(SUCCESSORS)
_N_SIDES: Final = 6
_N_RING: Final = 3
_N_WALLS: Final = 4


def hexagonal_prisms(n_objects: int, seed: int, *, n_symbols: int = 12) -> ObjectFamily:
    """Return hexagonal prisms with different tags on their six sides and two ends; front and top are seen.

    A prism stands on an end with a side in front, or lies with an end in front and a side on top: 24 states.
    """
    whole_number(n_symbols, "n_symbols", _N_SIDES + 2)
    alphabet = PatternAlphabet(("front", "top"), n_symbols)
    states, mechanism = closed_mechanism((True, 0, 0), (_tip, partial(_roll, 1), partial(_roll, -1)))

    def draw(rng: np.random.Generator) -> FiniteObject:
        tags = rng.permutation(n_symbols)[: _N_SIDES + 2].tolist()
        sides, ends = tags[:_N_SIDES], tags[_N_SIDES:]
        shown = ((standing, sides[side], ends[end]) for standing, side, end in states)
        return FiniteObject(mechanism, tuple((side, end) if standing else (end, side) for standing, side, end in shown))

    return ObjectFamily(_CUBE_ACTIONS, alphabet, _different(n_objects, draw, _generator(seed)))


#: Whether a prism stands, the side in front (on top, if it lies), and the end on top (in front, if it lies).
#: Sides are numbered anticlockwise as seen from end 0.
_PrismState: TypeAlias = tuple[bool, int, int]


def _tip(state: _PrismState) -> _PrismState:
    """Tip a prism toward the robot, as a cube is flipped: what was on top comes to the front, the back on top."""
    standing, side, end = state
    if standing:
        return False, (side + _N_SIDES // 2) % _N_SIDES, end
    return True, side, 1 - end


def _roll(direction: int, state: _PrismState) -> _PrismState:
    """Turn a prism about its long axis, so that the side to the left (1) or right (-1) of the one shown is shown."""
    standing, side, end = state
    # Around an end on top, the left neighbour of the front comes clockwise; around an end in front, that of the top
    # comes anticlockwise. The numbers run anticlockwise around end 0, clockwise around end 1.
    anticlockwise = standing == (end == 1)
    return standing, (side + (direction if anticlockwise else -direction)) % _N_SIDES, end


def ring_locks(n_objects: int, seed: int, *, n_rings: int = 2, n_symbols: int = 12) -> ObjectFamily:
    """Return locks of two or three rings side by side with three different symbols each; one of each ring is seen.

    Two rings have 18 states, three have 81.
    """
    if n_rings not in (2, 3):
        raise InvalidInputError(f"n_rings: {n_rings!r}; expected 2 or 3")
    whole_number(n_symbols, "n_symbols", n_rings * _N_RING)
    alphabet = PatternAlphabet(("left", "right") if n_rings == 2 else ("left", "middle", "right"), n_symbols)
    start = tuple((ring, 0) for ring in range(n_rings))
    states, mechanism = closed_mechanism(start, (_swap, partial(_turn_ring, 0), partial(_turn_ring, n_rings - 1)))

    def draw(rng: np.random.Generator) -> FiniteObject:
        symbols = rng.permutation(n_symbols)[: n_rings * _N_RING].reshape(n_rings, _N_RING).tolist()
        return FiniteObject(mechanism, tuple(tuple(symbols[ring][turn] for ring, turn in state) for state in states))

    objects = _different(n_objects, draw, _generator(seed))
    return ObjectFamily(("swap", "turn-left", "turn-right"), alphabet, objects)


#: From left to right: which ring is there, and how far it is turned.
_LockState: TypeAlias = tuple[tuple[int, int], ...]


def _swap(state: _LockState) -> _LockState:
    """Take the ring on the left to the right end."""
    return (*state[1:], state[0])


def _turn_ring(place: int, state: _LockState) -> _LockState:
    """Turn the ring at a place by one symbol."""
    ring, turn = state[place]
    return (*state[:place], (ring, (turn + 1) % _N_RING), *state[place + 1 :])


def lid_boxes(n_objects: int, seed: int, *, n_symbols: int = 12) -> ObjectFamily:
    """Return boxes with tags on four walls, on a lid, and inside; front, right wall and top are seen.

    The lid comes off once and for all; then the top shows what is inside. 8 states, four with the lid on.
    """
    whole_number(n_symbols, "n_symbols", _N_WALLS + 2)
    alphabet = PatternAlphabet(("front", "right", "top"), n_symbols)
    states, mechanism = closed_mechanism((False, 0), (_open, partial(_turn_box, -1), partial(_turn_box, 1)))

    def draw(rng: np.random.Generator) -> FiniteObject:
        tags = rng.permutation(n_symbols)[: _N_WALLS + 2].tolist()
        walls, tops = tags[:_N_WALLS], tags[_N_WALLS:]
        return FiniteObject(
            mechanism, tuple((walls[front], walls[(front + 1) % _N_WALLS], tops[is_open]) for is_open, front in states)
        )

    objects = _different(n_objects, draw, _generator(seed))
    return ObjectFamily(("open", "left", "right"), alphabet, objects)


#: Whether a box is open, and the wall in front; walls are numbered anticlockwise as seen from above.
_BoxState: TypeAlias = tuple[bool, int]


def _open(state: _BoxState) -> _BoxState:
    return True, state[1]


def _turn_box(direction: int, state: _BoxState) -> _BoxState:
    """Turn a box so that the wall to the right (1) or left (-1) of the front comes to the front."""
    return state[0], (state[1] + direction) % _N_WALLS


def random_atgs(
    n_objects: int,
    seed: int,
    *,
    n_aspects: int = 24,
    n_slots: int = 2,
    n_symbols: int = 12,
    n_successors: int = 3,
    concentration: float = 1.0,
) -> ObjectFamily:
    """Return objects without any structure: random patterns, all different on an object, and random edges.

    Args:
        n_objects: How many.
        seed: Of all that is drawn.
        n_aspects: States of each object, |G|.
        n_slots: Slots of a pattern, 1 to 3.
        n_symbols: Symbols of a slot.
        n_successors: States that an action can lead to from a state; 1 makes the edges deterministic.
        concentration: Of the symmetric Dirichlet distribution that their probabilities are drawn from.
    """
    if n_slots not in (1, 2, 3):
        raise InvalidInputError(f"n_slots: {n_slots!r}; expected 1, 2 or 3")
    whole_number(n_symbols, "n_symbols", n_slots)
    alphabet = PatternAlphabet(("front", "top", "right")[:n_slots], n_symbols)
    draw = _random_atg(alphabet, n_aspects, n_successors, concentration)
    return ObjectFamily(_CUBE_ACTIONS, alphabet, _different(n_objects, draw, _generator(seed)))


def half_and_half(n_objects: int, seed: int, *, n_successors: int = 3, concentration: float = 1.0) -> ObjectFamily:
    """Return ARcubes and, for the second half, random ATGs with the same actions, alphabet and number of aspects.

    Args:
        n_objects: How many; of an odd number, one more is a cube.
        seed: Of all that is drawn.
        n_successors: As for ``random_atgs``.
        concentration: As for ``random_atgs``.
    """
    whole_number(n_objects, "n_objects", 2, MANY)
    rng = _generator(seed)
    draw = _random_atg(_CUBE_ALPHABET, len(ORIENTATIONS), n_successors, concentration)
    n_random = n_objects // 2
    cubes = _different(n_objects - n_random, _draw_cube, rng)
    return ObjectFamily(_CUBE_ACTIONS, _CUBE_ALPHABET, cubes + _different(n_random, draw, rng))


def mixed_kinds(
    n_objects: int, seed: int, *, cubes: float = 1 / 3, prisms: float = 1 / 3, locks: float = 1 / 3
) -> ObjectFamily:
    """Return ARcubes, then hexagonal prisms, then ring locks, with one alphabet and the same actions.

    Args:
        n_objects: How many.
        seed: Of all that is drawn.
        cubes: Share of the cubes, in proportion to the others'; of a rest, the first kinds have one more.
        prisms: Share of the prisms.
        locks: Share of the locks.

    Raises:
        InvalidInputError: A share that is no probability, or all of them are zero.
    """
    whole_number(n_objects, "n_objects", 1, MANY)
    named = {"cubes": cubes, "prisms": prisms, "locks": locks}
    shares = [probability_option(name, share) for name, share in named.items()]
    if not sum(shares) > 0:
        raise InvalidInputError("cubes, prisms, locks: all 0; expected a share of one kind at least")
    exact = [n_objects * share / sum(shares) for share in shares]
    counts = [math.floor(each + 1e-9) for each in exact]
    rest = sorted(range(len(counts)), key=lambda kind: counts[kind] - exact[kind] - 1e-9 * (len(counts) - kind))
    for kind in rest[: n_objects - sum(counts)]:
        counts[kind] += 1
    rng = _generator(seed)
    objects = _different(counts[0], _draw_cube, rng)
    for family, n_of_kind in ((hexagonal_prisms, counts[1]), (ring_locks, counts[2])):
        own_seed = int(rng.integers(2**63))
        if n_of_kind:
            objects += family(n_of_kind, own_seed, n_symbols=N_TAGS).objects
    return ObjectFamily(_CUBE_ACTIONS, _CUBE_ALPHABET, objects)


def cubes_with_repeated_tags(n_objects: int, seed: int, *, share: float = 1 / 3) -> ObjectFamily:
    """Return ARcubes, a share of which has one tag twice, on two opposite faces.

    Front and top are never opposite, so no pattern has a symbol twice. Such a cube shows 16 patterns in its 24 states.

    Args:
        n_objects: How many.
        seed: Of all that is drawn.
        share: Of the objects, the first ones, rounded to a whole number of them.
    """
    whole_number(n_objects, "n_objects", 1, MANY)
    n_repeating = round(probability_option("share", share) * n_objects)
    rng = _generator(seed)
    repeating = _different(n_repeating, partial(_draw_cube, repeating=True), rng)
    return ObjectFamily(_CUBE_ACTIONS, _CUBE_ALPHABET, repeating + _different(n_objects - n_repeating, _draw_cube, rng))


def _draw_cube(rng: np.random.Generator, *, repeating: bool = False) -> FiniteObject:
    tags = rng.permutation(N_TAGS)[: len(FACES)].tolist()
    if repeating:  # which two opposite faces it is makes no difference to a cube that is turned over anyway
        tags[BACK] = tags[FRONT]
    a, b, c, d, e, f = tags
    cube = (a, b, c, d, e, f)
    return FiniteObject(_CUBE, tuple(shown_pattern(cube, orientation) for orientation in range(len(ORIENTATIONS))))


def _random_atg(alphabet: PatternAlphabet, n_aspects: int, n_successors: int, concentration: float) -> _Draw:
    """Return what draws a random ATG, once its options are checked."""
    whole_number(n_aspects, "n_aspects", 1, len(alphabet))
    whole_number(n_successors, "n_successors", 1, n_aspects)
    # Beyond these bounds the draws are no longer numbers.
    number(concentration, "concentration", least=1e-6, most=1e6)
    shape = (n_aspects, len(_CUBE_ACTIONS))

    def draw(rng: np.random.Generator) -> FiniteObject:
        shown = rng.permutation(len(alphabet))[:n_aspects].tolist()
        patterns: tuple[Pattern, ...] = tuple(alphabet.patterns[index] for index in shown)
        states = np.broadcast_to(np.arange(n_aspects), (*shape, n_aspects))
        successors = rng.permuted(states, axis=-1)[..., :n_successors].astype(np.int64)
        probabilities = rng.dirichlet(np.full(n_successors, concentration), size=shape)
        # A single one is to have probability 1, not nearly so.
        probabilities /= probabilities.sum(axis=-1, keepdims=True)
        return FiniteObject(Mechanism(successors, probabilities), patterns)

    return draw


def _different(n: int, draw: _Draw, rng: np.random.Generator) -> tuple[FiniteObject, ...]:
    """Draw ``n`` objects, no two of which look the same however they are acted on."""
    whole_number(n, "n_objects", 0, MANY)
    objects: dict[Any, FiniteObject] = {}
    in_vain = 0
    while len(objects) < n:
        drawn = draw(rng)
        in_vain = in_vain + 1 if drawn.appearance in objects else 0
        objects.setdefault(drawn.appearance, drawn)
        if in_vain == _MOST_DRAWS:
            raise InvalidInputError(
                f"n_objects: {n}; expected fewer, or more symbols: found only {len(objects)} different ones"
            )
    return tuple(objects.values())


def _generator(seed: int) -> np.random.Generator:
    whole_number(seed, "objects_seed", 0)
    return np.random.default_rng(seed)


#: Families by the name of their world.
FAMILIES: Final[dict[str, Callable[..., ObjectFamily]]] = {
    "prism": hexagonal_prisms,
    "lock": ring_locks,
    "lid-box": lid_boxes,
    "random-atg": random_atgs,
    "half-and-half": half_and_half,
    "mixed": mixed_kinds,
    "repeated-tags": cubes_with_repeated_tags,
}
