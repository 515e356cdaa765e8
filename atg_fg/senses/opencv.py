"""OpenCV, or the one line that says which extra brings it."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import needed_by
from atg_fg.senses.frame_reader import MOST_PIXELS

# An image of more pixels than this is refused by OpenCV itself: a small file can unfold to gigabytes. OpenCV reads the
# limit when it is imported.
os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(MOST_PIXELS))

with needed_by("cameras and tags", "opencv-python-headless", "vision"):
    import cv2

__all__ = ["cv2", "png_of"]


def png_of(picture: NDArray[np.uint8]) -> bytes:
    """Return an RGB picture, shape [height, width, 3], as PNG."""
    return bytes(cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))[1])
