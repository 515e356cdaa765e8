"""A robot made ready to be loaded, with all that its body and its plans need to know of it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from sim.bodies.kinematics import ArmKinematics
from sim.bodies.robonaut_joints import PAD_OFFSET, PAD_RADIUS
from sim.bodies.robot_mapping import shell_mapping
from sim.bodies.robot_model import RobotModel, fitted, model_urdf
from sim.bodies.urdf_reader import read_urdf
from sim.bodies.urdf_writer import write_robot

#: The shell's joint angles with the hands raised before the shoulders, clear of all that stands on tables, rad.
TUCKED_POSTURE: Final[FloatArray] = np.tile([-0.06, 0.0, -2.35, -2.60, 2.11, 0.48, -0.03], (2, 1))
#: The shell's joint angles with the hands beside the cube, rad: within the joints' limits all through a flip.
HOME_POSTURE: Final[FloatArray] = np.tile([0.245, -0.483, -1.357, -2.167, 2.198, 0.127, 0.050], (2, 1))


@dataclass(frozen=True, eq=False)
class PreparedRobot:
    """A robot in the one form that is loaded, and what was found out about it.

    Attributes:
        urdf: Its description.
        meshes: Contents of the meshes that lie beside it, by file name; others are named by their absolute paths.
        kinematics: Of both arms, with the pads by which the hands touch.
        arm_joints: Names of each arm's joints, from the shoulder to the wrist.
        eye: Where the camera is in the robot's frame, shape [3], m.
        velocity: Greatest speed of each arm joint, shape [2, joints], rad/s.
        effort: Greatest torque of each arm joint, shape [2, joints], N·m.
        home: Joint angles with the hands beside the cube, shape [2, joints], rad.
        tucked: Joint angles with the hands raised before the shoulders, shape [2, joints], rad.
        overlapping: Pairs of links, by the names of their joints, that do not collide since they overlap at rest.
        notes: What was changed of the file's own, a sentence each.
    """

    urdf: str
    meshes: Mapping[str, str]
    kinematics: ArmKinematics
    arm_joints: tuple[tuple[str, ...], ...]
    eye: FloatArray
    velocity: FloatArray
    effort: FloatArray
    home: FloatArray
    tucked: FloatArray
    overlapping: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()


def kinematics_of(model: RobotModel, pads: FloatArray, pad_radius: FloatArray) -> ArmKinematics:
    """Return the kinematics of both arms, with pads of shape [2, 3] (m, at joint angles zero) and [2] (m)."""
    return ArmKinematics(
        *(_of_arms(model, name) for name in ("position", "axis", "lower", "upper")),
        hand_axis=model.mapping.forward,
        palm=model.mapping.palm,
        pads=pads,
        pad_radius=pad_radius,
    )


def assembled(
    model: RobotModel,
    kinematics: ArmKinematics,
    home: FloatArray,
    tucked: FloatArray,
    overlapping: tuple[tuple[str, str], ...] = (),
) -> PreparedRobot:
    """Return a model with what was found out about it."""
    return PreparedRobot(
        model_urdf(model),
        {},
        kinematics,
        model.mapping.arms,
        model.mapping.eye,
        _of_arms(model, "velocity"),
        _of_arms(model, "effort"),
        home,
        tucked,
        overlapping,
        model.notes,
    )


@cache
def shell() -> PreparedRobot:
    """Return the robot that is made here, with the pads and the postures that it was made with."""
    with tempfile.TemporaryDirectory(prefix="robonaut-") as folder:
        made = like_the_shell(write_robot(Path(folder)))
        meshes = {path.name: path.read_text() for path in Path(folder).glob("*.obj")}
    return replace(made, urdf=made.urdf.replace(f"{folder}/", ""), meshes=meshes)


def like_the_shell(urdf: Path) -> PreparedRobot:
    """Return a robot from a file that has the shell's joints, pads and postures.

    Raises:
        InvalidInputError: The file is no robot's description, or lacks a joint.
    """
    model = fitted(read_urdf(urdf), shell_mapping())
    wrists = np.array([model.joints[arm[-1]].position for arm in model.mapping.arms])
    kinematics = kinematics_of(model, wrists + PAD_OFFSET * model.mapping.forward, np.full(2, PAD_RADIUS))
    return assembled(model, kinematics, HOME_POSTURE, TUCKED_POSTURE)


def _of_arms(model: RobotModel, name: str) -> FloatArray:
    return np.array([[getattr(model.joints[joint], name) for joint in arm] for arm in model.mapping.arms])
