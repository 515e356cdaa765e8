"""Where the cube stands, from the tags that a camera sees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sim.cube_body import CUBE_CENTRE
from sim.detection import Marker
from sim.robot.plans import CubePose

#: How upright a tag's normal must be to be the top's, and how level to be a side's (cosines).
_UPRIGHT: Final = 0.85
_LEVEL: Final = 0.35


def cube_pose(markers: Sequence[Marker]) -> CubePose | None:
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
    return CubePose(np.array([*marker.cube_centre[:2], CUBE_CENTRE[2]]), float(yaw))
