"""The robot as a body in PyBullet: joints, torques, hands, head."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pybullet

from atg_fg.core.patterns import FloatArray
from atg_fg.core.silence import silenced
from sim.bodies.cube import CUBE_CENTRE
from sim.bodies.prepared_robot import PreparedRobot, shell
from sim.bodies.rail import Rail, on_rail
from sim.bodies.robot_model import BASE

#: Links no more joints apart than this cannot hit each other; their shapes overlap at the joint.
_NEIGHBOURS: Final = 3
#: What the eye looks at: a little before the middle of the cube's place, and below.
_GAZE: Final = CUBE_CENTRE - [0.02, 0.0, 0.02]
#: Of every joint.
JOINT_DAMPING: Final = 0.1  # N·m·s/rad


class RobotBody:
    """The robot in a PyBullet client, its waist at the world's origin, or beside it on a rail.

    Args:
        client: PyBullet's physics client id.
        robot: What to load, instead of the shell.
        rail_reach: How far the robot can slide to its left and right, m; without it, the robot stands still.

    Attributes:
        rail: What it slides on, if it does.
    """

    def __init__(self, client: int, robot: PreparedRobot | None = None, rail_reach: float | None = None) -> None:
        self.client = client
        self.model = robot = robot or shell()
        self.body = self._load(robot.urdf if rail_reach is None else on_rail(robot.urdf, rail_reach))
        self.rail = None if rail_reach is None else Rail(client, self.body)
        self.kinematics, self.effort, self.velocity = robot.kinematics, robot.effort, robot.velocity
        n_joints = pybullet.getNumJoints(self.body, physicsClientId=client)
        infos = [pybullet.getJointInfo(self.body, joint, physicsClientId=client) for joint in range(n_joints)]
        self.joints = {info[1].decode(): index for index, info in enumerate(infos)}
        #: Links by the names of the joints that move them.
        self.links = {BASE: -1 if self.rail is None else self.rail.joint, **self.joints}
        self._parents = [info[16] for info in infos]
        #: Joints with an angle, in PyBullet's order.
        self._movable = [index for index, info in enumerate(infos) if info[3] >= 0]
        self.arm_joints = [self.joints[name] for arm in robot.arm_joints for name in arm]
        #: The link of each hand.
        self.hands = tuple(self.joints[arm[-1]] for arm in robot.arm_joints)
        for joint in range(n_joints):
            pybullet.changeDynamics(
                self.body, joint, linearDamping=0, angularDamping=0, jointDamping=JOINT_DAMPING, physicsClientId=client
            )
        self._let_neighbours_touch()
        self.let_touch(robot.overlapping)
        # PyBullet's joints come with motors that brake; the arms are driven by torques.
        free = [0.0] * len(self.arm_joints)
        pybullet.setJointMotorControlArray(
            self.body, self.arm_joints, pybullet.VELOCITY_CONTROL, forces=free, physicsClientId=client
        )
        self.reset(robot.home)
        with silenced(1):
            # PyBullet builds what it needs for inverse dynamics, and tells of axes that rounding left no unit vectors.
            self.gravity_torques(robot.home)

    def reset(self, angles: FloatArray) -> None:
        """Put the arms at rest at joint angles of shape [2, 7] (rad); not for use while a trial goes on."""
        for joint, angle in zip(self.arm_joints, angles.ravel(), strict=True):
            pybullet.resetJointState(self.body, joint, angle, physicsClientId=self.client)

    def joint_states(self) -> Sequence[tuple[float, ...]]:
        """Return the arms' joint angles (rad), velocities (rad/s) and more of 14 joints as PyBullet has them."""
        states: Sequence[tuple[float, ...]] = pybullet.getJointStates(self.body, self.arm_joints, self.client)
        return states

    def state(self) -> tuple[FloatArray, FloatArray]:
        """Return the arms' joint angles (rad) and velocities (rad/s), each of shape [2, 7]."""
        both = np.array([state[:2] for state in self.joint_states()]).reshape(2, -1, 2)
        return both[..., 0], both[..., 1]

    def apply(self, torques: FloatArray) -> None:
        """Drive the arms with torques of shape [2, 7] (N·m) for one step of the simulation."""
        self.drive(torques.ravel().tolist())

    def drive(self, torques: Sequence[float]) -> None:
        """Drive the arms with 14 torques (N·m) for one step: the left arm's, then the right one's."""
        pybullet.setJointMotorControlArray(
            self.body, self.arm_joints, pybullet.TORQUE_CONTROL, forces=torques, physicsClientId=self.client
        )

    def gravity_torques(self, angles: FloatArray) -> FloatArray:
        """Return the torques that hold the arms still at joint angles, both of shape [2, 7] (rad, N·m)."""
        return self.torques_of(angles, np.zeros_like(angles), np.zeros_like(angles))

    def torques_of(self, angles: FloatArray, velocities: FloatArray, accelerations: FloatArray) -> FloatArray:
        """Return the torques of a motion of the arms in which the hands touch nothing, shape [2, 7], N·m.

        The rest of the body is taken as it stands.

        Args:
            angles: Shape [2, 7], rad.
            velocities: Shape [2, 7], rad/s.
            accelerations: Shape [2, 7], rad/s².
        """
        states = pybullet.getJointStates(self.body, self._movable, physicsClientId=self.client)
        posture = dict(zip(self._movable, (state[0] for state in states), strict=True))
        still = dict.fromkeys(self._movable, 0.0)
        moving = [
            list({**rest, **dict(zip(self.arm_joints, arms.ravel().tolist(), strict=True))}.values())
            for rest, arms in ((posture, angles), (still, velocities), (still, accelerations))
        ]
        torques = pybullet.calculateInverseDynamics(self.body, *moving, physicsClientId=self.client)
        by_joint = dict(zip(self._movable, torques, strict=True))
        return np.array([by_joint[joint] for joint in self.arm_joints]).reshape(2, -1)

    def set_pad_friction(self, lateral: float, spinning: float) -> None:
        """Set the coefficients of friction of the pads; ``spinning`` (m) is the radius of the patch of contact."""
        for link in self.hands:
            pybullet.changeDynamics(
                self.body,
                link,
                lateralFriction=lateral,
                spinningFriction=spinning,
                rollingFriction=0.0,
                physicsClientId=self.client,
            )

    def eye(self) -> tuple[FloatArray, FloatArray]:
        """Return where the camera's eye is and which way it looks in the robot's frame: m, unit vector, shape [3]."""
        direction = _GAZE - self.model.eye
        return self.model.eye, direction / np.linalg.norm(direction)

    @property
    def place(self) -> FloatArray:
        """Where the robot's frame is in the world, as the rail measures it, shape [3], m."""
        return np.array([0.0, 0.0 if self.rail is None else self.rail.position, 0.0])

    def contact_forces(self, body: int) -> tuple[float, float]:
        """Return the normal forces between the hands, left and right, and another body, N."""
        points = pybullet.getContactPoints(self.body, body, physicsClientId=self.client)
        left, right = (sum(point[9] for point in points if point[3] == hand) for hand in self.hands)
        return float(left), float(right)

    def touches_itself(self) -> bool:
        """Whether an arm touches the torso, the head or the other arm."""
        return bool(pybullet.getContactPoints(self.body, self.body, physicsClientId=self.client))

    def _load(self, urdf: str) -> int:
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_SELF_COLLISION
        with tempfile.TemporaryDirectory(prefix="robot-") as folder:
            path = Path(folder) / "robot.urdf"
            path.write_text(urdf)
            for name, content in self.model.meshes.items():
                (path.parent / name).write_text(content)
            with silenced(1):
                return int(pybullet.loadURDF(str(path), useFixedBase=True, flags=flags, physicsClientId=self.client))

    def _ancestors(self, link: int) -> list[int]:
        """Return a link and all that it hangs on, up to the base."""
        chain = [link]
        while chain[-1] >= 0:
            chain.append(self._parents[chain[-1]])
        return chain

    def let_touch(self, pairs: Iterable[tuple[str, str]]) -> None:
        """Switch off collisions between pairs of links, by the names of their joints."""
        for one, other in pairs:
            self._let_touch(self.links[one], self.links[other])

    def _let_neighbours_touch(self) -> None:
        """Switch off collisions between links a few joints apart, and leave all others on."""
        above = [self._ancestors(link) for link in range(len(self._parents))]
        for other, others in enumerate(above):
            for link, links in enumerate(above[:other]):
                if len(set(links) ^ set(others)) <= _NEIGHBOURS:
                    self._let_touch(link, other)
            for ancestor in others[1 : 1 + _NEIGHBOURS]:
                self._let_touch(other, ancestor)

    def _let_touch(self, one: int, other: int) -> None:
        pybullet.setCollisionFilterPair(self.body, self.body, one, other, 0, physicsClientId=self.client)
