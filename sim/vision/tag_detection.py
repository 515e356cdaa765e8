"""Evidence from a camera frame: ArUco tags, their poses, and which of them is in front and which on top."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray
from atg_fg.worlds.arcube import N_TAGS
from atg_fg.worlds.base import MISSING
from sim.bodies.cube import CUBE_SIZE, TAG_DICTIONARY, TAG_SIZE
from sim.vision.camera import Camera

#: How well a tag's normal must agree with a slot's direction (a cosine: up to 45 degrees).
ALIGNMENT: Final = 0.7


#: Directions in the world that the slots face: front towards the robot, top upwards.
SLOT_DIRECTIONS: Final = {"front": np.array([-1.0, 0.0, 0.0]), "top": np.array([0.0, 0.0, 1.0])}


_CORNERS = TAG_SIZE / 2 * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], dtype=np.float32)


_COLOURS = {"front": (230, 90, 0), "top": (0, 140, 60), None: (128, 128, 128)}


@dataclass(frozen=True, eq=False)
class Marker:
    """A detected tag.

    Attributes:
        symbol: Number of the tag.
        corners: In the image, shape [4, 2], pixels.
        position: Of its middle in the world, shape [3], m.
        rotation: From the tag's frame (z is its normal) to the world, shape [3, 3].
    """

    symbol: int
    corners: FloatArray
    position: FloatArray
    rotation: FloatArray

    @property
    def normal(self) -> FloatArray:
        """Outward normal in the world, shape [3]."""
        return self.rotation[:, 2]

    @property
    def cube_centre(self) -> FloatArray:
        """Where the middle of the cube is if the tag is on one of its faces, shape [3], m."""
        return np.asarray(self.position - CUBE_SIZE / 2 * self.normal)


@lru_cache(maxsize=1)
def _detector() -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    # Lines fitted to a tag's sides: sub-pixel search strays on the foreshortened front (p95 of the cube's centre
    # 14 mm, against 6 mm).
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(TAG_DICTIONARY), parameters)


def detect_markers(frame: NDArray[np.uint8], camera: Camera) -> list[Marker]:
    """Return the tags 0 to 11 in an RGB frame of shape [height, width, 3], with their poses in the world."""
    grey = cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY)
    all_corners, symbols, _ = _detector().detectMarkers(grey)
    if symbols is None:
        return []
    found = zip(all_corners, map(int, np.ravel(symbols)), strict=True)
    return [_located(corners.reshape(4, 2), symbol, camera) for corners, symbol in found if symbol < N_TAGS]


def _located(corners: NDArray[Any], symbol: int, camera: Camera) -> Marker:
    # Of the two poses that show a square alike, OpenCV puts the one with the smaller error first.
    _, rotations, translations, _ = cv2.solvePnPGeneric(
        _CORNERS, corners, camera.intrinsics, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
    )
    rotation = camera.rotation @ cv2.Rodrigues(rotations[0])[0]
    position = camera.rotation @ np.ravel(translations[0]) + camera.eye
    return Marker(symbol, corners.astype(np.float64), position, rotation)


def slot_marker(markers: Sequence[Marker], slot: str) -> Marker | None:
    """Return the marker that faces a slot's direction best, ``None`` if none does within ``ALIGNMENT``."""
    direction = SLOT_DIRECTIONS[slot]
    facing = [marker for marker in markers if marker.normal @ direction > ALIGNMENT]
    return max(facing, key=lambda marker: float(marker.normal @ direction), default=None)


def detected_symbols(markers: Sequence[Marker]) -> tuple[int, int]:
    """Return the symbols (front, top), ``MISSING`` where none was detected.

    No cube has a tag twice, so one symbol in both slots is an error of detection: neither is believed.
    """
    in_slots = [slot_marker(markers, slot) for slot in SLOT_DIRECTIONS]
    front, top = (MISSING if marker is None else marker.symbol for marker in in_slots)
    return (MISSING, MISSING) if front == top else (front, top)


def draw_detections(frame: NDArray[np.uint8], markers: Sequence[Marker]) -> NDArray[np.uint8]:
    """Return a copy of an RGB frame with each marker outlined and named: its number, and its slot if it has one."""
    drawn = frame.copy()
    slots = {id(slot_marker(markers, slot)): slot for slot in SLOT_DIRECTIONS}
    for marker in markers:
        slot = slots.get(id(marker))
        cv2.polylines(drawn, [np.round(marker.corners).astype(np.int32)], True, _COLOURS[slot], 2, cv2.LINE_AA)
        text = f"{marker.symbol}" if slot is None else f"{slot} {marker.symbol}"
        (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.5, 1)
        x, y = np.round(marker.corners.mean(axis=0)).astype(int).tolist()
        left, bottom = x - width // 2, y + height // 2
        box = (left - 3, bottom + 4), (left + width + 3, bottom - height - 4)
        cv2.rectangle(drawn, *box, _COLOURS[slot], -1)
        cv2.putText(drawn, text, (left, bottom), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 255, 255), 1, cv2.LINE_AA)
    return drawn
