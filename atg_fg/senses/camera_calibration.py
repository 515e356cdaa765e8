"""Calibration of a camera from pictures of a board (Zhang's method, OpenCV's ChArUco boards)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.senses.opencv import cv2
from atg_fg.senses.tags import DICTIONARIES, SIZES, check_ids, checked_distortion, checked_intrinsics, dictionary_name

#: Pictures that show the board, at least.
LEAST_PICTURES: Final = 5
_LEAST_CORNERS = 6  # of a board in a picture that is used


@dataclass(frozen=True, eq=False)
class Calibration:
    """How a camera maps directions to pixels.

    Attributes:
        intrinsics: The camera matrix, shape [3, 3], pixels.
        distortion: The lens as OpenCV has it, five numbers or more.
        image_size: (width, height) of the images that this is for, pixels.
        error: Root of the mean square by which corners of the board lie off, pixels; ``None`` if nothing was measured.
        n_pictures: Pictures that it was measured from.

    Raises:
        InvalidInputError: A matrix of another shape, or a size below 1.
    """

    intrinsics: FloatArray
    distortion: FloatArray
    image_size: tuple[int, int]
    error: float | None = None
    n_pictures: int = 0

    def __post_init__(self) -> None:
        checked_intrinsics(self.intrinsics)
        checked_distortion(self.distortion)
        if len(self.image_size) != 2 or min(self.image_size) < 1:
            raise InvalidInputError(f"image size: {self.image_size!r}; expected width and height in pixels")

    @classmethod
    def guessed(cls, image_size: tuple[int, int], field_of_view: float) -> Calibration:
        """Return an ideal camera of a horizontal field of view in degrees: good enough to tell how a cube was turned.

        Raises:
            InvalidInputError: The field of view is not between 0 and 180 degrees.
        """
        if not 0 < field_of_view < 180:
            raise InvalidInputError(f"field of view: {field_of_view!r}; expected degrees between 0 and 180")
        width, height = image_size
        focal = width / 2 / math.tan(math.radians(field_of_view) / 2)
        return cls(np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]]), np.zeros(5), image_size)

    @property
    def field_of_view(self) -> float:
        """Horizontal, degrees."""
        return math.degrees(2 * math.atan(self.image_size[0] / 2 / float(self.intrinsics[0, 0])))


@dataclass(frozen=True)
class CalibrationBoard:
    """A chessboard with a tag in each white square (ChArUco).

    Attributes:
        columns: Squares across.
        rows: Squares down.
        square: Side of a square, m.
        tag: Side of a tag, m.
        dictionary: Of the tags.

    Raises:
        UnknownNameError: There is no such dictionary.
        InvalidInputError: Fewer than 3 squares a side, tags not smaller than squares, or more tags than there are.
    """

    columns: int = 7
    rows: int = 5
    square: float = 0.035
    tag: float = 0.026
    dictionary: str = "5X5_50"

    def __post_init__(self) -> None:
        object.__setattr__(self, "dictionary", dictionary_name(self.dictionary))
        if min(self.columns, self.rows) < 3:
            raise InvalidInputError(f"board: {self.columns} by {self.rows} squares; expected at least 3 by 3")
        if not SIZES[0] <= self.square / 5 <= self.tag < self.square <= SIZES[1]:
            raise InvalidInputError(
                f"board: squares of {self.square} m, tags of {self.tag} m; expected smaller tags, of a fifth at least, "
                f"and from {SIZES[0]:g} to {SIZES[1]:g} m"
            )
        check_ids(self.dictionary, range(self.columns * self.rows // 2), "tags of the board")

    def image(self, pixels_a_square: int) -> NDArray[np.uint8]:
        """Return the board in grey levels, shape [rows × pixels, columns × pixels]."""
        size = (self.columns * pixels_a_square, self.rows * pixels_a_square)
        return np.asarray(self._made.generateImage(size), dtype=np.uint8)

    @property
    def _made(self) -> cv2.aruco.CharucoBoard:
        dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARIES[self.dictionary])
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square, self.tag, dictionary)

    def corners(self, image: NDArray[np.uint8]) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
        """Return corners seen in an image: on the board, shape [n, 3], m, and in the image, shape [n, 2], pixels.

        ``None`` where there are too few of them, or all of them on a line.
        """
        corners, ids, _, _ = cv2.aruco.CharucoDetector(self._made).detectBoard(image)
        if ids is None or len(ids) < _LEAST_CORNERS:
            return None
        numbers = np.ravel(ids)
        on_board = np.asarray(self._made.getChessboardCorners(), dtype=np.float32)[numbers]
        if np.linalg.matrix_rank(on_board[:, :2] - on_board[:, :2].mean(axis=0)) < 2:
            return None
        return on_board, np.asarray(corners, dtype=np.float32).reshape(-1, 2)


def calibrate(images: Iterable[tuple[str, NDArray[np.uint8]]], board: CalibrationBoard) -> Calibration:
    """Return the calibration of a camera from pictures of a board, each seen from elsewhere.

    Args:
        images: Name and picture, RGB of shape [height, width, 3]; those that do not show the board are left out.
        board: What they show.

    Raises:
        InvalidInputError: Pictures of different sizes, or fewer than ``LEAST_PICTURES`` that show the board.
    """
    size: tuple[int, int] | None = None
    found = []
    n_images = 0
    for name, image in images:
        n_images += 1
        own = (image.shape[1], image.shape[0])
        if size is not None and own != size:
            raise InvalidInputError(
                f"{name}: {own[0]} by {own[1]} pixels; expected {size[0]} by {size[1]}, as of the pictures before it"
            )
        size = own
        seen = board.corners(np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8))
        if seen is not None:
            found.append(seen)
    if size is None or len(found) < LEAST_PICTURES:
        raise InvalidInputError(
            f"calibration: the board is seen in {len(found)} of {n_images} pictures; expected at least "
            f"{LEAST_PICTURES}, of a board of {board.columns} by {board.rows} squares with tags of {board.dictionary}"
        )
    start = Calibration.guessed(size, 60).intrinsics
    error, intrinsics, distortion, _, _ = cv2.calibrateCamera(
        [on_board for on_board, _ in found], [in_image for _, in_image in found], size, start, np.zeros(5)
    )
    return Calibration(
        np.asarray(intrinsics, dtype=np.float64),
        np.ravel(distortion).astype(np.float64),
        size,
        float(error),
        len(found),
    )
