"""What cameras that see one object on a table have in common: how much a look differs from the next one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.vision.camera import Camera
from sim.vision.image_noise import Imaging, at_least_zero


class ObjectCamera:
    """A camera that each look finds an object before a little off its place, in another light.

    Args:
        camera: Where it stands.
        position_jitter: How far at most each look finds the object off its place in x and y, m.
        yaw_jitter: How far at most it is turned about the vertical, degrees.
        light_jitter: How much the light changes from look to look, 0 (not at all) to 1.
        image_noise: Standard deviation of noise on each grey level (0 to 255).
        blur: Standard deviation of a Gaussian blur, pixels.

    Attributes:
        imaging: Light, noise and blur.
        empty: The table without an object in usual light, RGB, shape [height, width, 3].

    Raises:
        InvalidInputError: A value below zero or not finite.
    """

    empty: NDArray[np.float32]

    def __init__(
        self,
        camera: Camera,
        *,
        position_jitter: float = 0.012,
        yaw_jitter: float = 6.0,
        light_jitter: float = 0.5,
        image_noise: float = 8.0,
        blur: float = 0.6,
    ) -> None:
        self.camera = camera
        self.position_jitter = at_least_zero("position_jitter", position_jitter)
        self.yaw_jitter = at_least_zero("yaw_jitter", yaw_jitter)
        self.imaging = Imaging(light_jitter, image_noise, blur)

    def close(self) -> None:
        """Give back what the camera renders with; it cannot be used any more."""
