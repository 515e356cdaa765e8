"""What a box weighs, by what it adds to the joints' torques while it is held in the air."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from sim.bodies.kinematics import cross
from sim.bodies.robot import JOINT_DAMPING, RobotBody
from sim.manipulation.impedance_control import TIME_STEP

#: One of so many steps is looked at.
_EVERY: Final = 4
_GRAVITY: Final = 9.81  # m/s²
#: Seed of what the robot's sensors were built with.
_THE_ROBOTS: Final = 1


@dataclass(frozen=True, eq=False)
class TorqueSensors:
    """What the joints' sensors say of their torques.

    Attributes:
        offsets: What each is off by, shape [2, 7], N·m.
        gains: By what each multiplies, shape [2, 7].
        noise: Standard deviation from step to step, N·m.
    """

    offsets: FloatArray
    gains: FloatArray
    noise: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> TorqueSensors:
        """Return the sensors of the robot as they are in one trial: gains stay, offsets drift from trial to trial.

        They differ by 1 %, and by half a newton metre, which is half a percent of the limit of the robot's joints.
        """
        gains = np.random.default_rng(_THE_ROBOTS).normal(1.0, 0.01, (2, 7))
        return cls(rng.normal(0.0, 0.5, (2, 7)), gains, noise=0.5)

    def sensed(self, torques: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return what is sensed of torques, both of shape [steps, 2, 7], N·m."""
        return self.gains * torques + self.offsets + rng.normal(0.0, self.noise, torques.shape)


class Scales:
    """Weighs what both hands hold.

    What is left of a joint's torque once the arms' own motion is accounted for is due to the hands' contacts:
    τ − τ(q, q̇, q̈) = Jᵀ w. For each hand it gives, by least squares, the force where its pad touches the box and the
    moment about the normal there. From rest to rest a box is not accelerated on the mean, so the mean of the upward
    forces is its weight. Sensors are tared while the hands touch nothing.

    Args:
        robot: The robot.
        sensors: Of its joints.
    """

    def __init__(self, robot: RobotBody, sensors: TorqueSensors) -> None:
        self.robot, self.sensors = robot, sensors
        self.clear()

    def clear(self) -> None:
        """Forget what was felt."""
        self._free: list[FloatArray] = []
        self._forces: list[float] = []

    def tare(self, angles: FloatArray, velocities: FloatArray, torques: FloatArray, rng: np.random.Generator) -> None:
        """Take in a part of a motion in which the hands touch nothing; as for ``feel``."""
        self._free += [left for _, left in self._residuals(angles, velocities, torques, rng)]

    def feel(self, angles: FloatArray, velocities: FloatArray, torques: FloatArray, rng: np.random.Generator) -> None:
        """Take in a part of a motion in which the hands hold what is to be weighed.

        Args:
            angles: Of the joints, shape [steps, 2, 7], rad.
            velocities: Of the same shape, rad/s.
            torques: Of the same shape, N·m.
            rng: Of the sensors' noise.
        """
        empty = np.mean(self._free, axis=0) if self._free else 0.0
        for posture, left in self._residuals(angles, velocities, torques, rng):
            self._forces.append(float(self._hand_forces(posture, left - empty)[:, 2].sum()))

    def mass(self) -> float | None:
        """Return the mass of what was held, kg; ``None`` if nothing was, or less than nothing was felt."""
        mean = float(np.mean(self._forces)) / _GRAVITY if self._forces else 0.0
        return mean if mean > 0 else None

    def _residuals(
        self, angles: FloatArray, velocities: FloatArray, torques: FloatArray, rng: np.random.Generator
    ) -> list[tuple[FloatArray, FloatArray]]:
        """Return joint angles and the torques that contacts account for, each of shape [2, 7], of some of the steps."""
        # What a torque does shows in the next step's speed.
        accelerations = np.diff(velocities, axis=0) / TIME_STEP
        sensed = self.sensors.sensed(torques, rng) - JOINT_DAMPING * velocities
        return [
            (angles[step], sensed[step] - self.robot.torques_of(angles[step], velocities[step], accelerations[step]))
            for step in range(0, len(accelerations), _EVERY)
        ]

    def _hand_forces(self, angles: FloatArray, torques: FloatArray) -> FloatArray:
        """Return the forces of the hands on what they hold, shape [2, 3], N, at joint angles and torques, [2, 7]."""
        hands = self.robot.kinematics.hands(angles)
        between = hands.pad[1] - hands.pad[0]
        normal = np.array([between, -between]) / np.linalg.norm(between)
        reach = self.robot.kinematics.pad_radius[:, None] * normal
        moving, turning = hands.jacobian[:, :3], hands.jacobian[:, 3:]
        at_contact = moving + cross(turning.swapaxes(1, 2), reach[:, None]).swapaxes(1, 2)
        about_normal = normal[:, None] @ turning
        design = np.concatenate([at_contact, about_normal], axis=1).swapaxes(1, 2)
        return np.array(
            [np.linalg.lstsq(each, torque, rcond=None)[0][:3] for each, torque in zip(design, torques, strict=True)]
        )
