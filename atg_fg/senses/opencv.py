"""OpenCV, or the one line that says which extra brings it."""

from __future__ import annotations

import os

from atg_fg.core.errors import MissingDependencyError
from atg_fg.senses.frame_reader import MOST_PIXELS

# An image of more pixels than this is refused by OpenCV itself: a small file can unfold to gigabytes. OpenCV reads the
# limit when it is imported.
os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(MOST_PIXELS))

try:
    import cv2
except ImportError as error:
    raise MissingDependencyError(
        "cameras and tags: the package opencv-python-headless is not installed; expected the extra 'vision': "
        'pip install "atg-fg[vision]"'
    ) from error

__all__ = ["cv2"]
