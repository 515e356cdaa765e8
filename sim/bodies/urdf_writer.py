"""The robot's description as URDF: written from the kinematic table and the shell, read from a user's own file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

import numpy as np

from atg_fg.core.patterns import FloatArray
from sim.bodies import robonaut_shapes
from sim.bodies.robonaut_joints import NECK, SIDES, WAIST, Joint, arm
from sim.bodies.robonaut_shapes import Shape

_MATERIALS: Final = {
    robonaut_shapes.WHITE: "white",
    robonaut_shapes.GREY: "grey",
    robonaut_shapes.DARK: "dark",
    robonaut_shapes.GOLD: "gold",
}

#: How round each kind of shape is seen, lengthwise and around: 1 is a ball, towards 0 a box.
_ROUNDNESS: Final = {"ball": (1.0, 1.0), "rounded": (0.45, 0.45), "capsule": (0.4, 1.0)}


def write_robot(folder: Path) -> Path:
    """Write the robot's URDF and its meshes into ``folder`` and return the URDF's path."""
    for kind, roundness in _ROUNDNESS.items():
        (folder / f"{kind}.obj").write_text(_superellipsoid(*roundness))
    path = folder / "robonaut.urdf"
    path.write_text(robot_urdf())
    return path


def robot_urdf() -> str:
    """Return the robot's description; meshes are looked for beside it."""
    robot = ElementTree.Element("robot", name="robonaut")
    for colour, name in _MATERIALS.items():
        material = ElementTree.SubElement(robot, "material", name=name)
        ElementTree.SubElement(material, "color", rgba=colour)
    _add_link(robot, "base", np.zeros(3), robonaut_shapes.pedestal_shapes(), mass=60.0)
    _add_joint(robot, WAIST, "base", np.zeros(3), robonaut_shapes.torso_shapes())
    parent, origin = WAIST.name, WAIST.position
    for number, joint in enumerate(NECK):
        _add_joint(robot, joint, parent, origin, robonaut_shapes.neck_shapes(number))
        parent, origin = joint.name, joint.position
    for side in SIDES:
        parent, origin = WAIST.name, WAIST.position
        for joint, shapes in zip(arm(side), robonaut_shapes.arm_shapes(side), strict=True):
            _add_joint(robot, joint, parent, origin, shapes)
            parent, origin = joint.name, joint.position
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode") + "\n"


def _link_name(joint_or_base: str) -> str:
    return joint_or_base if joint_or_base == "base" else f"{joint_or_base}_link"


def _add_joint(
    robot: ElementTree.Element, joint: Joint, parent: str, parent_origin: FloatArray, shapes: Sequence[Shape]
) -> None:
    """Add a joint and the link that it moves; link frames are parallel at joint angle zero."""
    _add_link(robot, _link_name(joint.name), joint.position, shapes, joint.mass, joint.rotor_inertia)
    element = ElementTree.SubElement(robot, "joint", name=joint.name, type="revolute")
    ElementTree.SubElement(element, "parent", link=_link_name(parent))
    ElementTree.SubElement(element, "child", link=_link_name(joint.name))
    ElementTree.SubElement(element, "origin", xyz=_text(joint.position - parent_origin))
    ElementTree.SubElement(element, "axis", xyz=_text(joint.axis))
    ElementTree.SubElement(
        element,
        "limit",
        lower=f"{joint.lower:g}",
        upper=f"{joint.upper:g}",
        effort=f"{joint.effort:g}",
        velocity=f"{joint.velocity:g}",
    )


def _add_link(
    robot: ElementTree.Element,
    name: str,
    origin: FloatArray,
    shapes: Sequence[Shape],
    mass: float,
    rotor_inertia: float = 0.0,
) -> None:
    link = ElementTree.SubElement(robot, "link", name=name)
    _add_inertia(link, shapes[0], origin, mass, rotor_inertia)
    for shape in shapes:
        if shape.visible:
            visual = ElementTree.SubElement(link, "visual")
            _add_geometry(visual, shape, origin, as_seen=True)
            ElementTree.SubElement(visual, "material", name=_MATERIALS[shape.colour])
        if shape.solid:
            _add_geometry(ElementTree.SubElement(link, "collision"), shape, origin, as_seen=False)


def _add_inertia(
    link: ElementTree.Element, shape: Shape, origin: FloatArray, mass: float, rotor_inertia: float
) -> None:
    """Spread a link's mass evenly over its first shape, as a solid cylinder of that size; add its motor's rotor."""
    inertial = ElementTree.SubElement(link, "inertial")
    _add_origin(inertial, shape, origin)
    ElementTree.SubElement(inertial, "mass", value=f"{mass:g}")
    radius = float(shape.size.min())
    length = float(np.linalg.norm(shape.end - shape.start)) or 2 * float(shape.size.max())
    lengthwise = mass * radius**2 / 2 + rotor_inertia
    crosswise = mass * (length**2 / 12 + radius**2 / 4) + rotor_inertia
    moments = {"ixx": crosswise, "iyy": crosswise, "izz": lengthwise, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
    ElementTree.SubElement(inertial, "inertia", {name: f"{value:.6g}" for name, value in moments.items()})


def _add_geometry(element: ElementTree.Element, shape: Shape, origin: FloatArray, *, as_seen: bool) -> None:
    _add_origin(element, shape, origin)
    geometry = ElementTree.SubElement(element, "geometry")
    length = float(np.linalg.norm(shape.end - shape.start))
    if as_seen:
        half_extents = shape.size if shape.kind != "capsule" else np.array([*shape.size[:2], length / 2])
        ElementTree.SubElement(geometry, "mesh", filename=f"{shape.kind}.obj", scale=_text(half_extents))
    elif shape.kind == "capsule":
        radius = float(shape.size[0])
        ElementTree.SubElement(geometry, "capsule", radius=f"{radius:g}", length=f"{length - 2 * radius:.6g}")
    else:
        ElementTree.SubElement(geometry, "sphere", radius=f"{float(shape.size.min()):g}")


def _add_origin(element: ElementTree.Element, shape: Shape, origin: FloatArray) -> None:
    """Place a shape in its link: the middle of a capsule, with its axis along z."""
    middle = (shape.start + shape.end) / 2 - origin
    x, y, z = shape.end - shape.start
    pitch, yaw = math.atan2(math.hypot(x, y), z), math.atan2(y, x)
    ElementTree.SubElement(element, "origin", xyz=_text(middle), rpy=_text([0.0, pitch, yaw]))


def _text(vector: Sequence[float] | FloatArray) -> str:
    return " ".join(f"{value + 0.0:.15g}" for value in vector)


def _superellipsoid(lengthwise: float, around: float, n_rings: int = 8, n_sectors: int = 16) -> str:
    """Return a superellipsoid of half axes 1 in Wavefront OBJ; its exponents are 1 for a ball, towards 0 for a box."""
    up = np.linspace(-np.pi / 2, np.pi / 2, n_rings + 1)[:, None]
    turn = np.linspace(-np.pi, np.pi, n_sectors, endpoint=False)

    def surface(lengthwise: float, around: float) -> FloatArray:
        ring = _signed_power(np.cos(up), lengthwise)
        x, y = ring * _signed_power(np.cos(turn), around), ring * _signed_power(np.sin(turn), around)
        return np.stack([x, y, np.broadcast_to(_signed_power(np.sin(up), lengthwise), x.shape)], axis=-1)

    points, normals = surface(lengthwise, around), surface(2.0 - lengthwise, 2.0 - around)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in points.reshape(-1, 3)]
    lines += ["vt 0 0"]
    lines += [f"vn {x:.5f} {y:.5f} {z:.5f}" for x, y, z in normals.reshape(-1, 3)]
    for ring in range(n_rings):
        for sector in range(n_sectors):
            left, right = ring * n_sectors + sector, ring * n_sectors + (sector + 1) % n_sectors
            quad = [left + 1, right + 1, right + n_sectors + 1, left + n_sectors + 1]
            lines += [_triangle(quad[:3]), _triangle([quad[0], *quad[2:]])]
    return "\n".join(lines) + "\n"


def _triangle(corners: Sequence[int]) -> str:
    return "f " + " ".join(f"{corner}/1/{corner}" for corner in corners)


def _signed_power(values: FloatArray, exponent: float) -> FloatArray:
    return np.asarray(np.sign(values) * np.abs(values) ** exponent)
