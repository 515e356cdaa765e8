"""The tables that cubes stand on: where they are before the robot, and slabs in PyBullet."""

from __future__ import annotations

from typing import Final

import pybullet

from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE

TABLE_TOP: Final = float(CUBE_CENTRE[2]) - CUBE_SIZE / 2  # m
#: Of a table, m: a wider one would be in the forearms' way.
TABLE_SIZE: Final = (0.60, 0.60)
TABLE_MIDDLE: Final = 0.50
WOOD: Final = (0.62, 0.46, 0.30, 1.0)


def slab(
    client: int,
    half_size: list[float],
    position: list[float],
    colour: tuple[float, ...],
    *,
    solid: bool = True,
) -> int:
    """Put up a box that does not move; return its body."""
    seen = pybullet.createVisualShape(
        pybullet.GEOM_BOX, halfExtents=half_size, rgbaColor=colour, physicsClientId=client
    )
    touched = -1
    if solid:
        touched = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half_size, physicsClientId=client)
    return int(pybullet.createMultiBody(0, touched, seen, position, physicsClientId=client))


def table_top(client: int, y: float = 0.0) -> int:
    """Put up the top of a table whose middle is ``y`` (m) to the left; return its body."""
    half = [TABLE_SIZE[0] / 2, TABLE_SIZE[1] / 2, 0.02]
    return slab(client, half, [TABLE_MIDDLE, y, TABLE_TOP - half[2]], WOOD)
