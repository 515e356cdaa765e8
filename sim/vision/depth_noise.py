"""What stands between the depth of a scene and a depth image: the noise of a camera with structured light.

The spread along the axis is that measured by Nguyen, Izadi and Lovell, *Modeling Kinect Sensor Noise for Improved 3D
Reconstruction and Tracking* (2012), with distance, and with the angle at which a surface is seen.
"""

from __future__ import annotations

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray

#: Surfaces that are seen more slantwise give nothing back, rad; so does what is at an edge before something farther.
_STEEPEST: Final = np.radians(80.0)
#: Share of the other pixels in which nothing is measured.
_LOST: Final = 0.005
#: Noise of neighbours is alike, since depth is measured in windows; standard deviation of that, pixels.
_WINDOW: Final = 1.0
#: Pixels that an edge is off by, sideways (standard deviation), and share that all depths of an image are off by.
_SIDEWAYS, _SCALE = 0.5, 0.002


def noisy_depth(
    depth: NDArray[np.float32], focal: float, times: float, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Return a depth image as a camera measures it, shape [height, width], m; zero where it measures nothing.

    Args:
        depth: The scene's, zero where there is nothing, m.
        focal: Focal length, pixels.
        times: How many times as much noise as was published; 0 for none.
        rng: Of the noise.
    """
    if not times:
        return depth
    height, width = depth.shape
    rows, columns = np.indices(depth.shape, dtype=np.float32)
    across, down = (times * _SIDEWAYS * rng.standard_normal((2, height, width))).astype(np.float32)
    seen = cv2.remap(depth, columns + across, rows + down, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
    angle = _angle_of_incidence(depth, focal)
    white = cv2.GaussianBlur(rng.standard_normal(depth.shape), (0, 0), _WINDOW)
    spread = times * _spread(np.maximum(seen, 0.1), angle)
    off = 1 + times * _SCALE * rng.standard_normal()
    measured = off * seen + spread * white / white.std()
    lost = (rng.random(depth.shape) < _LOST) | (angle > _STEEPEST) | (seen <= 0)
    return np.where(lost, 0.0, measured).astype(np.float32)


def _spread(depth: FloatArray, angle: FloatArray) -> FloatArray:
    """Return the standard deviation of depth along the axis, m, at depths, m, and angles of incidence, rad."""
    slant = np.minimum(angle, _STEEPEST)
    return np.asarray(
        0.0012 + 0.0019 * (depth - 0.4) ** 2 + 0.0001 / np.sqrt(depth) * slant**2 / (np.pi / 2 - slant) ** 2
    )


def _angle_of_incidence(depth: NDArray[np.float32], focal: float) -> FloatArray:
    """Return the angle between the axis and the normal of what each pixel sees, rad.

    Of a plane, the inverse of the depth is linear in the image: 1 / z = (n · ray) / d.
    """
    height, width = depth.shape
    inverse = 1 / np.maximum(depth, 0.1)
    down, across = np.gradient(inverse)
    down, across = focal * down, focal * across
    columns, rows = (np.arange(width) - width / 2) / focal, (np.arange(height) - height / 2) / focal
    forwards = inverse - across * columns - down * rows[:, None]
    return np.asarray(np.arctan2(np.hypot(across, down), np.abs(forwards)))
