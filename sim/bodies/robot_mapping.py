"""Which joints of a description are the arms, and how its hands point: all that a robot needs to be known by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from sim.bodies.robonaut_joints import ARM_AXIS, NECK, SIDES, WAIST, arm, arm_joint_names, mirrored
from sim.bodies.robonaut_shapes import EYE

#: Where the middle between the shoulders stands in the robot's frame if nothing is said, m: Robonaut's.
SHOULDERS: Final = np.array([-0.0255, 0.0, 0.5443])
#: Leant back, looking down at the table, rad; NASA's as far back as it goes, to see past its chin.
_NECK_POSTURE: Final = (0.10, 0.0, -0.65)
_NASA_NECK_POSTURE: Final = (0.175, 0.0, -0.65)
#: Bent, they make a fist.
_FINGERS: Final = ("r2/*_arm/hand/*/proximal", "r2/*_arm/hand/*/medial", "r2/*_arm/hand/ringlittle/*")
#: NASA's trunk is deeper than the shell's, so it stands further back, m.
_NASA_PLACE: Final = np.array([-0.08, 0.0, 0.0])
#: On NASA's forehead, m: its own cameras, 6 cm further ahead, look too slantwise at the cube's front.
_FOREHEAD: Final = np.array([0.004, 0.0, 0.913])


@dataclass(frozen=True, eq=False)
class RobotMapping:
    """What is what in a description; sides are left before right, joints from the shoulder to the wrist.

    Attributes:
        arms: Names of the joints of each arm.
        forward: Unit vector out of each hand, to the face that it presses, shape [2, 3].
        palm: Unit vector normal to each palm, shape [2, 3].
        name: Of the robot, for people.
        hands: Names of the links in whose frames these vectors are; without them it is the robot's frame at joint
            angles zero.
        waist: Name of the joint that the trunk turns about, if it has one: its axis is upright.
        held: Positions of other joints, by patterns of their names as shells have them; all others stay at zero.
        shoulders: Where the middle between both arms' first joints stands in the robot's frame, shape [3], m.
        velocity: Greatest speed of each joint, where the file has no lower one, shape [joints], rad/s.
        effort: Greatest torque of each joint, where the file has no lower one, shape [joints], N·m.
        rotor_inertia: Least moment of inertia of each link: its motor's rotor, seen through the gear, shape [joints],
            kg·m².
        eye: Where the camera is in the robot's frame, shape [3], m; it looks at the cube.
    """

    arms: tuple[tuple[str, ...], tuple[str, ...]]
    forward: FloatArray
    palm: FloatArray
    name: str = "a robot with two arms"
    hands: tuple[str, str] | None = None
    waist: str | None = None
    held: Mapping[str, float] = field(default_factory=dict)
    shoulders: FloatArray = field(default_factory=lambda: SHOULDERS)
    velocity: FloatArray = field(default_factory=lambda: np.array([np.inf] * 7))
    effort: FloatArray = field(default_factory=lambda: np.array([np.inf] * 7))
    rotor_inertia: FloatArray = field(default_factory=lambda: np.array([0.03] * 7))
    eye: FloatArray = field(default_factory=lambda: EYE)

    @property
    def moved(self) -> tuple[str, ...]:
        """Names of the joints that stay joints; all others are held."""
        return (*self.arms[0], *self.arms[1])

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the joints that must be there."""
        return self.moved if self.waist is None else (self.waist, *self.moved)


def nasa_mapping() -> RobotMapping:
    """Return the mapping of NASA's own descriptions of Robonaut 2."""
    return replace(
        shell_mapping(),
        held={**shell_mapping().held, **_neck(_NASA_NECK_POSTURE)},
        shoulders=SHOULDERS + _NASA_PLACE,
        eye=_FOREHEAD,
    )


def shell_mapping() -> RobotMapping:
    """Return the mapping of the shell, which has the joint names of NASA's Robonaut 2."""
    joints = arm("left")
    return RobotMapping(
        arms=(arm_joint_names("left"), arm_joint_names("right")),
        forward=np.array([mirrored(ARM_AXIS, side) for side in SIDES]),
        palm=np.array([[0.0, 0.0, -1.0]] * 2),
        name="NASA's Robonaut 2",
        waist=WAIST.name,
        held={**_neck(_NECK_POSTURE), **dict.fromkeys(_FINGERS, 1.5)},
        velocity=np.array([joint.velocity for joint in joints]),
        effort=np.array([joint.effort for joint in joints]),
        rotor_inertia=np.array([joint.rotor_inertia for joint in joints]),
    )


def _neck(posture: tuple[float, ...]) -> dict[str, float]:
    return {joint.name: angle for joint, angle in zip(NECK, posture, strict=True)}
