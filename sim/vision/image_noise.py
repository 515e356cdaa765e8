"""How a camera sees: light, blur, noise, and the tags detected in what is left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError
from sim.vision.camera import Camera, Light
from sim.vision.depth_noise import noisy_depth

#: A frame is never taken for darker beside usual light: of a black one nothing can be evened out.
_DARKEST: Final = 1 / 255


@dataclass(frozen=True)
class Imaging:
    """What stands between the scene and a camera frame.

    Attributes:
        light_jitter: How much the light may change at each look, 0 (not at all) to 1.
        image_noise: Standard deviation of noise on each grey level (0 to 255).
        blur: Standard deviation of a Gaussian blur, pixels.
        depth_noise: Noise of depth as a multiple of what is published of such cameras (``sim.vision.depth_noise``).

    Raises:
        InvalidInputError: A value below zero or not finite.
    """

    light_jitter: float = 0.0
    image_noise: float = 0.0
    blur: float = 0.0
    depth_noise: float = 1.0

    def __post_init__(self) -> None:
        for name in ("light_jitter", "image_noise", "blur", "depth_noise"):
            at_least_zero(name, getattr(self, name))

    def frame(self, camera: Camera, client: int, rng: np.random.Generator) -> NDArray[np.uint8]:
        """Return what the camera sees, RGB, shape [height, width, 3]. Draws nothing for what is zero."""
        return self.developed(camera.render(client, self.light(rng)), rng)

    def frame_with_depth(
        self, camera: Camera, client: int, rng: np.random.Generator
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return what a camera of colour and depth sees: RGB, shape [height, width, 3], and depth, [height, width], m.

        Where nothing is measured, the depth is zero.
        """
        frame, depth = camera.render_with_depth(client, self.light(rng))
        frame = self.developed(frame, rng)
        return frame, noisy_depth(depth, camera.intrinsics[0, 0], self.depth_noise, rng)

    def developed(self, frame: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
        """Return a frame with blur and noise."""
        if self.blur:
            frame = np.asarray(cv2.GaussianBlur(frame, (0, 0), self.blur), dtype=np.uint8)
        if self.image_noise:
            noisy = frame + rng.normal(0.0, self.image_noise, (*frame.shape[:2], 1))
            frame = np.clip(np.round(noisy), 0, 255).astype(np.uint8)
        return frame

    def light(self, rng: np.random.Generator) -> Light:
        """Return the lamp of one look."""
        if not self.light_jitter:
            return Light()
        change = self.light_jitter * rng.uniform(-1, 1, 3)
        x, y, z = Light().direction
        return Light((x + change[0], y + change[1], z), Light().ambient, Light().diffuse * (1 + 0.5 * change[2]))


def in_usual_light(frame: NDArray[np.uint8], lightness: float) -> NDArray[np.uint8]:
    """Return a frame, RGB, as it would be in usual light, beside which it is so light now; black stays black."""
    return np.clip(np.round(frame / np.float32(max(lightness, _DARKEST))), 0, 255).astype(np.uint8)


def at_least_zero(name: str, value: float) -> float:
    """Return ``value`` if it is a finite number of at least zero, else raise ``InvalidInputError``."""
    if not 0 <= value < np.inf:
        raise InvalidInputError(f"{name}: {value!r}; expected a finite number of at least 0")
    return float(value)
