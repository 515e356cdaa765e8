"""Where a box stands on a table, and how large it is, from one depth image.

Two of the things that are seen are level: the table and the top of the box. Both are peaks among the heights of the
points. The table is the lowest, and a plane is fitted to it. The top is the largest above it; a line is fitted to each
of its four edges. They tell how the box is turned, where it is and how large.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.checks import floats
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from sim.vision.camera import Camera

#: Heights are counted in bins of this size, m, and summed over three.
_BIN: Final = 0.005
#: What is level is this near to its height, m, and this share of all that was measured.
_LEVEL: Final = 0.008
_LEAST_SHARE: Final = 0.03
#: Nothing is looked at that is farther, m: one pixel's error must not make for millions of bins.
_FARTHEST: Final = 100.0
#: No box is lower, m.
_LOWEST_TOP: Final = 0.03
_ROUNDS: Final = 3
#: Strips across the top in which its edges are looked for; those at either end have corners in them.
_STRIPS, _AT_CORNERS = 24, 3
_LEAST_STRIPS: Final = 8


@dataclass(frozen=True, eq=False)
class Cuboid:
    """A box that stands upright.

    Attributes:
        centre: Shape [3], m.
        yaw: How far it is turned about the vertical, −π/4 to π/4 rad.
        size: Along its own x and y, and its height, shape [3], m.
    """

    centre: FloatArray
    yaw: float
    size: FloatArray


@dataclass(frozen=True, eq=False)
class Tabletop:
    """What a depth image shows of a table.

    Attributes:
        table: Which pixels are of it, shape [height, width].
        box: What stands on it; ``None`` if there is none, or not whole in the image.
    """

    table: NDArray[np.bool_]
    box: Cuboid | None


def points_of(depth: Any, camera: Camera) -> FloatArray:
    """Return the points of a depth image in the frame that the camera is placed in, shape [height, width, 3], m.

    Args:
        depth: Along the camera's axis, floats of shape [height, width], m; zero or NaN where nothing was measured;
            what is farther than 100 m is left out.
        camera: Where it is and how it sees.

    Raises:
        InvalidInputError: A depth image of another size or type, or one in which nothing was measured.
    """
    size = camera.image_size[::-1]
    floats = isinstance(depth, np.ndarray) and np.issubdtype(depth.dtype, np.floating)
    if not floats or depth.shape != size:
        found = f"shape {np.shape(depth)} of {getattr(depth, 'dtype', type(depth).__name__)}"
        raise InvalidInputError(f"depth: {found}; expected floats of shape {size}, m")
    distance = np.where((depth > 0) & (depth < _FARTHEST), depth, np.nan).astype(np.float64)
    if np.isnan(distance).all():
        raise InvalidInputError(f"depth: nothing was measured in {depth.size} pixels; expected m in some of them")
    return np.asarray((camera.rays * distance[..., None]) @ camera.rotation.T + np.array(camera.eye))


def find_tabletop(points: FloatArray) -> Tabletop:
    """Return the table and the box in points of shape [height, width, 3], m, whose z is up; NaN where there is none.

    Raises:
        InvalidInputError: Points of another shape.
    """
    points = floats(points, "points", "x, y and z of each pixel, m")
    if points.ndim != 3 or points.shape[2] != 3:
        raise InvalidInputError(f"points: shape {points.shape}; expected [height, width, 3], m")
    heights = points[..., 2]
    total = np.isfinite(heights).sum()
    levels = _levels(heights, total)
    if not levels:
        return Tabletop(np.zeros(heights.shape, dtype=bool), None)
    plane = _plane(points, levels[0])
    above = heights - _level_at(plane, points)
    table = np.abs(above) < _LEVEL
    tops = [np.abs(above - level) < _LEVEL for level in _levels(above, total) if level > _LOWEST_TOP]
    if not tops:
        return Tabletop(table, None)
    top = _largest_part(max(tops, key=np.sum))
    outline = _rectangle(points[top][:, :2]) if _is_whole(top) else None
    if outline is None:
        return Tabletop(table, None)
    middle, yaw, sides = outline
    height = float(np.median(above[top]))
    centre = np.array([*middle, float(_level_at(plane, middle)) + height / 2])
    return Tabletop(table, Cuboid(centre, yaw, np.array([*sides, height])))


def _levels(heights: FloatArray, total: int) -> list[float]:
    """Return the heights at which so much is that it must be level, from the lowest."""
    finite = heights[np.abs(heights) < _FARTHEST]
    if not finite.size:
        return []
    lowest = float(finite.min())
    counts = np.bincount(((finite - lowest) / _BIN).astype(np.int64), minlength=3)
    near = np.convolve(counts, np.ones(3, dtype=np.int64), mode="same")
    most = cv2.dilate(near.astype(np.float32), np.ones((7, 1), dtype=np.uint8)).ravel()
    peaks = np.flatnonzero((near == most) & (near >= _LEAST_SHARE * total))
    return [lowest + (float(peak) + 0.5) * _BIN for peak in peaks]


def _plane(points: FloatArray, level: float) -> FloatArray:
    """Return (a, b, c) of the plane z = a + b x + c y through what is about a level, shape [3]."""
    plane = np.array([level, 0.0, 0.0])
    for reach in np.linspace(3, 1, _ROUNDS) * _LEVEL:
        near = points[np.abs(points[..., 2] - _level_at(plane, points)) < reach]
        design = np.column_stack((np.ones(len(near)), near[:, :2]))
        # Of many thousand points, the normal equations are as good, and quicker.
        plane = np.linalg.lstsq(design.T @ design, design.T @ near[:, 2], rcond=None)[0]
    return plane


def _level_at(plane: FloatArray, places: FloatArray) -> FloatArray:
    """Return the height of a plane at places of shape […, 2 or more], m."""
    return np.asarray(plane[0] + plane[1] * places[..., 0] + plane[2] * places[..., 1])


def _largest_part(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the largest connected part of a mask, without holes as small as a pixel and what hangs on by one."""
    square = np.ones((3, 3), dtype=np.uint8)
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, square)
    opened = cv2.morphologyEx(closed, cv2.MORPH_OPEN, square)
    _, parts, sizes, _ = cv2.connectedComponentsWithStats(opened)
    largest = 1 + int(sizes[1:, cv2.CC_STAT_AREA].argmax()) if len(sizes) > 1 else -1
    return np.asarray((parts == largest) & mask)


def _is_whole(part: NDArray[np.bool_]) -> bool:
    """Whether a part of the image is there, and does not run out of it."""
    border = np.concatenate((part[0], part[-1], part[:, 0], part[:, -1]))
    return bool(part.any() and not border.any())


def _rectangle(points: FloatArray) -> tuple[FloatArray, float, FloatArray] | None:
    """Return the middle of a filled rectangle, shape [2], m, how far it is turned, rad, and its sides, shape [2], m.

    Args:
        points: In it, shape [n, 2], m.
    """
    (_, _), (_, _), degrees = cv2.minAreaRect(points.astype(np.float32))
    yaw = float(np.radians(degrees))
    edges = np.zeros((2, 2))
    for _ in range(_ROUNDS):
        axes = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        own = points @ axes.T
        along, across = _edges(own), _edges(own[:, ::-1])
        if along is None or across is None:
            return None
        yaw += (along[0] - across[0]) / 2
        edges = np.array([across[1], along[1]])
    middle = edges.mean(axis=1) @ axes
    quarter = int(np.round(yaw / (np.pi / 2)))
    sides = edges[:, 1] - edges[:, 0]
    return middle, yaw - quarter * np.pi / 2, sides[::-1] if quarter % 2 else sides


def _edges(own: FloatArray) -> tuple[float, tuple[float, float]] | None:
    """Return the slope of the two edges along the first axis, rad, and where they are on the second, m.

    Args:
        own: Points in the rectangle's frame, shape [n, 2], m.
    """
    along, across = own.T
    begin, length = float(along.min()), float(np.ptp(along)) + 1e-12
    strips = np.minimum(((along - begin) / length * _STRIPS).astype(np.int64), _STRIPS - 1)
    least, most = np.full(_STRIPS, np.inf), np.full(_STRIPS, -np.inf)
    np.minimum.at(least, strips, across)
    np.maximum.at(most, strips, across)
    inner = np.flatnonzero(np.isfinite(least))
    inner = inner[(inner >= _AT_CORNERS) & (inner < _STRIPS - _AT_CORNERS)]
    if len(inner) < _LEAST_STRIPS:
        return None
    slopes, places = [], []
    middle, where = begin + length / 2, begin + (inner + 0.5) / _STRIPS * length
    for edge in (least, most):
        line = np.column_stack((where, edge[inner])).astype(np.float32)
        x, y, x0, y0 = cv2.fitLine(line, cv2.DIST_HUBER, 0, 1e-4, 1e-4).ravel().tolist()
        slopes.append(y / x)
        places.append(y0 + (middle - x0) * y / x)
    return float(np.arctan(np.mean(slopes))), (places[0], places[1])
