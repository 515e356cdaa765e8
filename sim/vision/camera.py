"""A pinhole camera in PyBullet, rendered on the CPU."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pybullet
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray

_FAR = 4.0  # m


@dataclass(frozen=True)
class Light:
    """A lamp far away.

    Attributes:
        direction: From the scene towards the lamp.
        ambient: Share of light from everywhere.
        diffuse: Share of light from the lamp.
    """

    direction: tuple[float, float, float] = (-0.6, 0.5, 1.5)
    ambient: float = 0.6
    diffuse: float = 0.4

    @property
    def on_top(self) -> float:
        """How light what faces upwards is, as a share of its colour."""
        return self.ambient + self.diffuse * self.direction[2] / float(np.linalg.norm(self.direction))


@dataclass(frozen=True)
class Camera:
    """A camera that looks from one point to another, upright.

    Attributes:
        eye: Position in the world, m.
        target: The point in the middle of the image, m.
        field_of_view: Vertical, degrees.
        image_size: (width, height) in pixels.
        near: What is nearer is not seen, m: the robot's own head, which the eye is in.
    """

    eye: tuple[float, float, float] = (0.05, 0.0, 0.84)
    target: tuple[float, float, float] = (0.42, 0.0, 0.30)
    field_of_view: float = 40.0
    image_size: tuple[int, int] = (320, 240)
    near: float = 0.05
    _up: tuple[float, float, float] = field(default=(0.0, 0.0, 1.0), repr=False)

    @cached_property
    def intrinsics(self) -> FloatArray:
        """The camera matrix as OpenCV has it, shape [3, 3], pixels."""
        width, height = self.image_size
        focal = height / 2 / np.tan(np.radians(self.field_of_view) / 2)
        return np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]], dtype=np.float64)

    @cached_property
    def rotation(self) -> FloatArray:
        """Rotation from OpenCV's camera frame (x right, y down, z forward) to the world, shape [3, 3]."""
        forward = np.subtract(self.target, self.eye)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self._up)
        right = right / np.linalg.norm(right)
        return np.column_stack([right, np.cross(forward, right), forward])

    @cached_property
    def rays(self) -> FloatArray:
        """The direction that each pixel looks in, in OpenCV's camera frame, 1 m deep, shape [height, width, 3]."""
        (focal, _, across), (_, _, down), _ = self.intrinsics
        rows, columns = np.indices(self.image_size[::-1])
        return np.stack([(columns - across) / focal, (rows - down) / focal, np.ones(rows.shape)], axis=-1)

    def project(self, points: FloatArray) -> FloatArray:
        """Return where points of the world, shape [n, 3], m, are in the image, shape [n, 2], pixels."""
        pixels = (points - np.array(self.eye)) @ self.rotation @ self.intrinsics.T
        return np.asarray(pixels[:, :2] / pixels[:, 2:])

    def moved(self, by: FloatArray) -> Camera:
        """Return the camera moved by a vector of shape [3], m."""
        eye, target = np.add(self.eye, by).tolist(), np.add(self.target, by).tolist()
        return replace(self, eye=tuple(eye), target=tuple(target))

    def render(self, client: int, light: Light, *, shadow: bool = False) -> NDArray[np.uint8]:
        """Return what the camera sees, RGB, shape [height, width, 3]; shadows are for people, and slow."""
        return self.render_with_depth(client, light, shadow=shadow)[0]

    def render_with_depth(
        self, client: int, light: Light, *, shadow: bool = False
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return what the camera sees, RGB, shape [height, width, 3], and how deep it is, shape [height, width], m.

        Where there is nothing, the depth is zero.
        """
        width, height = self.image_size
        view = pybullet.computeViewMatrix(self.eye, self.target, self._up)
        projection = pybullet.computeProjectionMatrixFOV(self.field_of_view, width / height, self.near, _FAR)
        _, _, pixels, buffer, _ = pybullet.getCameraImage(
            width,
            height,
            view,
            projection,
            lightDirection=light.direction,
            lightAmbientCoeff=light.ambient,
            lightDiffuseCoeff=light.diffuse,
            lightSpecularCoeff=0.0,
            shadow=int(shadow),
            renderer=pybullet.ER_TINY_RENDERER,
            flags=pybullet.ER_NO_SEGMENTATION_MASK,
            physicsClientId=client,
        )
        # Some builds of PyBullet return a flat tuple.
        frame = np.reshape(np.asarray(pixels, dtype=np.uint8), (height, width, 4))[:, :, :3].copy()
        share = np.reshape(np.asarray(buffer, dtype=np.float32), (height, width))
        depth = np.where(share < 1, _FAR * self.near / (_FAR - (_FAR - self.near) * share), 0.0)
        return frame, depth.astype(np.float32)
