"""What the robot looks like and what of it can be touched: shapes of every link, at joint angle zero.

White shell, grey joints, gold visor; fists whose knuckles carry a round rubber pad, the only part meant to touch the
cube. Positions are in the robot's frame at joint angle zero, metres, as in ``sim.bodies.robonaut_joints``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np

from atg_fg.core.patterns import FloatArray
from sim.bodies.robonaut_joints import ARM_AXIS, ELBOW_AXIS, NECK, PAD_OFFSET, PAD_RADIUS, Side, arm, mirrored

Kind: TypeAlias = Literal["capsule", "ball", "rounded"]
WHITE: Final = "0.93 0.93 0.92 1"
GREY: Final = "0.36 0.37 0.40 1"
DARK: Final = "0.16 0.17 0.19 1"
GOLD: Final = "0.86 0.66 0.17 1"
#: Where the camera's eye is, m.
EYE: Final = np.array([0.053, 0.0, 0.838])


@dataclass(frozen=True, eq=False)
class Shape:
    """A part of a link.

    Attributes:
        kind: ``capsule`` from ``start`` to ``end``; ``ball`` (an ellipsoid) and ``rounded`` (a box with round edges)
            about ``start``.
        start: Shape [3], m.
        end: Shape [3], m; the middle's frame is the robot's unless a capsule says otherwise.
        size: Half the extents, shape [3], m; a capsule's radius thrice.
        colour: Red, green, blue, opacity.
        solid: Whether it can be touched.
        visible: Whether it is drawn.
    """

    kind: Kind
    start: FloatArray
    end: FloatArray
    size: FloatArray
    colour: str = WHITE
    solid: bool = False
    visible: bool = True


def capsule(
    start: FloatArray, end: FloatArray, radius: float, colour: str = WHITE, *, solid: bool = False, visible: bool = True
) -> Shape:
    """Return a cylinder with round ends; its whole length is from ``start`` to ``end``."""
    return Shape("capsule", start, end, np.full(3, radius), colour, solid, visible)


def ball(centre: FloatArray, size: FloatArray | float, colour: str, *, solid: bool = False) -> Shape:
    """Return an ellipsoid with half axes ``size`` along x, y and z."""
    return Shape("ball", centre, centre, np.broadcast_to(size, 3), colour, solid)


def rounded(centre: FloatArray, size: FloatArray, colour: str, *, solid: bool = False) -> Shape:
    """Return a box with round edges and half extents ``size`` along x, y and z."""
    return Shape("rounded", centre, centre, size, colour, solid)


def pedestal_shapes() -> list[Shape]:
    """Return the base: a column under the waist."""
    return [
        capsule(np.array([-0.04, 0, -0.46]), np.array([-0.04, 0, 0.10]), 0.085, GREY),
        rounded(np.array([-0.04, 0, -0.46]), np.array([0.24, 0.22, 0.035]), DARK),
    ]


def torso_shapes() -> list[Shape]:
    """Return the torso: chest, waist, backpack, shoulders' roots and collar."""
    return [
        rounded(np.array([-0.07, 0, 0.20]), np.array([0.095, 0.115, 0.15]), GREY),
        rounded(np.array([-0.06, 0, 0.43]), np.array([0.125, 0.175, 0.165]), WHITE),
        rounded(np.array([0.045, 0, 0.46]), np.array([0.035, 0.10, 0.07]), GREY),
        rounded(np.array([-0.23, 0, 0.40]), np.array([0.085, 0.15, 0.19]), WHITE),
        capsule(np.array([-0.08, 0, 0.56]), np.array([-0.08, 0, 0.66]), 0.055, DARK),
        # What the arms must not hit, simpler than what is seen.
        capsule(np.array([-0.08, 0, 0.0]), np.array([-0.08, 0, 0.60]), 0.13, solid=True, visible=False),
    ]


def neck_shapes(joint: int) -> list[Shape]:
    """Return what hangs on a joint of the neck; the last one carries the head."""
    at = NECK[joint].position
    if joint < 2:
        return [ball(at, 0.045, GREY)]
    sideways = np.array([0.0, 1.0, 0.0])
    crown, face = at + np.array([-0.035, 0.0, 0.14]), at + np.array([0.016, 0.0, 0.143])
    return [
        capsule(at - 0.07 * sideways, at + 0.07 * sideways, 0.035, GREY),
        ball(crown, np.array([0.115, 0.098, 0.125]), WHITE, solid=True),
        ball(face, np.array([0.078, 0.086, 0.072]), GOLD),
        *(ball(crown + side * 0.09 * sideways, np.array([0.035, 0.020, 0.035]), GREY) for side in (1, -1)),
    ]


def arm_shapes(side: Side) -> list[list[Shape]]:
    """Return the shapes of each of an arm's seven links, from the shoulder to the hand."""
    joints = arm(side)
    at = [joint.position for joint in joints]
    along, across = mirrored(ARM_AXIS, side), mirrored(ELBOW_AXIS, side)
    return [
        [capsule(at[0] - 0.05 * along, at[0] + 0.16 * along, 0.068, WHITE), ball(at[0], 0.082, GREY)],
        [capsule(at[1] - 0.09 * across, at[1] + 0.05 * across, 0.058, GREY), ball(at[1] - 0.03 * across, 0.078, WHITE)],
        [
            capsule(at[2] - 0.08 * along, at[2] + 0.15 * along, 0.060, WHITE, solid=True),
            ball(at[2] - 0.06 * along, 0.064, GREY),
        ],
        [capsule(at[3] - 0.07 * across, at[3] + 0.09 * across, 0.050, GREY), ball(at[3], 0.056, WHITE)],
        [
            capsule(at[4] - 0.06 * along, at[4] + 0.27 * along, 0.050, WHITE, solid=True),
            capsule(at[4] + 0.18 * along, at[4] + 0.255 * along, 0.052, DARK),
        ],
        [ball(at[5], 0.036, GREY)],
        _fist(at[6], along, across, side),
    ]


def _fist(wrist: FloatArray, along: FloatArray, across: FloatArray, side: Side) -> list[Shape]:
    """Return a hand closed to a fist, with the rubber pad on its knuckles."""
    down = np.array([0.0, 0.0, -1.0])
    pad = wrist + PAD_OFFSET * along
    shapes = [
        capsule(wrist - 0.02 * along, wrist + 0.035 * along, 0.031, GREY),
        capsule(wrist + 0.03 * along - 0.03 * across, wrist + 0.03 * along + 0.03 * across, 0.030, WHITE),
        Shape("ball", pad, pad, np.full(3, PAD_RADIUS), GOLD, solid=True, visible=False),
        ball(pad + 0.026 * along, 0.0245, GOLD),
    ]
    for finger in range(4):
        # Knuckle, then the finger bent into the palm.
        root = wrist + 0.062 * along + (0.036 - 0.024 * finger) * across
        knuckle = root + 0.034 * along - 0.008 * down
        shapes += [
            capsule(root - 0.02 * along - 0.008 * down, knuckle, 0.0125, WHITE),
            capsule(knuckle, knuckle + 0.036 * down, 0.0125, GREY),
            capsule(knuckle + 0.036 * down, root + 0.030 * down, 0.012, DARK),
        ]
    thumb = wrist + 0.030 * along + 0.046 * across
    tip = wrist + 0.082 * along + 0.030 * across + 0.040 * down
    shapes.append(capsule(thumb, tip, 0.0125, WHITE))
    return shapes
