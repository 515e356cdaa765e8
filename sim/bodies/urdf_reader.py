"""A robot's description read from a URDF file: its links, its joints, and nothing of it believed unchecked."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray

_MOST_BYTES: Final = 20_000_000
#: PyBullet copies names into buffers of 1024 characters, with what it adds to them.
_LONGEST_NAME: Final = 200
_LONGEST_PATH: Final = 900
_MOST_LINKS: Final = 2000
#: Lengths, m, and angles beyond it are no robot's, and sums of their squares are no numbers to PyBullet.
_FARTHEST: Final = 1e4
_TURNING: Final = ("revolute", "continuous")
_SIZES: Final = {
    "box": ("size",),
    "sphere": ("radius",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
}


@dataclass(frozen=True, eq=False)
class Piece:
    """A shape of a link, seen or touched.

    Attributes:
        pose: In the link's frame, shape [4, 4].
        geometry: ``box``, ``sphere``, ``cylinder``, ``capsule`` or ``mesh``.
        attributes: Of its element, checked: numbers, for a mesh the absolute path of its file and the scale.
        colour: As URDF has it, ``"r g b a"``; ``None`` if it is not told.
    """

    pose: FloatArray
    geometry: str
    attributes: Mapping[str, str]
    colour: str | None = None


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid part of the robot, in its own frame.

    Attributes:
        name: In the file.
        mass: kg.
        centre: Of the mass, shape [3], m.
        inertia: About the centre, shape [3, 3], kg·m².
        seen: Shapes to look at.
        touched: Shapes to collide with.
    """

    name: str
    mass: float = 0.0
    centre: FloatArray = field(default_factory=lambda: np.zeros(3))
    inertia: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))
    seen: tuple[Piece, ...] = ()
    touched: tuple[Piece, ...] = ()


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint as the file has it.

    Attributes:
        name: In the file.
        kind: ``revolute``, ``continuous``, ``prismatic``, ``fixed``, ``floating`` or ``planar``.
        parent: Name of the link that it hangs on.
        child: Name of the link that it moves.
        pose: Of the child in the parent's frame when the joint is at zero, shape [4, 4].
        axis: Unit vector in the child's frame, shape [3].
        lower: Least angle or way, rad or m.
        upper: Greatest angle or way.
        velocity: Greatest speed; 0 if it is not told.
        effort: Greatest torque or force; 0 if it is not told.
    """

    name: str
    kind: str
    parent: str
    child: str
    pose: FloatArray
    axis: FloatArray
    lower: float
    upper: float
    velocity: float
    effort: float

    def moved(self, position: float) -> FloatArray:
        """Return the child's pose in the parent's frame with the joint at ``position``, shape [4, 4]."""
        motion = np.eye(4)
        if self.kind in _TURNING:
            motion[:3, :3] = about(self.axis, position)
        elif self.kind == "prismatic":
            motion[:3, 3] = position * self.axis
        return self.pose @ motion


@dataclass(frozen=True, eq=False)
class UrdfTree:
    """A description: a tree of links that hang on each other by joints.

    Attributes:
        path: The file.
        root: Name of the link that hangs on nothing.
        links: By name.
        joints: By name, without a leading slash.
    """

    path: Path
    root: str
    links: Mapping[str, Link]
    joints: Mapping[str, UrdfJoint]

    def walk(self, positions: Mapping[str, float]) -> Iterator[tuple[UrdfJoint | None, Link, FloatArray]]:
        """Yield every link with the joint above it and its pose in the root's frame, parents before children.

        Args:
            positions: Of joints that are not at zero, by name.
        """
        below: dict[str, list[tuple[str, UrdfJoint]]] = {}
        for name, joint in self.joints.items():
            below.setdefault(joint.parent, []).append((name, joint))
        poses = {self.root: np.eye(4)}
        yield None, self.links[self.root], poses[self.root]
        waiting = [self.root]
        while waiting:
            parent = waiting.pop()
            for name, joint in below.get(parent, []):
                poses[joint.child] = poses[parent] @ joint.moved(positions.get(name, 0.0))
                yield joint, self.links[joint.child], poses[joint.child]
                waiting.append(joint.child)


def read_urdf(path: Path) -> UrdfTree:
    """Read a URDF file.

    Raises:
        InvalidInputError: The file cannot be read, is no URDF, is no tree, or holds what no robot can have.
    """
    try:
        if not os.path.isfile(path):
            raise OSError("no such file" if not os.path.exists(path) else "not a plain file")
        if path.stat().st_size > _MOST_BYTES:
            raise OSError(f"larger than {_MOST_BYTES // 1_000_000} MB")
        robot = ElementTree.parse(path).getroot()
    except (OSError, LookupError, ValueError, ElementTree.ParseError) as error:
        raise InvalidInputError(f"{path}: cannot be read as URDF: {error}; expected a robot's description") from error
    try:
        colours = {material.get("name"): _colour(material, {}) for material in robot.iterfind("material")}
        links = [_link(element, path, colours) for element in robot.iterfind("link")]
        joints = [_joint(element) for element in robot.iterfind("joint")]
        return _tree(path, links, joints)
    except ValueError as error:
        raise InvalidInputError(f"{path}: {error}; expected a robot's description in URDF") from error


def _tree(path: Path, links: list[Link], joints: list[UrdfJoint]) -> UrdfTree:
    """Return links and joints as a tree, or raise ``ValueError``."""
    if len(links) > _MOST_LINKS:
        raise ValueError(f"it has {len(links)} links; {_MOST_LINKS} is the most")
    by_name = {link.name: link for link in links}
    names = {joint.name.lstrip("/"): joint for joint in joints}
    children = {joint.child for joint in joints}
    if len(by_name) < len(links) or len(names) < len(joints) or len(children) < len(joints):
        raise ValueError("a joint or a link is there twice")
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in by_name:
                raise ValueError(f"joint {joint.name} names the link {link!r}, which is not there")
    roots = by_name.keys() - children
    if len(roots) != 1:
        raise ValueError(f"it has {len(roots)} root links, not one")
    tree = UrdfTree(path, roots.pop(), by_name, names)
    if sum(1 for _ in tree.walk({})) < len(links):
        raise ValueError("its joints go round in a circle")
    return tree


def _link(element: ElementTree.Element, path: Path, colours: Mapping[str | None, str | None]) -> Link:
    name = _name(element, "link")
    seen = tuple(_piece(each, path, colours) for each in element.iterfind("visual"))
    touched = tuple(_piece(each, path, {}) for each in element.iterfind("collision"))
    inertial = element.find("inertial")
    if inertial is None:
        return Link(name, seen=seen, touched=touched)
    pose = _pose(inertial)
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    kilograms = _number(mass, "value", 0.0)
    if kilograms < 0:
        raise ValueError(f"link {name} has a mass of {kilograms} kg")
    moments = {key: _number(inertia, key, 0.0) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")}
    if min(moments["ixx"], moments["iyy"], moments["izz"]) < 0:
        raise ValueError(f"link {name} has a negative moment of inertia")
    tensor = np.array(
        [
            [moments["ixx"], moments["ixy"], moments["ixz"]],
            [moments["ixy"], moments["iyy"], moments["iyz"]],
            [moments["ixz"], moments["iyz"], moments["izz"]],
        ]
    )
    return Link(name, kilograms, pose[:3, 3], pose[:3, :3] @ tensor @ pose[:3, :3].T, seen, touched)


def _joint(element: ElementTree.Element) -> UrdfJoint:
    name, kind = _name(element, "joint"), element.get("type", "")
    ends = {end: element.find(end) for end in ("parent", "child")}
    for end, found in ends.items():
        if found is None:
            raise ValueError(f"joint {name} has no {end}")
    parent, child = ("" if found is None else found.get("link", "") for found in ends.values())
    axis = element.find("axis")
    direction = _vector(None if axis is None else axis.get("xyz"), "1 0 0")
    length = float(np.linalg.norm(direction))
    if kind not in ("fixed", "floating") and not length > 0:
        raise ValueError(f"joint {name} has no direction")
    limit = element.find("limit")
    unlimited = kind == "continuous" or limit is None
    lower, upper = (
        sign * np.inf if unlimited else _number(limit, end, 0.0) for end, sign in (("lower", -1), ("upper", 1))
    )
    velocity, effort = (_number(limit, key, 0.0) for key in ("velocity", "effort"))
    return UrdfJoint(
        name, kind, parent, child, _pose(element), direction / (length or 1.0), lower, upper, velocity, effort
    )


def _piece(element: ElementTree.Element, path: Path, colours: Mapping[str | None, str | None]) -> Piece:
    geometry = element.find("geometry")
    shapes = [] if geometry is None else list(geometry)
    if len(shapes) != 1:
        raise ValueError(f"a shape with {len(shapes)} geometries, not one")
    (shape,) = shapes
    material = element.find("material")
    colour = None if material is None else _colour(material, colours)
    if shape.tag == "mesh":
        scale = _vector(shape.get("scale"), "1 1 1")
        attributes = {"filename": str(found_mesh(shape.get("filename", ""), path)), "scale": numbers(scale)}
    elif shape.tag in _SIZES:
        sizes = {key: np.array([float(part) for part in shape.get(key, "").split()]) for key in _SIZES[shape.tag]}
        for key, size in sizes.items():
            if size.size != (3 if key == "size" else 1) or not ((size >= 0) & (size < np.inf)).all():
                raise ValueError(f"a {shape.tag} whose {key} is {shape.get(key)!r}")
        attributes = {key: numbers(size) for key, size in sizes.items()}
    else:
        raise ValueError(f"a shape that is {shape.tag!r}, not a box, sphere, cylinder, capsule or mesh")
    return Piece(_pose(element), shape.tag, attributes, colour)


def found_mesh(filename: str, urdf: Path) -> Path:
    """Return the path of a mesh that a description names, looked for in the folders about it, ever further up.

    A package is a folder of its name about the file, or in ``ROS_PACKAGE_PATH``; or, as copies are often renamed, any
    folder about the file that has the rest of the path.

    Raises:
        ValueError: There is no such file, or it is not a plain file.
    """
    scheme, _, rest = filename.rpartition("://")
    folders = list(urdf.absolute().parents)
    if scheme in ("package", "model"):
        folders += [Path(folder) for folder in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if folder]
        within = rest.partition("/")[2]
        places = [folder / rest for folder in folders] + [folder / within for folder in folders if within]
    else:
        places = [Path(rest)] if rest.startswith("/") else [folder / rest for folder in folders]
    for place in places:
        if os.path.isfile(place):
            if len(str(place)) > _LONGEST_PATH:
                raise ValueError(f"the path of mesh {filename[-60:]!r} is longer than {_LONGEST_PATH} characters")
            return place
    raise ValueError(f"mesh {filename[:_LONGEST_NAME]!r} is no file in the folders about it")


def _colour(material: ElementTree.Element, colours: Mapping[str | None, str | None]) -> str | None:
    """Return a material's colour as four numbers, its own or the one of that name."""
    element = material.find("color")
    if element is None:
        return colours.get(material.get("name"))
    values = np.array([float(value) for value in element.get("rgba", "").split()])
    if values.shape != (4,) or not np.isfinite(values).all():
        raise ValueError(f"colour {element.get('rgba')!r} is not four finite numbers")
    return numbers(values)


def _name(element: ElementTree.Element, kind: str) -> str:
    name = element.get("name", "")
    if not 0 < len(name) <= _LONGEST_NAME:
        raise ValueError(f"a {kind} whose name has {len(name)} characters, not 1 to {_LONGEST_NAME}")
    return name


def _pose(element: ElementTree.Element) -> FloatArray:
    """Return the pose that an element's origin tells, shape [4, 4]."""
    origin = element.find("origin")
    offset, angles = (origin.get("xyz"), origin.get("rpy")) if origin is not None else (None, None)
    pose = np.eye(4)
    pose[:3, 3] = _vector(offset, "0 0 0")
    roll, pitch, yaw = _vector(angles, "0 0 0")
    x, y, z = np.eye(3)
    pose[:3, :3] = about(z, yaw) @ about(y, pitch) @ about(x, roll)
    return pose


def _number(element: ElementTree.Element | None, key: str, default: float) -> float:
    """Return a finite number of an element that may be missing."""
    value = default if element is None else float(element.get(key, default))
    if not np.isfinite(value):
        raise ValueError(f"{key} is {value}")
    return value


def _vector(text: str | None, default: str) -> FloatArray:
    values = np.array([float(value) for value in (text or default).split()])
    if values.shape != (3,) or not (np.abs(values) <= _FARTHEST).all():  # a NaN is not
        raise ValueError(f"{text!r} is not three finite numbers of at most {_FARTHEST:g}")
    return values


def about(axis: FloatArray, angle: float) -> FloatArray:
    """Return the rotation about a unit vector by ``angle`` (rad), shape [3, 3]."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def numbers(vector: FloatArray) -> str:
    """Return numbers as URDF has them, exact."""
    return " ".join(f"{value + 0.0:.17g}" for value in np.ravel(vector))
