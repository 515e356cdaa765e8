"""Loops over arms and joints that Numba compiles: where hands are, and how they move with the joints."""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference.kernels.compilation import compiled_if_installed

Vector: TypeAlias = FloatArray | tuple[float, float, float]


class Arms(NamedTuple):
    """What is known of arms, side after side, at joint angles zero; lengths in m.

    Attributes:
        positions: Of the joints, shape [arms, joints, 3].
        axes: Unit vectors of the joints, shape [arms, joints, 3].
        hand_axis: Unit vectors out of the hands, shape [arms, 3].
        palm: Unit vectors normal to the palms, shape [arms, 3].
        pads: Middle of the pads, shape [arms, 3].
    """

    positions: FloatArray
    axes: FloatArray
    hand_axis: FloatArray
    palm: FloatArray
    pads: FloatArray


class HandPoses(NamedTuple):
    """Both hands at some joint angles; the first axis of each array is the side, left before right.

    Attributes:
        pad: Middle of the pad on the knuckles in the robot's frame, shape [2, 3], m.
        axis: Unit vector out of the hand, to the face that it presses, shape [2, 3].
        palm: Unit vector normal to the palm, shape [2, 3].
        rotation: From the hand's frame at joint angle zero to its frame now, shape [2, 3, 3].
        jacobian: How pad (first three rows, m/rad) and orientation (last three) move with the joints, shape [2, 6, 7].
        joints: Position of each joint, shape [2, 7, 3], m.
    """

    pad: FloatArray
    axis: FloatArray
    palm: FloatArray
    rotation: FloatArray
    jacobian: FloatArray
    joints: FloatArray


@compiled_if_installed
def hands_at(arms: Arms, angles: FloatArray) -> HandPoses:
    """Return where the hands are at joint angles of shape [arms, joints], rad: each joint turns all that follows."""
    n_arms, n_joints = angles.shape
    joints, jacobian = np.empty((n_arms, n_joints, 3)), np.empty((n_arms, 6, n_joints))
    pad, axis, palm = np.empty((n_arms, 3)), np.empty((n_arms, 3)), np.empty((n_arms, 3))
    rotation = np.zeros((n_arms, 3, 3))
    for arm in range(n_arms):
        turn, place = rotation[arm], pad[arm]
        for row in range(3):
            turn[row, row], place[row] = 1.0, arms.positions[arm, 0, row]
        for joint in range(n_joints):
            here, about = arms.positions[arm, joint], arms.axes[arm, joint]
            following = arms.positions[arm, joint + 1] if joint + 1 < n_joints else arms.pads[arm]
            to_next = (following[0] - here[0], following[1] - here[1], following[2] - here[2])
            sine, rest = math.sin(angles[arm, joint]), 1.0 - math.cos(angles[arm, joint])
            for row in range(3):
                joints[arm, joint, row], jacobian[arm, 3 + row, joint] = place[row], dot(turn[row], about)
                # Rodrigues' formula, a row at a time.
                aside = crossed(turn[row], about)
                further = crossed(aside, about)
                for column in range(3):
                    turn[row, column] += sine * aside[column] + rest * further[column]
                place[row] += dot(turn[row], to_next)
        for row in range(3):
            axis[arm, row], palm[arm, row] = dot(turn[row], arms.hand_axis[arm]), dot(turn[row], arms.palm[arm])
        for joint in range(n_joints):
            at = joints[arm, joint]
            lever = (place[0] - at[0], place[1] - at[1], place[2] - at[2])
            moves = crossed(jacobian[arm, 3:, joint], lever)
            for row in range(3):
                jacobian[arm, row, joint] = moves[row]
    return HandPoses(pad, axis, palm, rotation, jacobian, joints)


@compiled_if_installed
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product of two vectors with three elements."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled_if_installed
def crossed(a: Vector, b: Vector) -> tuple[float, float, float]:
    """Return the cross product of two vectors with three elements."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
