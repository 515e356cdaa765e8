"""The kinematic table: facts of NASA's Robonaut 2 that the robot's description is generated from.

Frame: x forward, y to the robot's left, z up, origin on the waist's axis; metres, radians, kilograms, newton metres.
At joint angle zero the left arm is stretched sideways along ``ARM_AXIS``; the right arm is its mirror image.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np

from atg_fg.core.patterns import FloatArray

Side: TypeAlias = Literal["left", "right"]
SIDES: Final[tuple[Side, Side]] = ("left", "right")
_SWEEP: Final = np.radians(15)  # the shoulders point a little forward
ARM_AXIS: Final[FloatArray] = np.array([np.sin(_SWEEP), np.cos(_SWEEP), 0.0])
ELBOW_AXIS: Final[FloatArray] = np.array([np.cos(_SWEEP), -np.sin(_SWEEP), 0.0])
_DOWN: Final[FloatArray] = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True, eq=False)
class Joint:
    """One revolute joint and the link that it moves, at joint angle zero.

    Attributes:
        name: As in NASA's description.
        position: Of the joint in the robot's frame, shape [3], m.
        axis: Unit vector in the robot's frame, shape [3].
        lower: Least angle, rad.
        upper: Greatest angle, rad.
        velocity: Greatest speed, rad/s.
        effort: Greatest torque, N·m.
        mass: Of the link, kg.
        rotor_inertia: Of the motor's rotor, seen through its gear, kg·m².
    """

    name: str
    position: FloatArray
    axis: FloatArray
    lower: float
    upper: float
    velocity: float
    effort: float
    mass: float
    rotor_inertia: float = 0.2


# name; along the arm's axis, along the elbow's axis, up (m); axis; limits; speed; effort; mass of the link; rotor.
# Lengths, limits, efforts and masses to the forearm are NASA's. Speeds, rotors and the masses from the wrist on are set
# to what an arm of this size has: the description has token values there, or none.
_LEFT_ARM: Final = (
    ("joint0", 0.000, 0.000, 0.000, ARM_AXIS, -2.827, 2.827, 2.5, 100.0, 7.1, 0.20),  # shoulder roll
    ("joint1", 0.210, 0.047, 0.000, ELBOW_AXIS, -1.676, 0.429, 2.5, 100.0, 4.7, 0.20),  # shoulder pitch
    ("joint2", 0.379, 0.000, 0.000, ARM_AXIS, -4.503, -0.332, 2.5, 100.0, 4.9, 0.20),  # upper-arm roll
    ("joint3", 0.564, -0.032, -0.053, ELBOW_AXIS, -2.793, 0.000, 2.5, 100.0, 2.3, 0.10),  # elbow
    ("joint4", 0.619, 0.000, 0.000, ARM_AXIS, -1.536, 4.677, 3.5, 100.0, 8.2, 0.05),  # forearm roll
    ("wrist/pitch", 0.920, 0.000, 0.000, ELBOW_AXIS, -0.800, 0.800, 3.5, 100.0, 0.3, 0.03),
    ("wrist/yaw", 0.927, 0.000, 0.000, _DOWN, -0.750, 0.150, 3.5, 100.0, 1.2, 0.03),
)

_SHOULDER: Final[FloatArray] = np.array([-0.0255, 0.0944, 0.5443])
#: From the wrist's yaw joint to the middle of the rubber pad on the knuckles, m.
PAD_OFFSET: Final = 0.085
PAD_RADIUS: Final = 0.05  # m
WAIST: Final = Joint("r2/waist/joint0", np.zeros(3), np.array([0.0, 0.0, 1.0]), -3.14, 3.14, 1.0, 500.0, 30.0)

NECK: Final = (
    Joint("r2/neck/joint0", np.array([-0.08, 0.0, 0.64]), np.array([0.0, -1.0, 0.0]), -0.70, 0.175, 1.5, 40.0, 1.0),
    Joint("r2/neck/joint1", np.array([-0.08, 0.0, 0.68]), np.array([0.0, 0.0, 1.0]), -1.22, 1.22, 1.5, 40.0, 1.0),
    Joint("r2/neck/joint2", np.array([-0.08, 0.0, 0.72]), np.array([0.0, -1.0, 0.0]), -0.70, 0.175, 1.5, 40.0, 4.0),
)

N_ARM_JOINTS: Final = len(_LEFT_ARM)


def mirrored(vector: FloatArray, side: Side) -> FloatArray:
    """Return a vector of the left side as it is on ``side``."""
    return vector if side == "left" else vector * [1.0, -1.0, 1.0]


def arm(side: Side) -> tuple[Joint, ...]:
    """Return the seven joints of an arm, from the shoulder to the wrist.

    The right arm's axes are mirrored as rotations are, so that equal angles give mirror-image postures.
    """
    handed = np.ones(3) if side == "left" else np.array([-1.0, 1.0, -1.0])
    return tuple(
        Joint(
            f"r2/{side}_arm/{name}",
            mirrored(_SHOULDER + along * ARM_AXIS + across * ELBOW_AXIS + [0.0, 0.0, up], side),
            np.asarray(axis * handed),
            *limits,
        )
        for name, along, across, up, axis, *limits in _LEFT_ARM
    )


def arm_joint_names(side: Side) -> tuple[str, ...]:
    """Return the names of an arm's joints, from the shoulder to the wrist."""
    return tuple(joint.name for joint in arm(side))
