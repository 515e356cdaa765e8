"""Damped-least-squares inverse kinematics for both hands at once, within the joints' limits.

A hand's task: its pad at a point; its axis within a cone about the inward normal of the face it presses; and,
where the plan asks for it, the turn of the palm about that normal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from sim.bodies.kinematics import ArmKinematics, HandPoses, cross

#: Metres that a radian of orientation counts for.
_ORIENTATION_WEIGHT: Final = 0.25


_DAMPING: Final = 0.02


#: How fast angles that the task leaves free go to the rest posture, a share of the way each iteration.
_REST_GAIN: Final = 0.03


_MAX_ITERATIONS: Final = 60


_LARGEST_STEP: Final = 0.3  # rad, each joint and iteration


_LARGEST_REACH: Final = 0.1  # m, each iteration


_LIMIT_MARGIN: Final = 0.02  # rad kept from the joints' limits


#: The cone is aimed at a little inside its edge, so that it is not left by rounding.
_CONE_SHARE: Final = 0.9


#: Not better by this share for so many iterations, a task is done as well as it can be.
_PROGRESS, _PATIENCE = 0.002, 8
_CLOSE_ENOUGH: Final = 1e-3  # m, and m of weighted orientation


@dataclass(frozen=True, eq=False)
class HandTask:
    """Where both hands are to be; the first axis of each array is the side, left before right.

    Attributes:
        pad: Middle of the pads in the robot's frame, shape [2, 3], m.
        normal: Inward unit normals of the pressed faces, shape [2, 3].
        cone: How far a hand's axis may lean from the normal, rad.
        palm: Where the palms shall point, as far as they can while turning about the normal, shape [2, 3];
            ``None`` leaves them free.
    """

    pad: FloatArray
    normal: FloatArray
    cone: float
    palm: FloatArray | None = None

    @cached_property
    def across(self) -> FloatArray:
        """What takes a hand's axis to its cross product with the normal, shape [2, 3, 3]."""
        x, y, z = self.normal.T
        matrix = np.zeros((len(self.normal), 3, 3))
        matrix[:, 0, 1], matrix[:, 0, 2], matrix[:, 1, 2] = z, -y, x
        return np.asarray(matrix - matrix.swapaxes(1, 2))

    @cached_property
    def palm_plane(self) -> FloatArray:
        """Unit vectors in the face: where the palm shall point, and a quarter turn on about the normal, [2, 3, 2]."""
        assert self.palm is not None
        flat = self.palm - self.normal * np.vecdot(self.palm, self.normal)[:, None]
        return np.stack([flat, cross(self.normal, self.palm)], axis=2)


@dataclass(frozen=True, eq=False)
class Solution:
    """Joint angles for a task, and what they miss.

    Attributes:
        angles: Shape [2, 7], rad.
        position_error: Distance of each pad from its place, shape [2], m.
        cone_error: How far each hand's axis is outside the cone, shape [2], rad.
        palm_error: How far each palm is turned off, shape [2], rad; zeros if the task leaves it free.
        hands: Where the hands are at these angles.
    """

    angles: FloatArray
    position_error: FloatArray
    cone_error: FloatArray
    palm_error: FloatArray
    hands: HandPoses

    def reaches(self, position: float = 0.006, angle: float = 0.1) -> bool:
        """Whether both hands are within ``position`` (m) and ``angle`` (rad) of what the task asks."""
        turned = np.maximum(self.cone_error, self.palm_error)
        return bool((self.position_error < position).all() and (turned < angle).all())


def solve(kinematics: ArmKinematics, task: HandTask, start: FloatArray, rest: FloatArray) -> Solution:
    """Return joint angles near ``start`` that do a task as well as the joints' limits let them.

    Args:
        kinematics: Of both arms.
        task: Where the hands are to be.
        start: Joint angles to begin from, shape [2, 7], rad.
        rest: Posture preferred where the task leaves a choice, shape [2, 7], rad.
    """
    lower, upper = kinematics.lower + _LIMIT_MARGIN, kinematics.upper - _LIMIT_MARGIN
    angles = _within(start, lower, upper)
    damping = _DAMPING**2 * np.eye(6 if task.palm is None else 7)
    least, idle = np.inf, 0
    for _ in range(_MAX_ITERATIONS):
        hands = kinematics.hands(angles)
        error, jacobian = _residual(hands, task)
        worst = float(np.abs(error).max())
        # Errors are cut at a reach, so nothing can be told of progress beyond it.
        idle = 0 if worst < (1 - _PROGRESS) * least or worst >= _LARGEST_REACH else idle + 1
        least = min(worst, least)
        if worst < _CLOSE_ENOUGH or idle == _PATIENCE:
            return _solution(task, angles, hands)
        pull = _REST_GAIN * (rest - angles)
        square = jacobian @ jacobian.swapaxes(1, 2) + damping
        # The task's own part, and of the pull towards rest what does not disturb the task.
        weights = np.linalg.solve(square, error[..., None] - jacobian @ pull[..., None])
        step = (jacobian.swapaxes(1, 2) @ weights)[..., 0] + pull
        angles = _within(angles + _within(step, -_LARGEST_STEP, _LARGEST_STEP), lower, upper)
    return _solution(task, angles, kinematics.hands(angles))


def _residual(hands: HandPoses, task: HandTask) -> tuple[FloatArray, FloatArray]:
    """Return what is still to be done, shape [2, rows], and how the joints do it, shape [2, rows, 7]."""
    n_arms, _, n_joints = hands.jacobian.shape
    n_rows = 6 if task.palm is None else 7
    error, jacobian = np.empty((n_arms, n_rows)), np.empty((n_arms, n_rows, n_joints))
    to_go = task.pad - hands.pad
    distance = np.sqrt(np.vecdot(to_go, to_go))
    error[:, :3] = to_go * np.minimum(1.0, _LARGEST_REACH / np.maximum(distance, 1e-9))[:, None]
    jacobian[:, :3] = hands.jacobian[:, :3]
    lean, direction = _lean(hands.axis, task)
    excess = np.maximum(0.0, lean - _CONE_SHARE * task.cone)
    turning = _ORIENTATION_WEIGHT * hands.jacobian[:, 3:]
    if excess.any():
        error[:, 3:6] = direction * (_ORIENTATION_WEIGHT * excess)[:, None]
        jacobian[:, 3:6] = turning * (excess > 0)[:, None, None]
    else:
        error[:, 3:6] = jacobian[:, 3:6] = 0.0
    if task.palm is not None:
        error[:, 6] = _ORIENTATION_WEIGHT * _within(_spin(hands.palm, task), -0.5, 0.5)
        jacobian[:, 6:] = task.normal[:, None] @ turning
    return error, jacobian


def _within(values: FloatArray, lower: FloatArray | float, upper: FloatArray | float) -> FloatArray:
    """Return ``np.clip``, which costs five times as much for so few values."""
    return np.minimum(np.maximum(values, lower), upper)


def _lean(axis: FloatArray, task: HandTask) -> tuple[FloatArray, FloatArray]:
    """Return the angle from the hands' axes to the normals, shape [2], and the unit vector to turn about, [2, 3]."""
    across = (task.across @ axis[..., None])[..., 0]
    sine = np.sqrt(np.vecdot(across, across))
    return np.arctan2(sine, np.vecdot(axis, task.normal)), across / np.maximum(sine, 1e-9)[:, None]


def _spin(palm: FloatArray, task: HandTask) -> FloatArray:
    """Return the angle about the normals from the palms to where they shall point, shape [2]."""
    along, aside = (palm[:, None] @ task.palm_plane)[:, 0].T
    return np.asarray(np.arctan2(-aside, along))


def _solution(task: HandTask, angles: FloatArray, hands: HandPoses) -> Solution:
    lean, _ = _lean(hands.axis, task)
    spin = np.zeros(len(angles)) if task.palm is None else np.abs(_spin(hands.palm, task))
    miss = task.pad - hands.pad
    return Solution(angles, np.sqrt(np.vecdot(miss, miss)), np.maximum(0.0, lean - task.cone), spin, hands)
