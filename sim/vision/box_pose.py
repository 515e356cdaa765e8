"""Where a box stands on the table, from its outline alone.

A box is convex, so its outline is too, and the outline's *support* in a direction is how far it reaches there. That of
a box at (x, y), turned by an angle about the vertical, follows from its eight corners; the three numbers are those that
fit best what differs from a picture of the empty table (Gauss–Newton).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray
from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE

#: Directions that the outline is measured in, evenly around.
_DIRECTIONS: Final = np.array([[np.cos(a), np.sin(a)] for a in np.linspace(0, 2 * np.pi, 32, endpoint=False)])
_CORNERS: Final = CUBE_SIZE / 2 * np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
#: What differs from the empty table by more, in the three colours together, is the box; grey levels.
_DIFFERENCE: Final = 40.0
_LEAST_PART: Final = 0.01  # of the image
_ROUNDS: Final = 8
_STEPS: Final = np.array([0.002, 0.002, 0.01])  # of numerical derivatives: m, m, rad
#: A box is found if its outline fits to so many pixels, of an image 240 pixels high, and it is so near its place.
_MOST_MISFIT: Final = 2.5
_FARTHEST: Final = np.array([0.06, 0.06, np.radians(25)])
_SURE_MISFIT: Final = 1.0  # pixels; what fits worse counts less


def turned(yaw: float) -> FloatArray:
    """Return the rotation about the vertical by an angle in radians, shape [3, 3]."""
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def find_box(
    frame: NDArray[np.uint8], empty: NDArray[np.float32], project: Callable[[FloatArray], FloatArray]
) -> FloatArray | None:
    """Return how far a box is off its place: x and y, m, and its angle, rad; ``None`` if no outline is a box's.

    Args:
        frame: RGB.
        empty: The table without a box, in usual light, RGB.
        project: From points of the world, shape [n, 3], to pixels, shape [n, 2].
    """
    measured = _measured_support(frame, empty)
    if measured is None:
        return None
    scale = frame.shape[0] / 240

    def support(pose: FloatArray) -> FloatArray:
        corners = _CORNERS @ turned(float(pose[2])).T + CUBE_CENTRE + np.append(pose[:2], 0.0)
        reach: FloatArray = (project(corners) @ _DIRECTIONS.T).max(axis=0)
        return reach

    pose = np.zeros(3)
    for _ in range(_ROUNDS):
        predicted = support(pose)
        slopes = np.column_stack([(support(pose + step) - predicted) / step.sum() for step in np.diag(_STEPS)])
        residual = measured - predicted
        weight = 1.0 / np.maximum(1.0, np.abs(residual) / (_SURE_MISFIT * scale))
        change = np.linalg.lstsq(slopes * weight[:, None], residual * weight, rcond=None)[0]
        pose = np.clip(pose + change, -_FARTHEST, _FARTHEST)
        if np.abs(change / _STEPS).max() < 0.01:
            break
    misfit = float(np.median(np.abs(measured - support(pose))))
    return None if misfit > _MOST_MISFIT * scale or (np.abs(pose) >= _FARTHEST).any() else pose


def lightness(frame: NDArray[Any], empty: NDArray[Any]) -> float:
    """Return how light a frame is beside a picture of the empty table, by its border, where no box is."""
    rows, columns = frame.shape[0] // 12, frame.shape[1] // 8
    border = np.ones(frame.shape[:2], dtype=bool)
    border[rows:-rows, columns:-columns] = False
    return float(np.median(frame[border].sum(axis=1) / empty[border].sum(axis=1)))


def _measured_support(frame: NDArray[np.uint8], empty: NDArray[np.float32]) -> FloatArray | None:
    """Return how far what is not table reaches in each direction, pixels; ``None`` if there is nothing."""
    # Half the size is as exact once noise is averaged, and four times as quick.
    half = (frame.shape[1] // 2, frame.shape[0] // 2)
    small, table = (cv2.resize(each, half, interpolation=cv2.INTER_AREA).astype(np.float32) for each in (frame, empty))
    seen = cv2.GaussianBlur(small, (0, 0), 0.8)
    light = lightness(seen, table)
    differs = (np.abs(seen - light * table).sum(axis=2) > _DIFFERENCE * max(light, 0.5)).astype(np.uint8)
    differs = np.asarray(cv2.morphologyEx(differs, cv2.MORPH_OPEN, np.ones((3, 3), dtype=np.uint8)))
    n_parts, parts, sizes, _ = cv2.connectedComponentsWithStats(differs)
    large = [part for part in range(1, n_parts) if sizes[part, cv2.CC_STAT_AREA] > _LEAST_PART * differs.size]
    if not large:
        return None
    down, across = np.nonzero(np.isin(parts, large))
    hull = cv2.convexHull(np.column_stack((across, down)).astype(np.int32)).reshape(-1, 2)
    # A pixel of the half image has its middle half a pixel of the whole one further on.
    reach: FloatArray = ((2.0 * hull + 0.5) @ _DIRECTIONS.T).max(axis=0)
    return reach
