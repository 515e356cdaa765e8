"""The rail that the robot's base slides on, sideways: a prismatic joint under any description, and its motor."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final
from xml.etree import ElementTree

import numpy as np
import pybullet

from sim.bodies.robot_model import BASE

RAIL_SPEED: Final = 0.8  # m/s, the motor's limit
RAIL_FORCE: Final = 1000.0  # N, the motor's limit
#: What a ride is planned with, m/s and m/s²; the motor has the rest to follow, and to hold while the arms work.
_PLANNED_SPEED: Final = 0.7
_PLANNED_ACCELERATION: Final = 2.0
#: The share of a position error that the motor makes good each step, and of a speed error.
_POSITION_GAIN, _VELOCITY_GAIN = 0.1, 1.0
_NAME: Final = "atg-fg rail"


def on_rail(urdf: str, reach: float) -> str:
    """Return a robot's description with its base on a rail, ``reach`` (m) to the robot's left and right."""
    robot = ElementTree.fromstring(urdf)
    inertial = ElementTree.SubElement(ElementTree.SubElement(robot, "link", name=_NAME), "inertial")
    ElementTree.SubElement(inertial, "mass", value="0")
    ElementTree.SubElement(inertial, "inertia", dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), "0"))
    joint = ElementTree.SubElement(robot, "joint", name=_NAME, type="prismatic")
    ElementTree.SubElement(joint, "parent", link=_NAME)
    ElementTree.SubElement(joint, "child", link=BASE)
    ElementTree.SubElement(joint, "axis", xyz="0 1 0")
    limits = {"lower": -reach, "upper": reach, "effort": RAIL_FORCE, "velocity": RAIL_SPEED}
    ElementTree.SubElement(joint, "limit", {name: f"{value:g}" for name, value in limits.items()})
    return ElementTree.tostring(robot, encoding="unicode")


class Rail:
    """The motor of the rail, and where the base stands on it.

    Args:
        client: PyBullet's physics client id.
        body: The robot, loaded from what ``on_rail`` returned.

    Attributes:
        joint: Number of the rail's joint and of the base's link.
    """

    def __init__(self, client: int, body: int) -> None:
        self._client, self._body = client, body
        n_joints = pybullet.getNumJoints(body, physicsClientId=client)
        infos = (pybullet.getJointInfo(body, joint, physicsClientId=client) for joint in range(n_joints))
        (self.joint,) = (info[0] for info in infos if info[1].decode() == _NAME)
        self.reset(0.0)

    def reset(self, position: float) -> None:
        """Put the base at rest at ``position`` (m); not for use while a trial goes on."""
        pybullet.resetJointState(self._body, self.joint, position, physicsClientId=self._client)
        self.drive(position)

    @property
    def position(self) -> float:
        """Where the base is measured to be, m to the left of the rail's middle."""
        return float(self._state()[0])

    @property
    def speed(self) -> float:
        """How fast the base is measured to slide to the left, m/s."""
        return float(self._state()[1])

    @property
    def force(self) -> float:
        """How hard the motor pushed to the left in the last step, N."""
        return float(self._state()[3])

    def drive(self, position: float, speed: float = 0.0) -> None:
        """Let the motor keep the base at ``position`` (m) and ``speed`` (m/s) until told otherwise."""
        pybullet.setJointMotorControl2(
            self._body,
            self.joint,
            pybullet.POSITION_CONTROL,
            targetPosition=position,
            targetVelocity=speed,
            positionGain=_POSITION_GAIN,
            velocityGain=_VELOCITY_GAIN,
            maxVelocity=RAIL_SPEED,
            force=RAIL_FORCE,
            physicsClientId=self._client,
        )

    def ride(self, end: float) -> Iterator[None]:
        """Drive the base to ``end`` (m) along a cubic curve from rest to rest, one step of the simulation at a time."""
        begin = self.position
        way = end - begin
        time_step = pybullet.getPhysicsEngineParameters(physicsClientId=self._client)["fixedTimeStep"]
        # A cubic from rest to rest is quickest half way, and speeds up most at its ends.
        least = max(1.5 * abs(way) / _PLANNED_SPEED, np.sqrt(6 * abs(way) / _PLANNED_ACCELERATION))
        steps = max(1, round(least / time_step))
        seconds = steps * time_step
        for part in np.arange(1, steps + 1) / steps:
            self.drive(begin + way * part**2 * (3 - 2 * part), 6 * way * part * (1 - part) / seconds)
            yield
        self.drive(end)

    def _state(self) -> tuple[float, ...]:
        state: tuple[float, ...] = pybullet.getJointState(self._body, self.joint, physicsClientId=self._client)
        return state
