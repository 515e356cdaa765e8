"""Where the cube stands, from the tags that a camera sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.senses.tags import DetectedTag
from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE

#: How upright a tag's normal must be to be the top's, and how level to be a side's (cosines).
_UPRIGHT: Final = 0.85
_LEVEL: Final = 0.35


def cube_pose(markers: Sequence[DetectedTag]) -> CubePose | None:
    """Return where the cube stands, or ``None`` if no tag shows it.

    The top tag is measured best, since the camera looks down; a side's is used if there is no other. The table's height
    is known, so the estimate's own height is not used.
    """
    tops = [marker for marker in markers if marker.normal[2] > _UPRIGHT]
    sides = [marker for marker in markers if abs(marker.normal[2]) < _LEVEL]
    if not tops and not sides:
        return None
    marker = (tops or sides)[0]
    level = marker.rotation[:, 0] if tops else marker.normal
    yaw = (np.arctan2(level[1], level[0]) + np.pi / 4) % (np.pi / 2) - np.pi / 4
    return CubePose(np.array([*marker.behind(CUBE_SIZE / 2)[:2], CUBE_CENTRE[2]]), float(yaw))


#: Off by more than this, the cube is squared.
SQUARE_ANGLE: Final = np.radians(3.0)
SQUARE_DISTANCE: Final = 0.012  # m


@dataclass(frozen=True, eq=False)
class CubePose:
    """Where a cube stands on the table.

    Attributes:
        position: Of its centre in the robot's frame, shape [3], m.
        yaw: How far its faces are turned about the vertical, −π/4 to π/4 rad.
    """

    position: FloatArray
    yaw: float

    @property
    def is_square(self) -> bool:
        """Whether the cube stands well enough at ``CUBE_CENTRE`` for the next action."""
        away = np.abs(self.position - CUBE_CENTRE)[:2].max()
        return bool(abs(self.yaw) < SQUARE_ANGLE and away < SQUARE_DISTANCE)
