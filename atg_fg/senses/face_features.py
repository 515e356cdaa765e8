"""What the picture on a square face looks like, whichever of its four sides is up, and what a whole view looks like.

A crop is divided into a grid. A quarter turn of the crop permutes its cells and the directions in them, so the four
turns of a crop make a signal over the group C₄, and the magnitudes of its Fourier transform are the same for all four.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.checks import finite_array, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.core.plugins import imported, told

Image: TypeAlias = NDArray[np.uint8]
#: Turns a crop, RGB of shape [height, width, 3], into features of shape [F].
FaceFeatures: TypeAlias = Callable[[Image], FloatArray]

#: Name of ``colours_and_gradients``.
DEFAULT_FEATURES: Final = "colours-and-gradients"
#: Name of ``view_features``.
VIEW_FEATURES: Final = "grid-and-gradients"
#: Side of a crop of a face, and of a whole view, pixels.
CROP: Final = 48
VIEW: Final = 96
_GRID: Final = 6  # cells a side
_DIRECTIONS: Final = 8  # of gradients, without their sign
_QUARTER: Final = _GRID // 2
#: Lightness and colours, and gradients, on scales of their own.
_COLOUR_SCALE: Final = 1 / 64
_LEAST_GRADIENT: Final = 20.0


def colours_and_gradients(crop: Image) -> FloatArray:
    """Return the features of a square crop, shape [297], the same for each quarter turn of it.

    Raises:
        InvalidInputError: Not RGB, or not a square of at least ``CROP`` pixels.
    """
    check_image(crop, "crop", (CROP, CROP))
    colours, gradients = _grids(crop)
    turned = [
        np.concatenate(
            (np.rot90(colours, turn), np.roll(np.rot90(gradients, turn), turn * _DIRECTIONS // 2, axis=-1)), axis=-1
        )
        for turn in range(4)
    ]
    quarter = np.array([each[:_QUARTER, :_QUARTER].ravel() for each in turned])
    # Of the four magnitudes the last is that of the second again.
    features: FloatArray = np.abs(np.fft.fft(quarter, axis=0))[:3].ravel().astype(np.float64) / 2
    return features


def view_features(view: Image) -> FloatArray:
    """Return the features of a whole view, shape [396]: those of a crop for the way in which it is turned.

    Raises:
        InvalidInputError: Not RGB, or not a square of ``VIEW`` pixels.
    """
    check_image(view, "view", (VIEW, VIEW))
    features: FloatArray = np.concatenate(_grids(view), axis=-1).ravel().astype(np.float64)
    return features


def _grids(crop: Image) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return colours and directions of gradients in each cell, shapes [cells, cells, 3] and [cells, cells, 8]."""
    from atg_fg.senses.opencv import cv2  # whoever only reads a sense from a file needs none

    lab = cv2.cvtColor(crop, cv2.COLOR_RGB2LAB).astype(np.float32)
    cells = (_GRID, _GRID)
    colours = cv2.resize(lab, cells, interpolation=cv2.INTER_AREA) * _COLOUR_SCALE
    smooth = cv2.GaussianBlur(lab[..., 0], (0, 0), 1.0)
    across, down = cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)
    strength = np.hypot(across, down)
    angle = (np.arctan2(down, across) % np.pi) / np.pi * _DIRECTIONS
    # Each gradient counts for the two directions that it lies between.
    apart = np.abs((angle[..., None] - np.arange(_DIRECTIONS) + _DIRECTIONS / 2) % _DIRECTIONS - _DIRECTIONS / 2)
    gradients = cv2.resize(
        np.ascontiguousarray(strength[..., None] * np.clip(1 - apart, 0, 1)), cells, interpolation=cv2.INTER_AREA
    )
    gradients = np.sqrt(gradients / (gradients.sum(axis=-1, keepdims=True) + _LEAST_GRADIENT))
    return np.asarray(colours), np.asarray(gradients)


def check_image(image: Image, place: str, size: tuple[int, int] | None = None) -> None:
    """Raise ``InvalidInputError`` naming ``place`` unless this is an RGB image, of (width, height) if that is given."""
    found: tuple[int, ...] = getattr(image, "shape", ())
    expected = "width and height" if size is None else f"{size[0]} by {size[1]} pixels"
    right = len(found) == 3 and found[2] == 3 and getattr(image, "dtype", None) == np.uint8
    if not right or (size is not None and found[:2] != size[::-1]):
        dtype = getattr(image, "dtype", type(image).__name__)
        raise InvalidInputError(f"{place}: shape {found} of {dtype}; expected RGB bytes, {expected}")


def rectified(frame: Image, corners: FloatArray, size: int = CROP) -> Image:
    """Return a planar square in a frame as it looks from straight ahead, RGB of shape [size, size, 3].

    Args:
        frame: RGB.
        corners: Of the square in the frame, clockwise from its upper left one, shape [4, 2], pixels.
        size: Side of what is returned, pixels.

    Raises:
        InvalidInputError: A frame that is not RGB, or corners that are not four points.
    """
    check_image(frame, "frame")
    corners = finite_array(corners, "corners", (4, 2), "four corners (x, y), pixels")
    whole_number(size, "size", 1)
    from atg_fg.senses.opencv import cv2

    square = np.array([[0, 0], [size, 0], [size, size], [0, size]], dtype=np.float32)
    homography = cv2.getPerspectiveTransform(corners.astype(np.float32), square)
    return np.asarray(cv2.warpPerspective(frame, homography, (size, size), flags=cv2.INTER_AREA), dtype=np.uint8)


_FEATURES: Final[dict[str, FaceFeatures]] = {DEFAULT_FEATURES: colours_and_gradients, VIEW_FEATURES: view_features}


def face_features(name: str) -> FaceFeatures:
    """Return features by name.

    That is ``DEFAULT_FEATURES``, ``VIEW_FEATURES``, or ``module:function`` of a user's own, such as an embedding.
    Such a name runs code: it is to come from a user, never from a file.

    Raises:
        InvalidInputError: There is no such function; what is returned raises it for a function that fails, or returns
            anything but finite numbers along one axis.
    """
    if isinstance(name, str) and name in _FEATURES:
        return _FEATURES[name]
    found = imported("features", name) if isinstance(name, str) and ":" in name else None
    if not callable(found):
        raise InvalidInputError(f"features: {name!r}; expected {', '.join(map(repr, _FEATURES))} or module:function")

    def checked(crop: Image) -> FloatArray:
        try:
            made = np.asarray(found(crop))
        except (Exception, SystemExit) as error:  # whatever a user's function does
            given = f"a crop of shape {getattr(crop, 'shape', ())}"
            raise InvalidInputError(f"features {name!r}: {given}: {told(error)}; expected numbers of it") from error
        values = finite_array(made, f"features {name!r}", (None,), "numbers along one axis")
        if not len(values):
            raise InvalidInputError(f"features {name!r}: no numbers; expected at least one")
        return values

    return checked
