"""The robot turns an ARcube: the tags that its camera sees say where the cube is and what it shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atg_fg.senses.tags import DetectedTag
from atg_fg.worlds.arcube import Cube
from atg_fg.worlds.arcube_world import ARcubeWorld
from sim.vision.cube_pose import CubePose, cube_pose
from sim.vision.tag_detection import detect_markers, detected_symbols, draw_detections
from sim.worlds.robonaut_world import RobonautWorld


class RobonautARcubeWorld(RobonautWorld, ARcubeWorld):
    """A Robonaut-like robot that flips and turns an ARcube on a table.

    Where to take hold and what is shown come from the tags in the image.

    Args:
        cubes: As for ``ARcubeWorld``.
        options: As for ``RobonautWorld``.

    Attributes:
        markers: What was detected in the last frame.
    """

    def __init__(self, cubes: Sequence[Cube] | None = None, **options: Any) -> None:
        self.markers: list[DetectedTag] = []
        super().__init__(cubes, **options)

    def camera_picture(self) -> NDArray[np.uint8]:
        """Return the last frame of the head's camera with the detected tags outlined, whatever the render mode."""
        return draw_detections(self.frame, self.markers)

    def _perceive(self) -> None:
        camera = self.camera.moved(self.scene.robot.place)
        self.frame = self.circumstances.imaging.frame(camera, self.scene.client, self.np_random)
        self.markers = detect_markers(self.frame, self.camera)

    def _found_cube(self) -> CubePose | None:
        return cube_pose(self.markers)

    def _detect(self) -> tuple[int, int]:
        return detected_symbols(self.markers)

    def _symbols(self) -> Cube:
        return self.cubes[self.object]

    def _state(self) -> dict[str, Any]:
        return {**super()._state(), "markers": self.markers}

    def _set_state(self, kept: dict[str, Any]) -> None:
        super()._set_state(kept)
        self.markers = kept["markers"]
