"""Evidence from a camera frame: the cube's tags in the world, and which of them is in front and which on top."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import MISSING
from atg_fg.senses.tag_drawing import draw_slots
from atg_fg.senses.tags import DetectedTag, TagDetector, Tags, tag_facing
from atg_fg.worlds.arcube import N_TAGS
from sim.bodies.cube import TAG_DICTIONARY, TAG_SIZE
from sim.vision.camera import Camera

#: Directions in the world that the slots face: front towards the robot, top upwards.
SLOT_DIRECTIONS: Final = {"front": np.array([-1.0, 0.0, 0.0]), "top": np.array([0.0, 0.0, 1.0])}


@lru_cache(maxsize=8)
def _detector(lens: Camera) -> TagDetector:
    tags = Tags(TAG_DICTIONARY, TAG_SIZE, lens.intrinsics, symbols={tag: tag for tag in range(N_TAGS)})
    # OpenCV's own value: what was measured of the simulated robot was measured with it.
    return TagDetector(tags, apart=0.125)


def detect_markers(frame: NDArray[np.uint8], camera: Camera) -> list[DetectedTag]:
    """Return the tags 0 to 11 in an RGB frame of shape [height, width, 3], with their poses in the world."""
    # The tables of a detector depend on the lens, not on where the camera stands.
    lens = Camera(field_of_view=camera.field_of_view, image_size=camera.image_size)
    eye = np.array(camera.eye)
    found = _detector(lens).detect(frame)
    return [tag.moved(camera.rotation, eye) for tag in found if tag.symbol is not None]


def slot_markers(markers: Sequence[DetectedTag]) -> dict[str, DetectedTag | None]:
    """Return the marker in each slot, ``None`` where none faces its direction."""
    return {slot: tag_facing(markers, direction) for slot, direction in SLOT_DIRECTIONS.items()}


def detected_symbols(markers: Sequence[DetectedTag]) -> tuple[int, int]:
    """Return the symbols (front, top), ``MISSING`` where none was detected.

    No cube has a tag twice, so one symbol in both slots is an error of detection: neither is believed.
    """
    front, top = (MISSING if marker is None else marker.id for marker in slot_markers(markers).values())
    return (MISSING, MISSING) if front == top else (front, top)


def draw_detections(frame: NDArray[np.uint8], markers: Sequence[DetectedTag]) -> NDArray[np.uint8]:
    """Return a copy of an RGB frame with each marker outlined and named: its number, and its slot if it has one."""
    return draw_slots(frame, markers, slot_markers(markers))
