"""Cubes chosen so that they are told apart in few actions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from itertools import combinations
from typing import Final, TypeAlias

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.worlds.arcube import ACTION_SOURCES, ORIENTATIONS, SUCCESSORS, Cube, canonical, shown_pattern

#: What a robot that knows all cubes takes for possible: each cube with the orientation that it would have.
_Possible: TypeAlias = frozenset[tuple[int, int]]
_DRAWS: Final = 200  # of a cube that is to be as unlike the others as can be
_SWAPS: Final = 400  # of one cube for another that is drawn, shared by the cubes
_DEPTH: Final = 6  # actions that are looked ahead; cubes not told apart by then count as told apart a step later


def expected_actions(cubes: Sequence[Cube]) -> float:
    """Return how many actions it takes at best, on average, to tell which of the cubes one is.

    All cubes and orientations are equally probable, a look shows the tags in front and on top, and no look errs.

    Raises:
        InvalidInputError: Two of the cubes are the same, turned.
    """
    if len({canonical(cube) for cube in cubes}) < len(cubes):
        raise InvalidInputError("cubes: two are the same but for how they stand; expected all different")

    def shown(state: tuple[int, int]) -> tuple[int, int]:
        return shown_pattern(cubes[state[0]], state[1])

    @cache
    def best(possible: _Possible, depth: int) -> float:
        """Return the actions that are needed, summed over the possible states."""
        if len({cube for cube, _ in possible}) < 2:
            return 0.0
        if depth == 0:
            return float(len(possible))
        totals = []
        for action in range(len(ACTION_SOURCES)):
            after = [(cube, SUCCESSORS[orientation][action]) for cube, orientation in possible]
            totals.append(len(possible) + sum(best(part, depth - 1) for part in _divided(after, shown)))
        return min(totals)

    states = [(cube, orientation) for cube in range(len(cubes)) for orientation in range(len(ORIENTATIONS))]
    return sum(best(part, _DEPTH) for part in _divided(states, shown)) / len(states) if states else 0.0


def _divided(states: Sequence[tuple[int, int]], shown: Callable[[tuple[int, int]], tuple[int, int]]) -> list[_Possible]:
    """Return the states that show the same, together."""
    groups: dict[tuple[int, int], set[tuple[int, int]]] = {}
    for state in states:
        groups.setdefault(shown(state), set()).add(state)
    return [frozenset(group) for group in groups.values()]


def make_distinct_arcubes(n: int, tags: Sequence[int], seed: int = 0) -> tuple[Cube, ...]:
    """Return ``n`` cubes with six different of the tags each, that show as few views alike as can be found.

    Where there are six tags for each cube, no tag is on two cubes, and one look tells them apart.

    Args:
        n: Number of cubes.
        tags: Numbers of the tags that there are.
        seed: Of the draws.

    Raises:
        InvalidInputError: Fewer than six tags, or more cubes than there are with them.
    """
    if len(set(tags)) != len(tags) or len(tags) < 6:
        raise InvalidInputError(f"tags of the cubes: {len(set(tags))} different ones; expected at least six")
    if n < 1:
        raise InvalidInputError(f"number of cubes: {n}; expected at least 1")
    distinct = 30 * sum(1 for _ in combinations(tags, 6)) if len(tags) <= 12 else n
    if n > distinct:
        raise InvalidInputError(f"number of cubes: {n}; expected at most {distinct}, all that {len(tags)} tags make")
    if 6 * n <= len(tags):
        return tuple(_cube(tags[6 * number : 6 * number + 6]) for number in range(n))
    rng = np.random.default_rng(seed)
    best: tuple[Cube, ...] = ()
    for _ in range(n):
        best += (_least_alike(best, tags, _DRAWS, rng),)
    least = expected_actions(best)
    # Views alike matter less where many cubes share one than where two do, so that what counts is counted from here on.
    for _ in range(_SWAPS // n):
        place = int(rng.integers(n))
        other = best[:place] + best[place + 1 :]
        swapped = (*other, _least_alike(other, tags, int(_DRAWS ** rng.random()), rng))
        if (fewer := expected_actions(swapped)) < least:
            best, least = swapped, fewer
    return best


def _drawn(others: Sequence[Cube], tags: Sequence[int], rng: np.random.Generator) -> Cube:
    """Return a cube drawn at random that is none of the others."""
    taken = {canonical(other) for other in others}
    while True:
        cube = _cube(rng.permutation(np.asarray(tags))[:6].tolist())
        if canonical(cube) not in taken:
            return cube


def _least_alike(others: Sequence[Cube], tags: Sequence[int], n_drawn: int, rng: np.random.Generator) -> Cube:
    """Return the cube, of some drawn at random, that shows the fewest views that others show."""
    return min((_drawn(others, tags, rng) for _ in range(n_drawn)), key=lambda cube: _alike(cube, others))


def _alike(cube: Cube, others: Sequence[Cube]) -> int:
    """Return how many views of the others the cube shows too."""
    views = _views(cube)
    return sum(len(views & _views(other)) for other in others)


@lru_cache(maxsize=4096)
def _views(cube: Cube) -> frozenset[tuple[int, int]]:
    return frozenset(shown_pattern(cube, orientation) for orientation in range(len(ORIENTATIONS)))


def _cube(tags: Sequence[int]) -> Cube:
    front, back, left, right, top, bottom = tags
    return front, back, left, right, top, bottom
