"""The robot as a body in PyBullet: joints, torques, hands, head."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import numpy as np
import pybullet

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from sim.bodies.cube import quaternion_of
from sim.bodies.rail import Rail, on_rail
from sim.bodies.robonaut_joints import NECK, SIDES, WAIST, arm, arm_joint_names
from sim.bodies.robonaut_shapes import EYE, EYE_TILT
from sim.bodies.urdf_reader import Description, read_description
from sim.bodies.urdf_writer import write_robot

#: Where the neck is held, rad: leant back, looking down at the table.
_NECK_POSTURE: Final = (0.10, 0.0, -0.65)


#: Links along an arm nearer than this cannot hit each other; their shapes overlap at the joint.
_NEIGHBOURS: Final = 3


_JOINT_DAMPING: Final = 0.1  # N·m·s/rad


#: Joint angles of both arms with the hands raised before the shoulders, clear of all that stands on tables, rad.
TUCKED_POSTURE: Final[FloatArray] = np.tile([-0.06, 0.0, -2.35, -2.60, 2.11, 0.48, -0.03], (2, 1))


#: Joint angles of both arms with the hands beside the cube, rad: within the joints' limits all through a flip.
HOME_POSTURE: Final[FloatArray] = np.tile([0.245, -0.483, -1.357, -2.167, 2.198, 0.127, 0.050], (2, 1))


class RobotBody:
    """The robot in a PyBullet client, its waist at the world's origin, or beside it on a rail.

    Args:
        client: PyBullet's physics client id.
        urdf: A user's own description with the joint names of NASA's Robonaut 2, instead of the shell.
        rail_reach: How far the robot can slide to its left and right, m; without it, the robot stands still.

    Attributes:
        rail: What it slides on, if it does.

    Raises:
        InvalidInputError: The description cannot be read or lacks a joint.
    """

    def __init__(self, client: int, urdf: Path | None = None, rail_reach: float | None = None) -> None:
        self.client = client
        with tempfile.TemporaryDirectory(prefix="robonaut-") as folder:
            description = read_description(urdf if urdf is not None else write_robot(Path(folder)))
            path = description.path if rail_reach is None else on_rail(description, Path(folder), rail_reach)
            self.body = self._load(description, path)
        self.rail = None if rail_reach is None else Rail(client, self.body)
        self.kinematics = description.kinematics()
        upright = np.array_equal(description.base_rotation, np.eye(3))
        self._base_rotation = None if upright else description.base_rotation
        n_joints = pybullet.getNumJoints(self.body, physicsClientId=client)
        infos = [pybullet.getJointInfo(self.body, joint, physicsClientId=client) for joint in range(n_joints)]
        indices = {info[1].decode(): index for index, info in enumerate(infos)}
        self.joints = {name: indices[in_file] for name, in_file in description.names.items()}
        self._parents = [info[16] for info in infos]
        #: Joints with an angle, in PyBullet's order.
        self._movable = [index for index, info in enumerate(infos) if info[3] >= 0]
        self.arm_joints = [self.joints[name] for side in SIDES for name in arm_joint_names(side)]
        wrists = tuple(self.joints[arm_joint_names(side)[-1]] for side in SIDES)
        #: The links of each hand: the wrist's and all that hang on it.
        self.hands = tuple([link for link in range(n_joints) if wrist in self._ancestors(link)] for wrist in wrists)
        self.effort = self._limits([info[10] for info in infos], "effort")
        self.velocity = self._limits([info[11] for info in infos], "velocity")
        head = description.joints[NECK[-1].name]
        self._eye = head.rotation.T @ (EYE - head.position)
        self._look = head.rotation.T @ np.array([np.cos(EYE_TILT), 0.0, -np.sin(EYE_TILT)])
        for joint in range(n_joints):
            pybullet.changeDynamics(
                self.body, joint, linearDamping=0, angularDamping=0, jointDamping=_JOINT_DAMPING, physicsClientId=client
            )
        self._let_neighbours_touch()
        self._hold_waist_and_neck()
        # PyBullet's joints come with motors that brake; the arms are driven by torques.
        free = [0.0] * len(self.arm_joints)
        pybullet.setJointMotorControlArray(
            self.body, self.arm_joints, pybullet.VELOCITY_CONTROL, forces=free, physicsClientId=client
        )
        self.reset(HOME_POSTURE)

    def reset(self, angles: FloatArray) -> None:
        """Put the arms at rest at joint angles of shape [2, 7] (rad); not for use while a trial goes on."""
        for joint, angle in zip(self.arm_joints, angles.ravel(), strict=True):
            pybullet.resetJointState(self.body, joint, angle, physicsClientId=self.client)

    def state(self) -> tuple[FloatArray, FloatArray]:
        """Return the arms' joint angles (rad) and velocities (rad/s), each of shape [2, 7]."""
        states = pybullet.getJointStates(self.body, self.arm_joints, physicsClientId=self.client)
        both = np.array([state[:2] for state in states]).reshape(2, -1, 2)
        return both[..., 0], both[..., 1]

    def apply(self, torques: FloatArray) -> None:
        """Drive the arms with torques of shape [2, 7] (N·m) for one step of the simulation."""
        pybullet.setJointMotorControlArray(
            self.body,
            self.arm_joints,
            pybullet.TORQUE_CONTROL,
            forces=torques.ravel().tolist(),
            physicsClientId=self.client,
        )

    def gravity_torques(self, angles: FloatArray) -> FloatArray:
        """Return the torques that hold the arms still at joint angles, both of shape [2, 7] (rad, N·m).

        The rest of the body is taken as it stands.
        """
        states = pybullet.getJointStates(self.body, self._movable, physicsClientId=self.client)
        posture = dict(zip(self._movable, (state[0] for state in states), strict=True))
        posture.update(zip(self.arm_joints, angles.ravel().tolist(), strict=True))
        still = [0.0] * len(posture)
        with self._gravity_as_the_base_has_it():
            torques = pybullet.calculateInverseDynamics(
                self.body, list(posture.values()), still, still, physicsClientId=self.client
            )
        by_joint = dict(zip(self._movable, torques, strict=True))
        return np.array([by_joint[joint] for joint in self.arm_joints]).reshape(2, -1)

    @contextmanager
    def _gravity_as_the_base_has_it(self) -> Iterator[None]:
        """Turn gravity into the base's frame, which is where PyBullet's inverse dynamics takes it to be."""
        if self._base_rotation is None:
            yield
            return
        parameters = pybullet.getPhysicsEngineParameters(physicsClientId=self.client)
        gravity = np.array([parameters[f"gravityAcceleration{axis}"] for axis in "XYZ"])
        pybullet.setGravity(*(self._base_rotation.T @ gravity), physicsClientId=self.client)
        yield
        pybullet.setGravity(*gravity, physicsClientId=self.client)

    def set_pad_friction(self, lateral: float, spinning: float) -> None:
        """Set the coefficients of friction of the pads; ``spinning`` (m) is the radius of the patch of contact."""
        for link in (link for hand in self.hands for link in hand):
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
        head = self.joints[NECK[-1].name]
        place, turn = pybullet.getLinkState(self.body, head, computeForwardKinematics=1, physicsClientId=self.client)[
            4:6
        ]
        rotation = np.array(pybullet.getMatrixFromQuaternion(turn)).reshape(3, 3)
        return np.array(place) + rotation @ self._eye - self.place, rotation @ self._look

    @property
    def place(self) -> FloatArray:
        """Where the robot's frame is in the world, as the rail measures it, shape [3], m."""
        return np.array([0.0, 0.0 if self.rail is None else self.rail.position, 0.0])

    def contact_force(self, side: int, body: int) -> float:
        """Return the normal force between a hand (0 left, 1 right) and another body, N."""
        points = pybullet.getContactPoints(self.body, body, physicsClientId=self.client)
        return float(sum(point[9] for point in points if point[3] in self.hands[side]))

    def touches_itself(self) -> bool:
        """Whether an arm touches the torso, the head or the other arm."""
        return bool(pybullet.getContactPoints(self.body, self.body, physicsClientId=self.client))

    def _load(self, description: Description, path: Path) -> int:
        """Load a description from ``path``, its own or that of a copy on a rail."""
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_SELF_COLLISION
        try:
            return int(
                pybullet.loadURDF(
                    str(path),
                    description.base_position.tolist(),
                    quaternion_of(description.base_rotation),
                    useFixedBase=True,
                    flags=flags,
                    physicsClientId=self.client,
                )
            )
        except pybullet.error as error:
            raise InvalidInputError(
                f"{description.path}: cannot be loaded: {error}; expected a robot's description with its meshes"
            ) from error

    def _limits(self, in_file: Sequence[float], name: str) -> FloatArray:
        """Return a limit of every arm joint, shape [2, 7]: the table's, or the file's if that is lower."""
        own = [getattr(joint, name) for side in SIDES for joint in arm(side)]
        stated = [in_file[joint] for joint in self.arm_joints]
        return np.array([min(a, b) if b > 0 else a for a, b in zip(own, stated, strict=True)]).reshape(2, -1)

    def _ancestors(self, link: int) -> list[int]:
        """Return a link and all that it hangs on, up to the base."""
        chain = [link]
        while chain[-1] >= 0:
            chain.append(self._parents[chain[-1]])
        return chain

    def _hold_waist_and_neck(self) -> None:
        for joint, angle in zip((WAIST, *NECK), (0.0, *_NECK_POSTURE), strict=True):
            index = self.joints[joint.name]
            pybullet.resetJointState(self.body, index, angle, physicsClientId=self.client)
            pybullet.setJointMotorControl2(
                self.body, index, pybullet.POSITION_CONTROL, angle, force=joint.effort, physicsClientId=self.client
            )

    def _let_neighbours_touch(self) -> None:
        """Switch off collisions between links a few joints apart, and leave all others on."""
        for link in range(len(self._parents)):
            for ancestor in self._ancestors(link)[1 : 1 + _NEIGHBOURS]:
                pybullet.setCollisionFilterPair(self.body, self.body, link, ancestor, 0, physicsClientId=self.client)
