"""Where both hands are, and how they move with the joints: products of rotations about the joints' axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from atg_fg.core.patterns import FloatArray

_NEXT, _AFTER_NEXT = np.array([1, 2, 0]), np.array([2, 0, 1])


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
        self.hand_axis, self._palm, self.pad_radius = hand_axis, palm, pad_radius
        self._hands = {"hand_axis": hand_axis, "palm": palm, "pads": pads, "pad_radius": pad_radius}
        self._to_next = np.diff(np.concatenate([positions, pads[:, None]], axis=1), axis=1)[..., None]
        # Rodrigues' formula: R(q) = 1 + sin q K + (1 − cos q) K², with K the cross product with the axis.
        self._cross = np.zeros((*axes.shape[:2], 3, 3))
        self._cross[..., 0, 1], self._cross[..., 0, 2] = -axes[..., 2], axes[..., 1]
        self._cross[..., 1, 0], self._cross[..., 1, 2] = axes[..., 2], -axes[..., 0]
        self._cross[..., 2, 0], self._cross[..., 2, 1] = -axes[..., 1], axes[..., 0]
        self._cross_squared = self._cross @ self._cross

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
        sine, cosine = np.sin(angles)[..., None, None], np.cos(angles)[..., None, None]
        turns = np.eye(3) + sine * self._cross + (1.0 - cosine) * self._cross_squared
        # A frame a joint, each moved by the joint before it and set at the next; the last one is at the pad.
        n_joints = self.axes.shape[1]
        moves = np.zeros((*self.axes.shape[:1], n_joints, 4, 4))
        moves[..., :3, :3], moves[..., :3, 3:], moves[..., 3, 3] = turns, turns @ self._to_next, 1.0
        frames = np.zeros((*self.axes.shape[:1], n_joints + 1, 4, 4))
        frames[:, 0] = np.eye(4)
        frames[:, 0, :3, 3] = self.positions[:, 0]
        for joint in range(n_joints):
            np.matmul(frames[:, joint], moves[:, joint], out=frames[:, joint + 1])
        joints, axes = frames[:, :-1, :3, 3], (frames[:, :-1, :3, :3] @ self.axes[..., None])[..., 0]
        pad, rotation = frames[:, -1, :3, 3], frames[:, -1, :3, :3]
        jacobian = np.concatenate([cross(axes, pad[:, None] - joints), axes], axis=2).transpose(0, 2, 1)
        axis, palm = (rotation @ self.hand_axis[..., None])[..., 0], (rotation @ self._palm[..., None])[..., 0]
        return HandPoses(pad, axis, palm, rotation, jacobian, joints)


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product along the last axis (``np.cross`` costs more than the rest of the kinematics)."""
    return a[..., _NEXT] * b[..., _AFTER_NEXT] - a[..., _AFTER_NEXT] * b[..., _NEXT]
