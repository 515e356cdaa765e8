"""Damped-least-squares inverse kinematics for both hands at once, within the joints' limits.

A hand's task: its pad at a point; its axis within a cone about the inward normal of the face it presses; and,
where the plan asks for it, the turn of the palm about that normal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference.kernels.compilation import compiled_if_installed
from sim.bodies.arm_kernels import Arms, HandPoses, crossed, dot, hands_at
from sim.bodies.kinematics import ArmKinematics

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


class _Task(NamedTuple):
    """What hands have to do, as ``HandTask`` tells; where they do not turn, ``palm`` says nothing."""

    pad: FloatArray
    normal: FloatArray
    palm: FloatArray
    cone: float
    turns: bool


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

    def given(values: FloatArray) -> FloatArray:
        return np.ascontiguousarray(values, float)

    lower, upper = kinematics.lower + _LIMIT_MARGIN, kinematics.upper - _LIMIT_MARGIN
    palm = task.normal if task.palm is None else task.palm
    wanted = _Task(given(task.pad), given(task.normal), given(palm), task.cone, task.palm is not None)
    angles, hands = _solved(kinematics.arms, given(lower), given(upper), wanted, given(start), given(rest))
    lean, _, spin = _missed(hands, wanted)
    miss = task.pad - hands.pad
    outside = np.maximum(0.0, lean - task.cone)
    return Solution(angles, np.sqrt(np.vecdot(miss, miss)), outside, np.abs(spin), hands)


@compiled_if_installed
def _missed(hands: HandPoses, task: _Task) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return by what hands miss a task.

    They are the angle from each hand's axis to the normal, shape [arms], rad; the unit vector to turn about against it,
    shape [arms, 3]; and how far each palm is turned off, shape [arms], rad, zero where the task leaves it free.
    """
    n_arms = len(hands.pad)
    lean, direction, spin = np.empty(n_arms), np.empty((n_arms, 3)), np.zeros(n_arms)
    for arm in range(n_arms):
        axis, normal = hands.axis[arm], task.normal[arm]
        across = crossed(axis, normal)
        sine = math.sqrt(dot(across, across))
        lean[arm] = math.atan2(sine, dot(axis, normal))
        for row in range(3):
            direction[arm, row] = across[row] / max(sine, 1e-9)
        if task.turns:
            wanted, palm = task.palm[arm], hands.palm[arm]
            along = dot(palm, wanted) - dot(palm, normal) * dot(wanted, normal)
            spin[arm] = math.atan2(-dot(palm, crossed(normal, wanted)), along)
    return lean, direction, spin


@compiled_if_installed
def _solved(
    arms: Arms, lower: FloatArray, upper: FloatArray, task: _Task, start: FloatArray, rest: FloatArray
) -> tuple[FloatArray, HandPoses]:
    """Return joint angles near ``start`` that do a task, and where the hands are then.

    All arms stop together.
    """
    angles = np.minimum(np.maximum(start, lower), upper)
    n_arms, n_joints = angles.shape
    n_rows = 7 if task.turns else 6
    error, jacobian = np.empty((n_arms, n_rows)), np.empty((n_arms, n_rows, n_joints))
    least, idle = np.inf, 0
    hands = hands_at(arms, angles)
    for _ in range(_MAX_ITERATIONS):
        _set_residual(hands, task, error, jacobian)
        worst = np.abs(error).max()
        # Errors are cut at a reach, so nothing can be told of progress beyond it.
        idle = 0 if worst < (1 - _PROGRESS) * least or worst >= _LARGEST_REACH else idle + 1
        least = min(worst, least)
        if worst < _CLOSE_ENOUGH or idle == _PATIENCE:
            break
        for arm in range(n_arms):
            _take_step(jacobian[arm], error[arm], angles[arm], rest[arm], lower[arm], upper[arm])
        hands = hands_at(arms, angles)
    return angles, hands


@compiled_if_installed
def _set_residual(hands: HandPoses, task: _Task, error: FloatArray, jacobian: FloatArray) -> None:
    """Set what is still to be done, shape [arms, rows], and how the joints do it, shape [arms, rows, joints]."""
    lean, direction, spin = _missed(hands, task)
    for arm in range(len(error)):
        here, there = hands.pad[arm], task.pad[arm]
        to_go = (there[0] - here[0], there[1] - here[1], there[2] - here[2])
        share = min(1.0, _LARGEST_REACH / max(math.sqrt(dot(to_go, to_go)), 1e-9))
        excess = max(0.0, lean[arm] - _CONE_SHARE * task.cone)
        turning = _ORIENTATION_WEIGHT if excess > 0 else 0.0
        for row in range(3):
            error[arm, row], error[arm, 3 + row] = share * to_go[row], direction[arm, row] * (turning * excess)
            for joint in range(jacobian.shape[2]):
                jacobian[arm, row, joint] = hands.jacobian[arm, row, joint]
                jacobian[arm, 3 + row, joint] = turning * hands.jacobian[arm, 3 + row, joint]
        if task.turns:
            error[arm, 6] = _ORIENTATION_WEIGHT * min(max(spin[arm], -0.5), 0.5)
            for joint in range(jacobian.shape[2]):
                jacobian[arm, 6, joint] = _ORIENTATION_WEIGHT * dot(task.normal[arm], hands.jacobian[arm, 3:, joint])


@compiled_if_installed
def _take_step(
    jacobian: FloatArray, error: FloatArray, angles: FloatArray, rest: FloatArray, lower: FloatArray, upper: FloatArray
) -> None:
    """Move an arm's angles by a step of damped least squares, and towards rest by what does not disturb the task."""
    n_rows, n_joints = jacobian.shape
    square, weights, pull = np.empty((n_rows, n_rows)), error.copy(), np.empty(n_joints)
    for joint in range(n_joints):
        pull[joint] = _REST_GAIN * (rest[joint] - angles[joint])
    # Cholesky's factor of the damped square, a row after the other, and the right side with it: Numba's own solver
    # would need SciPy.
    for row in range(n_rows):
        for joint in range(n_joints):
            weights[row] -= jacobian[row, joint] * pull[joint]
        for column in range(row + 1):
            left = _DAMPING**2 if row == column else 0.0
            for joint in range(n_joints):
                left += jacobian[row, joint] * jacobian[column, joint]
            for before in range(column):
                left -= square[row, before] * square[column, before]
            square[row, column] = math.sqrt(left) if row == column else left / square[column, column]
        for before in range(row):
            weights[row] -= square[row, before] * weights[before]
        weights[row] /= square[row, row]
    for row in range(n_rows - 1, -1, -1):
        for after in range(row + 1, n_rows):
            weights[row] -= square[after, row] * weights[after]
        weights[row] /= square[row, row]
    for joint in range(n_joints):
        step = pull[joint]
        for row in range(n_rows):
            step += weights[row] * jacobian[row, joint]
        moved = angles[joint] + min(max(step, -_LARGEST_STEP), _LARGEST_STEP)
        angles[joint] = min(max(moved, lower[joint]), upper[joint])
