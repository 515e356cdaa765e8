"""The ARcube before a camera: turned kinematically, seen as an image, read by ArUco detection."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import pybullet
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.patterns import FloatArray
from atg_fg.senses.tags import DetectedTag
from atg_fg.worlds.arcube import Cube, rotation_of
from atg_fg.worlds.arcube_world import ARcubeWorld
from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE, CubeBody
from sim.vision.camera import Camera
from sim.vision.image_noise import Imaging, at_least_zero
from sim.vision.tag_detection import detect_markers, detected_symbols, draw_detections
from sim.worlds.rerun_entities import log_camera, log_cube, log_links, log_pose, log_shapes, log_world

_MOST_PIXELS: Final = 2048
_WOOD, _FLOOR = [0.66, 0.50, 0.34, 1.0], [0.80, 0.82, 0.84, 1.0]


class RenderedARcubeWorld(ARcubeWorld):
    """An ARcube on a table; a head camera looks at it from above and in front.

    Which tag is in front and which on top is decided from the tags' poses in the image, never from the truth.

    Args:
        cubes: As for ``ARcubeWorld``, like ``slip``, ``wrong`` and ``missing``.
        image_size: (width, height) of the frame, pixels.
        position_jitter: How far at most each action leaves the cube off its place in x and y, m.
        yaw_jitter: How far at most it leaves the cube turned about the vertical, degrees.
        light_jitter: How much the light may change at each look, 0 (not at all) to 1.
        image_noise: Standard deviation of noise on each grey level (0 to 255).
        blur: Standard deviation of a Gaussian blur, pixels.
        render_mode: ``"rgb_array"`` for the camera frame, ``"detections"`` for the frame with the detected tags
            outlined, or ``None``.

    Attributes:
        frame: The last camera frame, RGB, shape [height, width, 3].
        markers: What was detected in it.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "detections"], "render_fps": 1}  # noqa: RUF012

    def __init__(
        self,
        cubes: Sequence[Cube] | None = None,
        *,
        slip: float = 0.0,
        wrong: float = 0.0,
        missing: float = 0.0,
        image_size: tuple[int, int] = (320, 240),
        position_jitter: float = 0.0,
        yaw_jitter: float = 0.0,
        light_jitter: float = 0.0,
        image_noise: float = 0.0,
        blur: float = 0.0,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(cubes, slip=slip, wrong=wrong, missing=missing, render_mode=render_mode)
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise unknown_name("render mode", render_mode, self.metadata["render_modes"])
        self.position_jitter = at_least_zero("position_jitter", position_jitter)
        self.yaw_jitter = at_least_zero("yaw_jitter", yaw_jitter)
        self.imaging = Imaging(light_jitter, image_noise, blur)
        width, height = checked_size(image_size)
        self.camera = Camera(image_size=(width, height))
        self.frame: NDArray[np.uint8] = np.zeros((height, width, 3), dtype=np.uint8)
        self.markers: list[DetectedTag] = []
        self._client = pybullet.connect(pybullet.DIRECT)
        # A world that nobody closes must not keep its client until the process ends.
        self._disconnect = weakref.finalize(self, pybullet.disconnect, physicsClientId=self._client)
        self._table = self._build_table()
        self._cube = CubeBody(self._client)
        self._offset = np.zeros(3)
        self._yaw = 0.0
        self._recording: Any = None

    def render(self) -> NDArray[np.uint8] | None:
        """Return the last camera frame, RGB, shape [height, width, 3]; ``None`` without a render mode."""
        if self.render_mode is None:
            return None
        return self.frame.copy() if self.render_mode == "rgb_array" else self.camera_picture()

    def camera_picture(self) -> NDArray[np.uint8]:
        """Return the last camera frame with the detected tags outlined, whatever the render mode."""
        return draw_detections(self.frame, self.markers)

    def show_in(self, recording: Any) -> None:
        """Show the cube and what the camera sees in a Rerun recording, from the next reset on."""
        self._recording = recording
        log_world(recording)
        log_shapes(recording, "world/table_0", self._client, self._table)
        log_links(recording, "world/table_0", self._client, self._table)

    def close(self) -> None:
        """Leave PyBullet; the world cannot be used any more."""
        self._disconnect()
        self._client = -1

    def _build_table(self) -> int:
        """Make table and floor, and return the table."""
        half_sizes = ([0.32, 0.40, 0.02], _WOOD), ([4.0, 4.0, 0.01], _FLOOR)
        table_top = CUBE_CENTRE[2] - CUBE_SIZE / 2
        bodies = []
        for (half_size, colour), height in zip(half_sizes, (table_top - 0.02, -0.5), strict=True):
            shape = pybullet.createVisualShape(
                pybullet.GEOM_BOX, halfExtents=half_size, rgbaColor=colour, physicsClientId=self._client
            )
            bodies.append(pybullet.createMultiBody(0, -1, shape, [0.5, 0.0, height], physicsClientId=self._client))
        return int(bodies[0])

    def _place(self) -> None:
        """Put the cube down in its orientation, a little off as the jitter options say."""
        # Nothing is drawn for what is off, so that the same seed slips here and in the ideal world alike.
        if self.position_jitter:
            self._offset = np.append(self.np_random.uniform(-1, 1, 2) * self.position_jitter, 0.0)
        if self.yaw_jitter:
            self._yaw = float(np.radians(self.np_random.uniform(-1, 1) * self.yaw_jitter))
        self._cube.show(self.cubes[self.object])
        self._cube.place(CUBE_CENTRE + self._offset, self.cube_rotation)
        if self._recording is not None:
            log_cube(self._recording, "world/cube_0", self.cubes[self.object])
            log_pose(self._recording, "world/cube_0", *self._cube.pose())

    @property
    def cube_rotation(self) -> FloatArray:
        """The cube's true rotation matrix; for scoring only."""
        cosine, sine = np.cos(self._yaw), np.sin(self._yaw)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        return np.asarray(turn @ rotation_of(self.orientation))

    def _detect(self) -> tuple[int, int]:
        """Take a frame and return the symbols detected in it."""
        self.frame = self.imaging.frame(self.camera, self._client, self.np_random)
        self.markers = detect_markers(self.frame, self.camera)
        if self._recording is not None:
            log_camera(self._recording, self.camera, self.camera_picture())
        return detected_symbols(self.markers)

    def _truth(self, *, slipped: bool) -> dict[str, Any]:
        truth = super()._truth(slipped=slipped)
        truth["position"] = tuple((CUBE_CENTRE + self._offset).tolist())
        truth["yaw"] = self._yaw
        return truth


def checked_size(size: Sequence[int]) -> tuple[int, int]:
    """Return (width, height), or raise ``InvalidInputError``."""
    whole = isinstance(size, Sequence) and all(isinstance(pixels, (int, np.integer)) for pixels in size)
    if not whole or len(size) != 2 or not all(16 <= pixels <= _MOST_PIXELS for pixels in size):
        raise InvalidInputError(f"image_size: {size!r}; expected width and height, each 16 to {_MOST_PIXELS} pixels")
    return int(size[0]), int(size[1])
