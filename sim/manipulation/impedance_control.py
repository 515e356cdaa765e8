"""Impedance control of both arms: springs and dampers at the joints, gravity and grip fed forward, limits kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from sim.bodies.robot import RobotBody

TIME_STEP: Final = 1 / 240  # s; a longer step makes such stiff springs unstable
_STIFFNESS: Final = np.array([900.0, 900.0, 500.0, 600.0, 200.0, 120.0, 120.0])  # N·m/rad
_DAMPING: Final = np.array([60.0, 60.0, 16.0, 20.0, 3.0, 2.0, 1.5])  # N·m·s/rad
#: The share of a joint's speed that motions are planned with, on the mean: a curve from rest to rest peaks at 1.5.
_SPEED_SHARE: Final = 0.55
#: No more than this share is ever asked for; the rest is for the arms to catch up.
_PEAK_SHARE: Final = 0.90
_STEPS_PER_REFERENCE: Final = 4


@dataclass(frozen=True, eq=False)
class JointTarget:
    """A point of a motion in joint space.

    Attributes:
        angles: Shape [2, 7], rad.
        feedforward: Torques against gravity and for the grip, shape [2, 7], N·m.
        seconds: Time to get there; longer if a joint's speed asks for it.
        still: Time to wait there, s.
    """

    angles: FloatArray
    feedforward: FloatArray
    seconds: float
    still: float = 0.0


@dataclass
class Exertion:
    """How near the joints came to their limits.

    Attributes:
        velocity: Greatest speed of each joint as a share of its limit, shape [2, 7].
        effort: Greatest torque of each joint as a share of its limit, shape [2, 7].
        saturated_steps: Steps in which some joint's torque was cut at its limit.
        steps: Steps of the simulation.
    """

    velocity: FloatArray = field(default_factory=lambda: np.zeros((2, 7)))
    effort: FloatArray = field(default_factory=lambda: np.zeros((2, 7)))
    saturated_steps: int = 0
    steps: int = 0

    def add(self, velocities: FloatArray, torques: FloatArray, robot: RobotBody) -> None:
        """Take account of some steps: absolute speeds and torques asked for, shape [steps, 14], rad/s and N·m."""
        shape = robot.effort.shape
        velocity, effort = velocities.max(axis=0).reshape(shape), torques.max(axis=0).reshape(shape)
        self.velocity = np.maximum(self.velocity, velocity / robot.velocity)
        self.effort = np.maximum(self.effort, np.minimum(effort / robot.effort, 1.0))
        self.saturated_steps += int((torques > robot.effort.ravel()).any(axis=1).sum())
        self.steps += len(torques)


class ArmController:
    """Drives the arms from target to target.

    Args:
        robot: The robot.
        advance: Takes the simulation one step on.

    Attributes:
        exertion: How near the joints came to their limits.
        on_motion: Called after each motion from rest to rest with the angles (rad), speeds (rad/s) and torques (N·m) of
            its steps, each of shape [steps, 2, 7].
    """

    def __init__(self, robot: RobotBody, advance: Callable[[], None]) -> None:
        self.robot = robot
        self._advance = advance
        self.exertion = Exertion()
        self.on_motion: Callable[[FloatArray, FloatArray, FloatArray], None] | None = None
        self._springs, self._dampers = np.tile(_STIFFNESS, 2).tolist(), np.tile(_DAMPING, 2).tolist()
        self.reference, _ = robot.state()
        self.feedforward = robot.gravity_torques(self.reference)

    def run(self, targets: Sequence[JointTarget]) -> None:
        """Go through ``targets`` in order, smoothly, and come to rest where one asks to wait, and at the end."""
        first = 0
        for last, target in enumerate(targets):
            if target.still or last == len(targets) - 1:
                self._sweep(targets[first : last + 1])
                self.hold(target.still)
                first = last + 1

    def hold(self, seconds: float) -> None:
        """Stay where the arms are commanded to be."""
        command = _STIFFNESS * self.reference + self.feedforward
        self._follow(np.broadcast_to(command, (round(seconds / TIME_STEP), *command.shape)))

    def _sweep(self, targets: Sequence[JointTarget]) -> None:
        """Go through ``targets`` along cubic curves, from rest to rest."""
        angles = np.array([self.reference, *(target.angles for target in targets)])
        loads = np.array([self.feedforward, *(target.feedforward for target in targets)])
        seconds, slopes = self._timed(angles, np.array([target.seconds for target in targets]))
        legs = [
            _commands(angles[leg : leg + 2], slopes[leg], loads[leg : leg + 2], float(time))
            for leg, time in enumerate(seconds)
        ]
        self._follow(np.concatenate(legs))
        self.reference, self.feedforward = angles[-1], loads[-1]

    def _timed(self, angles: FloatArray, least: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how long each leg takes, s, and its slopes at both ends, shape [legs, 2, 2, 7], rad a leg.

        No leg is quicker than ``least``, and none of its joints quicker than planned for.
        """
        ways = np.diff(angles, axis=0)
        slowest = (np.abs(ways) / (_SPEED_SHARE * self.robot.velocity)).max(axis=(1, 2))
        seconds = np.maximum(slowest, least)
        duration = seconds[:, None, None]
        # Between two legs the speed is their mean, weighted so that the curve does not swing.
        speeds = np.zeros_like(angles)
        speeds[1:-1] = (ways[1:] + ways[:-1]) / (duration[1:] + duration[:-1])
        slopes = np.stack([speeds[:-1] * duration, speeds[1:] * duration], axis=1)
        # Where legs differ much the curve may still be quicker between its ends; slower as a whole, it is not.
        part = np.linspace(0.0, 1.0, 9)[:, None, None, None]
        square, cube = _cubic(ways, slopes[:, 0], slopes[:, 1])
        peak = np.abs((slopes[:, 0] + part * (2 * square + 3 * part * cube)) / duration).max(axis=(0, 1))
        excess = float((peak / (_PEAK_SHARE * self.robot.velocity)).max())
        return seconds * max(1.0, excess), slopes

    def _follow(self, commands: FloatArray) -> None:
        """Follow commands, one a step: the torques that are wanted at angle zero and at rest, [steps, 2, 7], N·m.

        Seven joints twice are too few for arrays to pay, so the law of control is written out in numbers.
        """
        if not len(commands):
            return
        robot, advance, springs, dampers = self.robot, self._advance, self._springs, self._dampers
        most = robot.effort.ravel()
        least = float(most.min())
        angles, velocities, torques = [], [], []
        for command in commands.reshape(len(commands), -1).tolist():
            turns, speeds, *_ = zip(*robot.joint_states(), strict=True)
            wanted = [
                torque - spring * turn - damper * speed
                for torque, spring, damper, turn, speed in zip(command, springs, dampers, turns, speeds, strict=True)
            ]
            weak = max(wanted) > least or min(wanted) < -least
            robot.drive(np.clip(wanted, -most, most).tolist() if weak else wanted)
            advance()
            angles.append(turns)
            velocities.append(speeds)
            torques.append(wanted)
        self.exertion.add(np.abs(velocities), np.abs(torques), robot)
        if self.on_motion is not None:
            applied = np.clip(np.reshape(torques, commands.shape), -robot.effort, robot.effort)
            self.on_motion(np.reshape(angles, applied.shape), np.reshape(velocities, applied.shape), applied)


def _commands(ends: FloatArray, slopes: FloatArray, loads: FloatArray, seconds: float) -> FloatArray:
    """Return what to follow along one cubic: angles and slopes (rad a leg) at its two ends, each of shape [2, 2, 7]."""
    steps = max(1, round(seconds / TIME_STEP))
    way = ends[1] - ends[0]
    square, cube = _cubic(way, slopes[0], slopes[1])
    part = np.minimum(1.0, (np.arange(0, steps, _STEPS_PER_REFERENCE) + _STEPS_PER_REFERENCE / 2) / steps)
    part = part[:, None, None]
    reference = ends[0] + part * (slopes[0] + part * (square + part * cube))
    speed = (slopes[0] + part * (2 * square + 3 * part * cube)) / seconds
    rows = _STIFFNESS * reference + _DAMPING * speed + loads[0] + part * (loads[1] - loads[0])
    return np.repeat(rows, _STEPS_PER_REFERENCE, axis=0)[:steps]


def _cubic(way: FloatArray, first: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the coefficients of t² and t³ of the curve over ``way`` with slopes ``first`` and ``last`` at its ends."""
    return 3 * way - 2 * first - last, first + last - 2 * way
