"""Damped-least-squares inverse kinematics for both hands at once, within the joints' limits.

A hand's task: its pad at a point; its axis within a cone about the inward normal of the face it presses; and,
where the plan asks for it, the turn of the palm about that normal.
"""

from __future__ import annotations

from dataclasses import dataclass
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


_CLOSE_ENOUGH: Final = 5e-4  # m, and m of weighted orientation


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


@dataclass(frozen=True, eq=False)
class Solution:
    """Joint angles for a task, and what they miss.

    Attributes:
        angles: Shape [2, 7], rad.
        position_error: Distance of each pad from its place, shape [2], m.
        cone_error: How far each hand's axis is outside the cone, shape [2], rad.
        palm_error: How far each palm is turned off, shape [2], rad; zeros if the task leaves it free.
    """

    angles: FloatArray
    position_error: FloatArray
    cone_error: FloatArray
    palm_error: FloatArray

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
    angles = np.clip(start, lower, upper)
    for _ in range(_MAX_ITERATIONS):
        error, jacobian = _residual(kinematics.hands(angles), task)
        if np.abs(error).max() < _CLOSE_ENOUGH:
            break
        pull = _REST_GAIN * (rest - angles)
        square = jacobian @ jacobian.transpose(0, 2, 1) + _DAMPING**2 * np.eye(error.shape[1])
        # The task's own part, and of the pull towards rest what does not disturb the task.
        weights = np.linalg.solve(square, (error - (jacobian @ pull[..., None])[..., 0])[..., None])
        step = (jacobian.transpose(0, 2, 1) @ weights)[..., 0] + pull
        angles = np.clip(angles + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP), lower, upper)
    return _solution(kinematics, task, angles)


def _residual(hands: HandPoses, task: HandTask) -> tuple[FloatArray, FloatArray]:
    """Return what is still to be done, shape [2, rows], and how the joints do it, shape [2, rows, 7]."""
    to_go = task.pad - hands.pad
    distance = np.sqrt((to_go * to_go).sum(axis=1, keepdims=True))
    to_go = to_go * np.minimum(1.0, _LARGEST_REACH / np.maximum(distance, 1e-9))
    lean, direction = _lean(hands.axis, task.normal)
    excess = np.maximum(0.0, lean - _CONE_SHARE * task.cone)
    rows = [to_go, _ORIENTATION_WEIGHT * direction * excess[:, None]]
    turning = _ORIENTATION_WEIGHT * hands.jacobian[:, 3:]
    jacobians = [hands.jacobian[:, :3], turning * (excess > 0)[:, None, None]]
    if task.palm is not None:
        spin = np.clip(_spin(hands.palm, task.palm, task.normal), -0.5, 0.5)
        rows.append(_ORIENTATION_WEIGHT * spin[:, None])
        jacobians.append(task.normal[:, None] @ turning)
    return np.concatenate(rows, axis=1), np.concatenate(jacobians, axis=1)


def _lean(axis: FloatArray, normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the angle from ``axis`` to ``normal``, shape [2], and the unit vector to turn about, shape [2, 3]."""
    across = cross(axis, normal)
    sine = np.sqrt((across * across).sum(axis=1))
    return np.arctan2(sine, (axis * normal).sum(axis=1)), across / np.maximum(sine, 1e-9)[:, None]


def _spin(palm: FloatArray, wanted: FloatArray, normal: FloatArray) -> FloatArray:
    """Return the angle about ``normal`` from ``palm`` to ``wanted``, shape [2]."""
    flat = palm - normal * (palm * normal).sum(axis=1, keepdims=True)
    sine = (cross(flat, wanted) * normal).sum(axis=1)
    return np.asarray(np.arctan2(sine, (flat * wanted).sum(axis=1)))


def _solution(kinematics: ArmKinematics, task: HandTask, angles: FloatArray) -> Solution:
    hands = kinematics.hands(angles)
    lean, _ = _lean(hands.axis, task.normal)
    spin = np.zeros(len(angles)) if task.palm is None else np.abs(_spin(hands.palm, task.palm, task.normal))
    return Solution(angles, np.linalg.norm(task.pad - hands.pad, axis=1), np.maximum(0.0, lean - task.cone), spin)
