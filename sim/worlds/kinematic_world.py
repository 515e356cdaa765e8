"""An object that is turned without a robot, before a camera of its own."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import unknown_name
from sim.vision.object_camera import ObjectCamera
from sim.worlds.appearance_world import AppearanceWorld


class KinematicWorld(AppearanceWorld):
    """An object before a camera that each look finds a little off its place, in another light.

    To turn the object it is lifted, and its weight may be felt then.

    Args:
        objects: As for the world of these objects, like ``options``.
        camera: What sees them.
        render_mode: ``"rgb_array"`` for the camera frame, ``"detections"`` for the frame with what was cut out of it
            beside it, or ``None``.

    Attributes:
        camera: What sees the object.
        frame: The last camera frame, RGB, shape [height, width, 3].

    Raises:
        UnknownNameError: Another render mode.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "detections"], "render_fps": 1}  # noqa: RUF012
    camera: ObjectCamera

    def __init__(self, *objects: Any, camera: ObjectCamera, render_mode: str | None = None, **options: Any) -> None:
        super().__init__(*objects, render_mode=render_mode, **options)
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise unknown_name("render mode", render_mode, self.metadata["render_modes"])
        self.camera = camera
        width, height = camera.camera.image_size
        self.frame: NDArray[np.uint8] = np.zeros((height, width, 3), dtype=np.uint8)

    @abstractmethod
    def camera_picture(self) -> NDArray[np.uint8]:
        """Return the last camera frame with what was cut out of it to its right, RGB, whatever the render mode."""

    @abstractmethod
    def _weight(self) -> float:
        """Return what the object that is presented weighs, kg."""

    def render(self) -> NDArray[np.uint8] | None:
        """Return the last camera frame, RGB, shape [height, width, 3]; ``None`` without a render mode."""
        if self.render_mode is None:
            return None
        return self.frame.copy() if self.render_mode == "rgb_array" else self.camera_picture()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Present an object in an orientation, both drawn at random unless ``options`` sets them."""
        self.felt = {}
        return super().reset(seed=seed, options=options)

    def step(self, action: np.int64) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Turn the object, which is lifted for it, and look."""
        for sense in self.object_senses:
            error = float(np.exp(sense.error * self.np_random.standard_normal()))
            self.felt[sense.name] = self._weight() * error
        return super().step(action)

    def close(self) -> None:
        """Give back what the camera renders with; the world cannot be used any more."""
        self.camera.close()
