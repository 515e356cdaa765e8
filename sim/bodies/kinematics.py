"""Where both hands are, and how they move with the joints: products of rotations about the joints' axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray

#: Takes all products of two vectors' elements to their cross product.
_CROSS: Final = np.cross(np.eye(3)[:, None], np.eye(3)[None]).reshape(9, 3)


@dataclass(frozen=True, eq=False)
class HandPoses:
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


class ArmKinematics:
    """Forward kinematics of both arms at once.

    Args:
        positions: Of the joints at angle zero in the robot's frame, shape [2, 7, 3], m.
        axes: Unit vectors of the joints at angle zero, shape [2, 7, 3].
        lower: Least joint angles, shape [2, 7], rad.
        upper: Greatest joint angles, shape [2, 7], rad.
        hand_axis: Unit vectors out of the hands at joint angles zero, shape [2, 3].
        palm: Unit vectors normal to the palms at joint angles zero, shape [2, 3].
        pads: Middle of the pads at joint angles zero, shape [2, 3], m.
        pad_radius: Of the pads, shape [2], m.
    """

    def __init__(
        self,
        positions: FloatArray,
        axes: FloatArray,
        lower: FloatArray,
        upper: FloatArray,
        *,
        hand_axis: FloatArray,
        palm: FloatArray,
        pads: FloatArray,
        pad_radius: FloatArray,
    ) -> None:
        self.positions, self.axes, self.lower, self.upper = positions, axes, lower, upper
        self.hand_axis, self.pad_radius = hand_axis, pad_radius
        self._hands = {"hand_axis": hand_axis, "palm": palm, "pads": pads, "pad_radius": pad_radius}
        self._begin = np.zeros((len(positions), 4, 4)) + np.eye(4)
        self._begin[:, :3, 3] = positions[:, 0]
        self._hand_vectors = np.stack([hand_axis, palm], axis=2)
        self._moves = self._coefficients(np.diff(np.concatenate([positions, pads[:, None]], axis=1), axis=1))

    def _coefficients(self, to_next: FloatArray) -> FloatArray:
        """Return what a joint's move is made of: of 1, sin q and 1 − cos q, shape [2, 7, 3, 16].

        Rodrigues' formula: R(q) = 1 + sin q K + (1 − cos q) K², with K the cross product with the axis. A move turns
        by it, and goes on to the next joint, R(q) · ``to_next`` (shape [2, 7, 3], m).
        """
        axes = self.axes
        cross = np.zeros((*axes.shape[:2], 3, 3))
        cross[..., 0, 1], cross[..., 0, 2] = -axes[..., 2], axes[..., 1]
        cross[..., 1, 0], cross[..., 1, 2] = axes[..., 2], -axes[..., 0]
        cross[..., 2, 0], cross[..., 2, 1] = -axes[..., 1], axes[..., 0]
        parts = np.zeros((*axes.shape[:2], 3, 4, 4))
        parts[..., :3, :3] = np.stack([np.broadcast_to(np.eye(3), cross.shape), cross, cross @ cross], axis=2)
        parts[..., :3, 3:] = parts[..., :3, :3] @ to_next[:, :, None, :, None]
        parts[..., 0, 3, 3] = 1.0
        return parts.reshape(*axes.shape[:2], 3, 16)

    def limited(self, lower: FloatArray, upper: FloatArray) -> ArmKinematics:
        """Return the same arms with other limits, shape [2, 7], rad."""
        return ArmKinematics(self.positions, self.axes, lower, upper, **self._hands)

    def repeated(self, number: int) -> ArmKinematics:
        """Return the arms of ``number`` equal robots, side after side, to be solved for at once."""
        arms = (self.positions, self.axes, self.lower, self.upper)

        def again(values: FloatArray) -> FloatArray:
            return np.tile(values, (number, *[1] * (values.ndim - 1)))

        return ArmKinematics(*map(again, arms), **{name: again(values) for name, values in self._hands.items()})

    def hands(self, angles: FloatArray) -> HandPoses:
        """Return the poses of both hands at joint angles of shape [2, 7] (rad)."""
        n_arms, n_joints = angles.shape
        waves = np.empty((n_arms, n_joints, 1, 3))
        waves[..., 0, 0], waves[..., 0, 1], waves[..., 0, 2] = 1.0, np.sin(angles), 1.0 - np.cos(angles)
        moves = (waves @ self._moves).reshape(n_arms, n_joints, 4, 4)
        # A frame a joint, each moved by the joint before it and set at the next; the last one is at the pad.
        frames = np.empty((n_joints + 1, n_arms, 4, 4))
        frames[0] = self._begin
        for joint in range(n_joints):
            np.matmul(frames[joint], moves[:, joint], out=frames[joint + 1])
        frames = frames.swapaxes(0, 1)
        joints, axes = frames[:, :-1, :3, 3], (frames[:, :-1, :3, :3] @ self.axes[..., None])[..., 0]
        pad, rotation = frames[:, -1, :3, 3], frames[:, -1, :3, :3]
        jacobian = np.empty((n_arms, 6, n_joints))
        jacobian[:, :3] = cross(axes, pad[:, None] - joints).swapaxes(1, 2)
        jacobian[:, 3:] = axes.swapaxes(1, 2)
        axis, palm = (rotation @ self._hand_vectors).transpose(2, 0, 1)
        return HandPoses(pad, axis, palm, rotation, jacobian, joints)


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product along the last axis (``np.cross`` costs more than the rest of the kinematics)."""
    return np.asarray((a[..., :, None] * b[..., None, :]).reshape(*a.shape[:-1], 9) @ _CROSS)
