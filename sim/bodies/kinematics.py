"""Where both hands are, and how they move with the joints: products of rotations about the joints' axes."""

from __future__ import annotations

from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from sim.bodies.arm_kernels import Arms, HandPoses, hands_at

#: Takes all products of two vectors' elements to their cross product.
_CROSS: Final = np.cross(np.eye(3)[:, None], np.eye(3)[None]).reshape(9, 3)


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
        #: What the compiled loops work on.
        self.arms = Arms(*(np.ascontiguousarray(array, float) for array in (positions, axes, hand_axis, palm, pads)))

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
        hands: HandPoses = hands_at(self.arms, np.ascontiguousarray(angles, float))
        return hands


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the cross product along the last axis (``np.cross`` costs more than the rest of the kinematics)."""
    return np.asarray((a[..., :, None] * b[..., None, :]).reshape(*a.shape[:-1], 9) @ _CROSS)
