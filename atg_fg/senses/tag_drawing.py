"""Tags drawn into the image that they were seen in."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from atg_fg.senses.opencv import cv2
from atg_fg.senses.tags import DetectedTag

Colour: TypeAlias = tuple[int, int, int]
#: Colours of tags in slots, and of others, RGB.
SLOT_COLOURS: dict[str | None, Colour] = {"front": (230, 90, 0), "top": (0, 140, 60), None: (128, 128, 128)}


def draw_tags(image: NDArray[np.uint8], tags: Iterable[tuple[DetectedTag, str, Colour]]) -> NDArray[np.uint8]:
    """Return a copy of an RGB image with each tag outlined and named by its text, in its colour."""
    drawn = image.copy()
    for tag, text, colour in tags:
        cv2.polylines(drawn, [np.round(tag.corners).astype(np.int32)], True, colour, 2, cv2.LINE_AA)
        (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.5, 1)
        x, y = np.round(tag.corners.mean(axis=0)).astype(int).tolist()
        left, bottom = x - width // 2, y + height // 2
        box = (left - 3, bottom + 4), (left + width + 3, bottom - height - 4)
        cv2.rectangle(drawn, *box, colour, -1)
        cv2.putText(drawn, text, (left, bottom), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (255, 255, 255), 1, cv2.LINE_AA)
    return drawn


def draw_slots(
    image: NDArray[np.uint8], tags: Iterable[DetectedTag], in_slots: dict[str, DetectedTag | None]
) -> NDArray[np.uint8]:
    """Return a copy of an RGB image with each tag outlined and named: its symbol, or id, and its slot if it has one."""
    slots = {id(tag): slot for slot, tag in in_slots.items() if tag is not None}
    named = []
    for tag in tags:
        slot, number = slots.get(id(tag)), tag.id if tag.symbol is None else tag.symbol
        named.append((tag, f"{number}" if slot is None else f"{slot} {number}", SLOT_COLOURS[slot]))
    return draw_tags(image, named)
