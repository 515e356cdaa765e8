"""ARcubes as permutations: six tags on six faces, 24 orientations, three actions (section 5)."""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np

from atg_fg.core.checks import whole_number
from atg_fg.core.patterns import FloatArray

FACES: Final = ("front", "back", "left", "right", "top", "bottom")
FRONT, BACK, LEFT, RIGHT, TOP, BOTTOM = range(6)
N_TAGS: Final = 12
#: Tags on the faces of a cube, in the order of ``FACES``, as it stands in orientation 0.
Cube: TypeAlias = tuple[int, int, int, int, int, int]
#: ``orientation[place]`` is the face of the cube that is now at that place.
Orientation: TypeAlias = tuple[int, int, int, int, int, int]

#: After the action, each place holds the face that stood at this place before.
ACTION_SOURCES: Final[dict[str, Orientation]] = {
    "flip": (TOP, BOTTOM, LEFT, RIGHT, BACK, FRONT),
    "left": (LEFT, RIGHT, BACK, FRONT, TOP, BOTTOM),
    "right": (RIGHT, LEFT, FRONT, BACK, TOP, BOTTOM),
}


def _turn(orientation: Orientation, sources: Orientation) -> Orientation:
    a, b, c, d, e, f = (orientation[source] for source in sources)
    return (a, b, c, d, e, f)


def _closure() -> tuple[tuple[Orientation, ...], tuple[tuple[int, ...], ...]]:
    """Orientations reached from upright by any actions, and where each action leads from each."""
    orientations: list[Orientation] = [(FRONT, BACK, LEFT, RIGHT, TOP, BOTTOM)]
    successors: list[tuple[int, ...]] = []
    for orientation in orientations:  # grows while it is walked: breadth first
        row = []
        for sources in ACTION_SOURCES.values():
            turned = _turn(orientation, sources)
            if turned not in orientations:
                orientations.append(turned)
            row.append(orientations.index(turned))
        successors.append(tuple(row))
    return tuple(orientations), tuple(successors)


#: All 24 orientations, and ``SUCCESSORS[orientation][action]``, the orientation an action leads to.
ORIENTATIONS, SUCCESSORS = _closure()

#: Outward normal of each face in the order of ``FACES`` (x away from the robot, y to its left, z up), shape [6, 3].
FACE_NORMALS: Final[FloatArray] = np.array(
    [[-1, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64
)


def rotation_of(orientation: int) -> FloatArray:
    """Return the rotation matrix from the cube's frame to the world's in one of the 24 orientations, shape [3, 3]."""
    faces = ORIENTATIONS[orientation]
    # The face now at a place has its normal where that place points; three places make a basis.
    return np.asarray(sum(np.outer(FACE_NORMALS[place], FACE_NORMALS[faces[place]]) for place in (BACK, LEFT, TOP)))


#: How each action turns the cube.
ACTION_ROTATIONS: Final[dict[str, FloatArray]] = {
    name: rotation_of(successor) for name, successor in zip(ACTION_SOURCES, SUCCESSORS[0], strict=True)
}


def shown_pattern(cube: Cube, orientation: int) -> tuple[int, int]:
    """Return the tags (front, top) that a cube shows in an orientation."""
    faces = ORIENTATIONS[orientation]
    return cube[faces[FRONT]], cube[faces[TOP]]


def canonical(cube: Cube) -> Cube:
    """Return the same cube turned so that its tags come first in lexicographic order."""
    return min(_turn(cube, orientation) for orientation in ORIENTATIONS)


def make_arcubes(n: int, seed: int) -> tuple[Cube, ...]:
    """Return ``n`` cubes with six different tags each, no two the same up to rotation.

    Raises:
        InvalidInputError: ``n`` is negative or more than the 27,720 cubes there are.
    """
    n_distinct = 12 * 11 * 10 * 9 * 8 * 7 // len(ORIENTATIONS)
    n = whole_number(n, "number of ARcubes, of which all are distinct", 0, n_distinct)
    rng = np.random.default_rng(seed)
    cubes: dict[Cube, Cube] = {}
    while len(cubes) < n:
        a, b, c, d, e, f = rng.permutation(N_TAGS)[: len(FACES)].tolist()
        cube: Cube = (a, b, c, d, e, f)
        cubes.setdefault(canonical(cube), cube)
    return tuple(cubes.values())
