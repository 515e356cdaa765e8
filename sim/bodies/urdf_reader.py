"""A robot's description read from a URDF file: where its joints are, and whether they are those the arms need."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from sim.bodies.kinematics import ArmKinematics
from sim.bodies.robonaut_joints import NECK, SIDES, WAIST, arm_joint_names

REQUIRED_JOINTS: Final = (
    WAIST.name,
    *(joint.name for joint in NECK),
    *(name for side in SIDES for name in arm_joint_names(side)),
)


@dataclass(frozen=True, eq=False)
class JointFrame:
    """A joint at joint angle zero.

    Attributes:
        position: Shape [3], m.
        rotation: Of the link that it moves, shape [3, 3].
        axis: Unit vector, shape [3].
        lower: Least angle, rad.
        upper: Greatest angle, rad.
    """

    position: FloatArray
    rotation: FloatArray
    axis: FloatArray
    lower: float
    upper: float

    def seen_from(self, origin: FloatArray, turn: FloatArray) -> JointFrame:
        """Return the joint in a frame at ``origin`` that ``turn`` (shape [3, 3]) takes to this one's."""
        position, rotation, axis = turn.T @ (self.position - origin), turn.T @ self.rotation, turn.T @ self.axis
        return JointFrame(position, rotation, axis, self.lower, self.upper)


@dataclass(frozen=True, eq=False)
class Description:
    """What the arms and the head need of a robot's description, in the robot's frame (``sim.bodies.robonaut_joints``).

    Attributes:
        path: The URDF file.
        names: The name in the file of each required joint.
        joints: Each required joint.
        base_position: Of the file's root frame, shape [3], m.
        base_rotation: Of the file's root frame, shape [3, 3].
    """

    path: Path
    names: Mapping[str, str]
    joints: Mapping[str, JointFrame]
    base_position: FloatArray
    base_rotation: FloatArray

    def kinematics(self) -> ArmKinematics:
        """Return the kinematics of both arms."""
        arms = [[self.joints[name] for name in arm_joint_names(side)] for side in SIDES]
        return ArmKinematics(
            np.array([[joint.position for joint in joints] for joints in arms]),
            np.array([[joint.axis for joint in joints] for joints in arms]),
            np.array([[joint.lower for joint in joints] for joints in arms]),
            np.array([[joint.upper for joint in joints] for joints in arms]),
        )


def read_description(path: Path) -> Description:
    """Read a URDF file whose joints have the names of NASA's Robonaut 2 (a leading slash does not matter).

    The robot is stood upright by its waist's axis and its shoulders, however the file has it lie.

    Raises:
        InvalidInputError: The file cannot be read, is not URDF, or lacks a joint that is needed.
    """
    try:
        robot = ElementTree.parse(path).getroot()
    except (OSError, LookupError, ElementTree.ParseError) as error:
        raise InvalidInputError(f"{path}: cannot be read as URDF: {error}; expected a robot's description") from error
    found = {joint.get("name", "").lstrip("/"): joint for joint in robot.iter("joint")}
    missing = [name for name in REQUIRED_JOINTS if name not in found]
    if missing:
        raise InvalidInputError(
            f"{path}: has no joint {', '.join(missing)}; expected the joint names of NASA's Robonaut 2"
        )
    try:
        parents = _parents(robot)
        frames = {name: _frame(found[name], parents) for name in REQUIRED_JOINTS}
        return _stood_upright(path, frames, {name: found[name].get("name", "") for name in REQUIRED_JOINTS})
    except ValueError as error:
        raise InvalidInputError(f"{path}: {error}; expected a robot's description in URDF") from error


def _stood_upright(path: Path, frames: Mapping[str, JointFrame], names: Mapping[str, str]) -> Description:
    """Return the description in the robot's frame: waist at the origin and upright, left shoulder to the left."""
    waist = frames[WAIST.name]
    left, right = (frames[arm_joint_names(side)[0]].position for side in SIDES)
    leftwards = (left - right) - waist.axis * ((left - right) @ waist.axis)
    if not np.linalg.norm(leftwards) > 0.01:
        raise ValueError("its shoulders are not beside each other")
    leftwards = leftwards / np.linalg.norm(leftwards)
    upright = np.column_stack([np.cross(leftwards, waist.axis), leftwards, waist.axis])
    joints = {name: frame.seen_from(waist.position, upright) for name, frame in frames.items()}
    return Description(path, names, joints, -upright.T @ waist.position, upright.T)


def _parents(robot: ElementTree.Element) -> dict[str, ElementTree.Element]:
    """Return the joint above each link; PyBullet does not survive files that are no tree."""
    joints = [joint for joint in robot.iter("joint") if joint.find("child") is not None]
    parents = {_link(joint, "child"): joint for joint in joints}
    names = [joint.get("name", "") for joint in joints]
    if len(parents) < len(joints) or len(set(names)) < len(names):
        raise ValueError("a joint or a link is there twice")
    roots = {link.get("name", "") for link in robot.iter("link")} - parents.keys()
    if len(roots) != 1:
        raise ValueError(f"it has {len(roots)} root links, not one")
    return parents


def _frame(joint: ElementTree.Element, parents: Mapping[str, ElementTree.Element]) -> JointFrame:
    """Return a joint in the frame of the file's root, by following its parents."""
    position, rotation = np.zeros(3), np.eye(3)
    chain = [joint]
    while (above := parents.get(_link(chain[-1], "parent"))) is not None:
        if len(chain) > len(parents):
            raise ValueError("its joints go round in a circle")
        chain.append(above)
    for element in reversed(chain):
        origin = element.find("origin")
        offset, angles = (origin.get("xyz"), origin.get("rpy")) if origin is not None else (None, None)
        position = position + rotation @ _vector(offset, "0 0 0")
        rotation = rotation @ _rotation(_vector(angles, "0 0 0"))
    return JointFrame(position, rotation, rotation @ _axis(joint), *_limits(joint))


def _axis(joint: ElementTree.Element) -> FloatArray:
    """Return a joint's axis in its own frame, a unit vector."""
    element = joint.find("axis")
    axis = _vector(element.get("xyz") if element is not None else None, "1 0 0")
    length = float(np.linalg.norm(axis))
    if not length > 0:
        raise ValueError(f"joint {joint.get('name')} has no direction")
    return axis / length


def _limits(joint: ElementTree.Element) -> tuple[float, float]:
    """Return the least and the greatest angle of a joint that turns."""
    limit = joint.find("limit")
    if joint.get("type") != "revolute" or limit is None:
        raise ValueError(f"joint {joint.get('name')} is not revolute with a limit")
    lower, upper = (float(limit.get(end, "nan")) for end in ("lower", "upper"))
    if not -np.inf < lower < upper < np.inf:
        raise ValueError(f"joint {joint.get('name')} is limited to {lower} to {upper}")
    return lower, upper


def _link(joint: ElementTree.Element, end: str) -> str:
    element = joint.find(end)
    if element is None:
        raise ValueError(f"joint {joint.get('name')} has no {end}")
    return element.get("link", "")


def _vector(text: str | None, default: str) -> FloatArray:
    values = np.array([float(value) for value in (text or default).split()])
    if values.shape != (3,) or not np.isfinite(values).all():
        raise ValueError(f"{text!r} is not three finite numbers")
    return values


def _rotation(angles: FloatArray) -> FloatArray:
    """Return the rotation of roll, pitch and yaw about fixed axes, shape [3, 3]."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles), np.cos(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
