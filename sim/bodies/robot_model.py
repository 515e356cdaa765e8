"""A robot made ready for PyBullet from any description: upright, only the joints that are used, all else held.

Whatever the file looks like, what is loaded has one form: a base at the robot's origin, with trunk and head; the arms
hung on it; every link's frame parallel to the robot's when all joints are at zero; one link for all that a joint
carries. So PyBullet's limit of 128 joints is not met, shapes that overlap in a hand or in the trunk are parts of one
link, and a closed hand stays closed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import pairwise
from typing import Final
from xml.etree import ElementTree

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from sim.bodies.robot_mapping import RobotMapping
from sim.bodies.urdf_reader import Link, Piece, UrdfJoint, UrdfTree, numbers

BASE: Final = "base"
_LEAST_MASS: Final = 0.3  # kg
_LEAST_WIDTH: Final = 0.01  # m between the shoulders
#: An angle that a joint without limits may have, rad.
_UNLIMITED: Final = 2 * np.pi


@dataclass(frozen=True, eq=False)
class JointFrame:
    """A joint in the robot's frame when all are at zero.

    Attributes:
        name: In the file.
        parent: Name of the joint above it; ``base`` if there is none.
        position: Shape [3], m.
        axis: Unit vector, shape [3].
        lower: Least angle, rad.
        upper: Greatest angle, rad.
        velocity: Greatest speed, rad/s.
        effort: Greatest torque, N·m.
        link: What it carries, in a frame at the joint that is parallel to the robot's.
    """

    name: str
    parent: str
    position: FloatArray
    axis: FloatArray
    lower: float
    upper: float
    velocity: float
    effort: float
    link: Link


@dataclass(frozen=True, eq=False)
class RobotModel:
    """A description in the one form that is loaded.

    Attributes:
        base: What hangs on no joint that moves, in the robot's frame.
        joints: By name, those above before those below.
        mapping: What is what among them; the hands' vectors in the robot's frame at joint angles zero.
        notes: What was changed of the file's own.
    """

    base: Link
    joints: Mapping[str, JointFrame]
    mapping: RobotMapping
    notes: tuple[str, ...] = ()


def fitted(tree: UrdfTree, mapping: RobotMapping) -> RobotModel:
    """Return a description in the form that is loaded.

    Raises:
        InvalidInputError: What the mapping names is missing, or is none that a robot with two arms can have.
    """
    missing = [name for name in mapping.named if name not in tree.joints]
    if missing:
        raise InvalidInputError(
            f"{tree.path}: has no joint {', '.join(missing)}; expected the joint names of {mapping.name}"
        )
    try:
        return _Fitting(tree, mapping).model()
    except ValueError as error:
        raise InvalidInputError(f"{tree.path}: {error}; expected a robot with two arms") from error


class _Fitting:
    """The work of ``fitted``: one walk through the tree, and what follows from it."""

    def __init__(self, tree: UrdfTree, mapping: RobotMapping) -> None:
        self._tree, self._mapping = tree, mapping
        held = {name: _held_at(name, joint, mapping) for name, joint in tree.joints.items()}
        self._walked = list(tree.walk({name: at for name, at in held.items() if name not in mapping.moved}))
        self._poses = {link.name: pose for _, link, pose in self._walked}
        self._upright = self._stood_upright()

    def model(self) -> RobotModel:
        owners: dict[str, str] = {}
        carried: dict[str, list[str]] = {BASE: []}
        parents: dict[str, str] = {}
        for joint, link, _ in self._walked:
            owner = BASE if joint is None else owners[joint.parent]
            name = "" if joint is None else joint.name.lstrip("/")
            if name in self._mapping.moved:
                parents[name], owner = owner, name
                carried[name] = []
            owners[link.name] = owner
            carried[owner].append(link.name)
        for arm in self._mapping.arms:
            for above, name in pairwise(arm):
                if parents[name] != above:
                    raise ValueError(f"joint {name} does not hang on joint {above}")
        joints = {name: self._joint(name, above, carried[name]) for name, above in parents.items()}
        # The base does not move. PyBullet's inverse dynamics takes gravity in the frame of its inertia: the robot's.
        base = replace(self._merged(BASE, carried[BASE], np.zeros(3)), mass=1.0, centre=np.zeros(3), inertia=np.eye(3))
        floored = {name: replace(joint, link=self._with_floors(joint.link)) for name, joint in joints.items()}
        raised = [name for name, joint in joints.items() if floored[name].link is not joint.link]
        return RobotModel(base, floored, self._mapping_in_robot(), self._notes(raised))

    def _notes(self, raised: Sequence[str]) -> tuple[str, ...]:
        if not raised:
            return ()
        floors = f"raised to {_LEAST_MASS} kg and to those of motors' rotors"
        return (f"{self._tree.path}: token masses or inertias are {floors}, in what hangs on {', '.join(raised)}",)

    def _stood_upright(self) -> FloatArray:
        """Return the pose of the file's root in the robot's frame, shape [4, 4]: up is where the shoulders are."""
        mapping = self._mapping
        left, right = (self._pose(arm[0])[:3, 3] for arm in mapping.arms)
        middle = (left + right) / 2
        up, foot = np.array([0.0, 0.0, 1.0]), np.zeros(3)
        if mapping.waist is not None:
            pose = self._pose(mapping.waist)
            up, foot = pose[:3, :3] @ self._tree.joints[mapping.waist].axis, pose[:3, 3]
        if (middle - foot) @ up < 0:
            up = -up
        leftwards = (left - right) - up * ((left - right) @ up)
        if not np.linalg.norm(leftwards) > _LEAST_WIDTH:
            raise ValueError("its shoulders are not beside each other")
        leftwards = leftwards / np.linalg.norm(leftwards)
        upright = np.eye(4)
        upright[:3, :3] = np.array([np.cross(leftwards, up), leftwards, up])
        upright[:3, 3] = mapping.shoulders - upright[:3, :3] @ middle
        return upright

    def _pose(self, joint: str) -> FloatArray:
        """Return the pose of what a joint moves in the frame of the file's root, shape [4, 4]."""
        return self._poses[self._tree.joints[joint].child]

    def _joint(self, name: str, parent: str, links: Sequence[str]) -> JointFrame:
        joint, pose = self._tree.joints[name], self._upright @ self._pose(name)
        if joint.kind not in ("revolute", "continuous"):
            raise ValueError(f"joint {name} is {joint.kind}, not one that turns")
        lower, upper = max(joint.lower, -_UNLIMITED), min(joint.upper, _UNLIMITED)
        if not lower < upper:
            raise ValueError(f"joint {name} is limited to {lower} to {upper}")
        velocity, effort = self._limit(name, "velocity"), self._limit(name, "effort")
        link = self._merged(name, links, pose[:3, 3])
        return JointFrame(name, parent, pose[:3, 3], pose[:3, :3] @ joint.axis, lower, upper, velocity, effort, link)

    def _of_arm(self, name: str, values: FloatArray) -> float:
        """Return what a mapping says of a joint by its number in its arm."""
        return next(float(values[arm.index(name)]) for arm in self._mapping.arms if name in arm)

    def _limit(self, name: str, kind: str) -> float:
        """Return a joint's greatest speed or torque: the mapping's, or the file's if that is lower."""
        stated = float(getattr(self._tree.joints[name], kind))
        most = self._of_arm(name, getattr(self._mapping, kind))
        limit = min(stated, most) if stated > 0 else most
        if not limit < np.inf:
            raise ValueError(f"joint {name} has no limit of its {kind}")
        return limit

    def _with_floors(self, link: Link) -> Link:
        """Return a link with the mass and moments of inertia of a robot's part; the same if it has them."""
        moments, axes = np.linalg.eigh(link.inertia)
        floored = np.maximum(moments, self._of_arm(link.name, self._mapping.rotor_inertia))
        # No moment can be more than the sum of the others.
        floored[0] += max(0.0, floored[2] - floored[0] - floored[1])
        if link.mass >= _LEAST_MASS and np.allclose(floored, moments):
            return link
        return replace(link, mass=max(link.mass, _LEAST_MASS), inertia=axes @ np.diag(floored) @ axes.T)

    def _merged(self, name: str, links: Sequence[str], origin: FloatArray) -> Link:
        """Return all links that one joint carries as one, in a frame at ``origin`` that is parallel to the robot's."""
        to_here = np.eye(4)
        to_here[:3, 3] = -origin
        poses = [to_here @ self._upright @ self._poses[link] for link in links]
        parts = [self._tree.links[link] for link in links]
        masses = np.array([part.mass for part in parts])
        centres = np.array([pose[:3, :3] @ part.centre + pose[:3, 3] for part, pose in zip(parts, poses, strict=True)])
        centre = masses @ centres / masses.sum() if masses.sum() else np.zeros(3)
        inertia = np.zeros((3, 3))
        for part, pose, at in zip(parts, poses, centres, strict=True):
            away = at - centre
            # Steiner's theorem.
            inertia += pose[:3, :3] @ part.inertia @ pose[:3, :3].T
            inertia += part.mass * (away @ away * np.eye(3) - np.outer(away, away))
        seen, touched = (_moved(parts, poses, kind) for kind in ("seen", "touched"))
        return Link(name, float(masses.sum()), centre, inertia, seen, touched)

    def _mapping_in_robot(self) -> RobotMapping:
        """Return the mapping with the hands' vectors in the robot's frame at joint angles zero."""
        mapping = self._mapping
        if mapping.hands is None:
            return mapping
        missing = [link for link in mapping.hands if link not in self._poses]
        if missing:
            raise ValueError(f"it has no link {', '.join(missing)}")
        turns = [(self._upright @ self._poses[link])[:3, :3] for link in mapping.hands]
        forward, palm = (
            np.array([turn @ vector for turn, vector in zip(turns, vectors, strict=True)])
            for vectors in (mapping.forward, mapping.palm)
        )
        return replace(mapping, forward=forward, palm=palm, hands=None)


def _moved(parts: Sequence[Link], poses: Sequence[FloatArray], kind: str) -> tuple[Piece, ...]:
    return tuple(
        Piece(pose @ piece.pose, piece.geometry, piece.attributes, piece.colour)
        for part, pose in zip(parts, poses, strict=True)
        for piece in getattr(part, kind)
    )


def _held_at(name: str, joint: UrdfJoint, mapping: RobotMapping) -> float:
    position = next((at for pattern, at in mapping.held.items() if fnmatchcase(name, pattern)), 0.0)
    return min(max(position, joint.lower), joint.upper) if joint.lower <= joint.upper else 0.0


def model_urdf(model: RobotModel) -> str:
    """Return a model as URDF."""
    robot = ElementTree.Element("robot", name="robot")
    _add_link(robot, model.base)
    for joint in model.joints.values():
        _add_link(robot, joint.link)
        element = ElementTree.SubElement(robot, "joint", name=joint.name, type="revolute")
        ElementTree.SubElement(element, "parent", link=joint.parent)
        ElementTree.SubElement(element, "child", link=joint.name)
        above = model.joints[joint.parent].position if joint.parent != BASE else np.zeros(3)
        ElementTree.SubElement(element, "origin", xyz=numbers(joint.position - above))
        ElementTree.SubElement(element, "axis", xyz=numbers(joint.axis))
        ends = {key: f"{getattr(joint, key):.17g}" for key in ("lower", "upper", "velocity", "effort")}
        ElementTree.SubElement(element, "limit", ends)
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode")


def _add_link(robot: ElementTree.Element, link: Link) -> None:
    element = ElementTree.SubElement(robot, "link", name=link.name)
    inertial = ElementTree.SubElement(element, "inertial")
    moments, axes = np.linalg.eigh(link.inertia)
    axes = axes * np.sign(np.linalg.det(axes))
    ElementTree.SubElement(inertial, "origin", xyz=numbers(link.centre), rpy=_angles(axes))
    ElementTree.SubElement(inertial, "mass", value=f"{link.mass:.17g}")
    diagonal = dict(zip(("ixx", "iyy", "izz"), (f"{moment:.17g}" for moment in moments), strict=True))
    ElementTree.SubElement(inertial, "inertia", {**diagonal, "ixy": "0", "ixz": "0", "iyz": "0"})
    for tag, pieces in (("visual", link.seen), ("collision", link.touched)):
        for number, piece in enumerate(pieces):
            shape = ElementTree.SubElement(element, tag)
            ElementTree.SubElement(shape, "origin", xyz=numbers(piece.pose[:3, 3]), rpy=_angles(piece.pose[:3, :3]))
            geometry = ElementTree.SubElement(shape, "geometry")
            ElementTree.SubElement(geometry, piece.geometry, dict(piece.attributes))
            if piece.colour is not None and tag == "visual":
                material = ElementTree.SubElement(shape, "material", name=f"{link.name} {number}")
                ElementTree.SubElement(material, "color", rgba=piece.colour)


def _angles(rotation: FloatArray) -> str:
    """Return the roll, pitch and yaw of a rotation matrix as URDF has them."""
    pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[2, 1], rotation[2, 2]))
    if np.cos(pitch) < 1e-9:
        # Straight up or down: roll and yaw are about one axis.
        roll = np.arctan2(-rotation[1, 2], rotation[1, 1])
        return numbers(np.array([roll, pitch, 0.0]))
    roll, yaw = np.arctan2(rotation[2, 1], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[0, 0])
    return numbers(np.array([roll, pitch, yaw]))
