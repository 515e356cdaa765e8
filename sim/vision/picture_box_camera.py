"""A camera that sees a box with pictures, and cuts out what is in front and on top."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray
from atg_fg.senses.face_features import check_image, rectified
from atg_fg.senses.tag_drawing import SLOT_COLOURS
from atg_fg.worlds.arcube import FACE_NORMALS, FRONT, TOP
from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE, face_corners
from sim.vision.box_pose import find_box, lightness, turned
from sim.vision.camera import Camera, Light
from sim.vision.image_noise import in_usual_light
from sim.vision.object_camera import ObjectCamera

_TABLE, _FLOOR = (104, 112, 120), (204, 209, 214)


class PictureBoxCamera(ObjectCamera):
    """Draws a box with pictures on a table as a camera sees it.

    A box is convex, so what it shows are its faces that are turned towards the camera, each a planar picture in
    perspective (a homography), as light as its angle to the lamp makes it.

    Args:
        camera: Where it stands.
        jitter: As for ``ObjectCamera``.
    """

    def __init__(self, camera: Camera, **jitter: float) -> None:
        super().__init__(camera, **jitter)
        self.empty = self._draw_table()

    def _draw_table(self) -> NDArray[np.float32]:
        width, height = self.camera.image_size
        drawn = np.empty((height, width, 3), dtype=np.float32)
        drawn[:] = _FLOOR
        z = CUBE_CENTRE[2] - CUBE_SIZE / 2
        table = np.array([[0.18, -0.4, z], [0.82, -0.4, z], [0.82, 0.4, z], [0.18, 0.4, z]])
        cv2.fillConvexPoly(drawn, np.round(self.camera.project(table)).astype(np.int32), _TABLE, cv2.LINE_AA)
        return drawn

    def frame(
        self, pictures: Sequence[NDArray[np.uint8]], rotation: FloatArray, rng: np.random.Generator
    ) -> NDArray[np.uint8]:
        """Return what the camera sees, RGB, shape [height, width, 3].

        Args:
            pictures: On each face, in the order of ``FACES``.
            rotation: Of the box, shape [3, 3].
            rng: Of pose, light and noise.
        """
        offset = np.append(rng.uniform(-1, 1, 2) * self.position_jitter, 0.0)
        turn = turned(float(np.radians(rng.uniform(-1, 1) * self.yaw_jitter)))
        change = self.imaging.light_jitter * rng.uniform(-1, 1, 3)
        lamp = np.add(Light().direction, (change[0], change[1], 0.0))
        lamp /= np.linalg.norm(lamp)
        lightness = 1.0 + 0.5 * change[2]
        frame: NDArray[Any] = self.empty * np.float32(lightness)
        centre = CUBE_CENTRE + offset
        for face, normal in enumerate((turn @ rotation @ FACE_NORMALS.T).T):
            if normal @ (np.array(self.camera.eye) - centre - normal * CUBE_SIZE / 2) <= 0:
                continue
            shade = lightness * (Light().ambient + Light().diffuse * max(0.0, float(normal @ lamp)))
            corners = self.camera.project(face_corners(face, turn @ rotation, centre)).astype(np.float32)
            picture = np.asarray(pictures[face] * np.float32(shade))
            side = picture.shape[0]
            square = np.array([[0, 0], [side, 0], [side, side], [0, side]], dtype=np.float32)
            homography = cv2.getPerspectiveTransform(square, corners)
            size = self.camera.image_size
            drawn = cv2.warpPerspective(picture, homography, size, borderMode=cv2.BORDER_REPLICATE)
            inside = np.zeros(size[::-1], dtype=np.uint8)
            cv2.fillConvexPoly(inside, np.round(corners).astype(np.int32), 1)
            cv2.copyTo(drawn, inside, frame)
        # Noise comes before rounding here, so that this is not ``Imaging.developed``.
        if self.imaging.blur:
            frame = cv2.GaussianBlur(frame, (0, 0), self.imaging.blur)
        if self.imaging.image_noise:
            frame = frame + rng.normal(0.0, self.imaging.image_noise, (*frame.shape[:2], 1)).astype(np.float32)
        return np.clip(np.round(frame), 0, 255).astype(np.uint8)

    def outlined(self, frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a copy of a frame in which the faces are outlined that are taken for those in front and on top."""
        return outlined(frame, self.faces(frame))

    def faces(self, frame: NDArray[np.uint8]) -> list[FloatArray]:
        """Return the corners of what is in front and on top, clockwise, each of shape [4, 2], pixels.

        Where the box stands is told from its outline; if that does not look like one, it is taken to stand where it
        should.

        Raises:
            InvalidInputError: A frame of another size or type.
        """
        check_image(frame, "frame", self.camera.image_size)
        pose = find_box(frame, self.empty, self.camera.project)
        x, y, yaw = np.zeros(3) if pose is None else pose
        centre = np.add(CUBE_CENTRE, (x, y, 0.0))
        return shown_faces(self.camera, float(yaw), centre)

    def crops(self, frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return what is in front and on top, as if seen from straight ahead, shape [2, side, side, 3].

        How light it is now is told from the table, and evened out.

        Raises:
            InvalidInputError: A frame of another size or type.
        """
        faces = self.faces(frame)
        usual = in_usual_light(frame, lightness(frame, self.empty))
        return np.array([rectified(usual, face) for face in faces])


def shown_faces(camera: Camera, yaw: float, centre: FloatArray) -> list[FloatArray]:
    """Return the corners of what is in front and on top of a box, clockwise, each of shape [4, 2], pixels.

    Args:
        camera: What sees it.
        yaw: How far the box is turned about the vertical, rad.
        centre: Of the box, shape [3], m.
    """
    return [camera.project(face_corners(place, turned(yaw), centre)) for place in (FRONT, TOP)]


def outlined(frame: NDArray[np.uint8], faces: Sequence[FloatArray]) -> NDArray[np.uint8]:
    """Return a copy of an RGB frame in which faces, as ``shown_faces`` returns them, are outlined; they may be none."""
    drawn = frame.copy()
    for slot, corners in zip(("front", "top"), faces, strict=False):
        cv2.polylines(drawn, [np.round(corners).astype(np.int32)], True, SLOT_COLOURS[slot], 2, cv2.LINE_AA)
    return drawn
