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

    def moved(self, by: FloatArray) -> Camera:
        """Return the camera moved by a vector of shape [3], m."""
        eye, target = np.add(self.eye, by).tolist(), np.add(self.target, by).tolist()
        return replace(self, eye=tuple(eye), target=tuple(target))

    def render(self, client: int, light: Light, *, shadow: bool = False) -> NDArray[np.uint8]:
        """Return what the camera sees, RGB, shape [height, width, 3]; shadows are for people, and slow."""
        width, height = self.image_size
        view = pybullet.computeViewMatrix(self.eye, self.target, self._up)
        projection = pybullet.computeProjectionMatrixFOV(self.field_of_view, width / height, self.near, _FAR)
        _, _, pixels, _, _ = pybullet.getCameraImage(
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
        return np.reshape(np.asarray(pixels, dtype=np.uint8), (height, width, 4))[:, :, :3].copy()
