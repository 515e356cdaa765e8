"""Fiducial tags in any image: which, where, and how sure, as a likelihood of each symbol.

A tag is a square of black and white cells in a black border; the cells code its id in a dictionary. OpenCV finds the
squares; here the cells are read again, so that a tag that was read badly says so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atg_fg.core.checks import finite_array, floats
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.patterns import Evidence, FloatArray, PatternAlphabet
from atg_fg.senses.opencv import cv2

#: Sides of tags and squares that are measured in numbers that OpenCV can work with, metres.
SIZES: Final = (1e-4, 1e3)
#: OpenCV's dictionaries of tags by name; ``DICT_`` before a name, and lower case, are taken too.
DICTIONARIES: Final[dict[str, int]] = {
    name.removeprefix("DICT_").upper(): getattr(cv2.aruco, name)
    for name in sorted(dir(cv2.aruco))
    if name.startswith("DICT_")
}
#: How well a tag's normal must agree with a slot's direction (a cosine: up to 45 degrees).
ALIGNMENT: Final = 0.7
#: Of a detection that is no tag at all, or of a tag that is not there, where the cells are read without a doubt.
FALSE_ALARM: Final = 1e-3
#: A detection is taken for its tag without reserve, so that it is learned from, from this certainty on.
CERTAIN: Final = 0.95

_CELL_ERROR = 0.005  # that a cell is read wrong although the corners are exact
_CELL_PIXELS = 8  # of a cell when it is read; its outer quarter is left out
_DISTORTIONS = (4, 5, 8, 12, 14)  # lengths of OpenCV's models of a lens


def dictionary_name(name: str) -> str:
    """Return the name in ``DICTIONARIES`` that ``name`` stands for, or raise ``UnknownNameError``."""
    plain = str(name).upper().removeprefix("DICT_")
    if plain not in DICTIONARIES:
        raise unknown_name("dictionary of tags", name, DICTIONARIES)
    return plain


def n_tags(dictionary: str) -> int:
    """Return how many tags a dictionary has; their ids are 0 to one less."""
    return len(_dictionary(dictionary).bytesList)


def tag_image(dictionary: str, tag_id: int, pixels: int) -> NDArray[np.uint8]:
    """Return a tag with its black border in grey levels, shape [pixels, pixels].

    Raises:
        UnknownNameError: There is no such dictionary.
        InvalidInputError: The dictionary has no such id.
    """
    check_ids(dictionary, [tag_id])
    return np.asarray(cv2.aruco.generateImageMarker(_dictionary(dictionary), int(tag_id), pixels), dtype=np.uint8)


def tag_cells(dictionary: str, tag_id: int) -> NDArray[np.uint8]:
    """Return the cells of a tag with its black border, 1 where white, shape [cells, cells]."""
    return (tag_image(dictionary, tag_id, _dictionary(dictionary).markerSize + 2) > 0).astype(np.uint8)


def check_ids(dictionary: str, ids: Sequence[int], place: str = "tag ids") -> tuple[int, ...]:
    """Return ids as integers, or raise ``InvalidInputError`` if one is repeated or not in the dictionary."""
    least, most = 0, n_tags(dictionary) - 1
    for tag_id in ids:
        whole = isinstance(tag_id, (int, np.integer)) and not isinstance(tag_id, bool)
        if not whole or not least <= tag_id <= most:
            raise InvalidInputError(
                f"{place}: {tag_id!r}; expected 0 to {most}, those of {dictionary_name(dictionary)}"
            )
    if len(set(ids)) != len(ids):
        raise InvalidInputError(f"{place}: {', '.join(map(str, ids))}; expected all different")
    return tuple(map(int, ids))


def _dictionary(name: str) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(DICTIONARIES[dictionary_name(name)])


@dataclass(frozen=True, eq=False)
class Tags:
    """Which tags to look for, and through which camera.

    Attributes:
        dictionary: Name of one of OpenCV's dictionaries, such as ``"5X5_50"`` or ``"APRILTAG_36H11"``.
        size: Side of a tag's black square, m.
        intrinsics: The camera matrix, shape [3, 3], pixels; without it tags have no poses.
        distortion: The lens as OpenCV has it, shape [4], [5], [8], [12] or [14]; none if not given.
        symbols: The symbol that each id stands for; each id for itself if not given.
        image_size: (width, height) that the camera matrix is for; images of another are refused if it is given.

    Raises:
        UnknownNameError: There is no such dictionary.
        InvalidInputError: A size that is not above 0, a matrix of another shape, ids that are not in the dictionary.
    """

    dictionary: str
    size: float
    intrinsics: ArrayLike | None = None
    distortion: ArrayLike | None = None
    symbols: Mapping[int, int] | None = None
    image_size: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "dictionary", dictionary_name(self.dictionary))
        if not SIZES[0] <= self.size <= SIZES[1]:
            raise InvalidInputError(
                f"size of tags: {self.size!r}; expected metres above 0, from {SIZES[0]:g} to {SIZES[1]:g}"
            )
        if self.intrinsics is not None:
            checked_intrinsics(self.intrinsics)
        if self.distortion is not None:
            checked_distortion(self.distortion)
        if self.symbols is not None:
            check_ids(self.dictionary, list(self.symbols))
            if len(set(self.symbols.values())) != len(self.symbols):
                raise InvalidInputError(f"symbols of tags: {dict(self.symbols)}; expected another symbol for each id")

    @property
    def all_symbols(self) -> Mapping[int, int]:
        """The symbol of each id that counts."""
        return (
            self.symbols if self.symbols is not None else {tag_id: tag_id for tag_id in range(n_tags(self.dictionary))}
        )


def checked_intrinsics(matrix: ArrayLike) -> FloatArray:
    """Return a camera matrix of shape [3, 3], or raise ``InvalidInputError``."""
    expected = "a camera matrix of 3 by 3 numbers, focal lengths above 0, the last row 0, 0, 1"
    made = finite_array(matrix, "intrinsics", (3, 3), expected).copy()
    if not (made[0, 0] > 0 and made[1, 1] > 0) or made[2].tolist() != [0, 0, 1]:
        raise InvalidInputError(f"intrinsics: {made.tolist()}; expected {expected}")
    return made


def checked_distortion(coefficients: ArrayLike) -> FloatArray:
    """Return the coefficients of a lens, or raise ``InvalidInputError``."""
    expected = ", ".join(map(str, _DISTORTIONS))
    made = floats(coefficients, "distortion", f"numbers, {expected} of them").ravel()
    if len(made) not in _DISTORTIONS:
        raise InvalidInputError(f"distortion: {len(made)} numbers; expected {expected}")
    return finite_array(made, "distortion", (None,), "finite numbers")


@dataclass(frozen=True, eq=False)
class TagPose:
    """Where a tag is, and how it is turned.

    Attributes:
        position: Of its middle, shape [3], m, in the camera's frame (x right, y down, z forward) unless it was moved.
        rotation: From the tag's frame (x right, y up, z its normal) to that frame, shape [3, 3].
        corner_error: How far the corners lie from where the pose would have them, root of the mean square, pixels.
        other_rotation: Of the other pose that shows a square much alike, shape [3, 3]; ``None`` if there is none.
        ambiguity: Error of this pose over that of the other one, 0 (clear) to 1.
    """

    position: FloatArray
    rotation: FloatArray
    corner_error: float = 0.0
    other_rotation: FloatArray | None = None
    ambiguity: float = 0.0

    def moved(self, rotation: FloatArray, translation: FloatArray) -> TagPose:
        """Return the pose in another frame: x becomes ``rotation @ x + translation``."""
        return replace(
            self,
            position=np.asarray(rotation @ self.position + translation),
            rotation=rotation @ self.rotation,
            other_rotation=None if self.other_rotation is None else rotation @ self.other_rotation,
        )


@dataclass(frozen=True, eq=False)
class DetectedTag:
    """A tag that was seen.

    Attributes:
        id: In the dictionary.
        symbol: What the id stands for, ``None`` if it is not among the tags that count.
        corners: In the image, clockwise from the tag's upper left, shape [4, 2], pixels.
        distance: Cells that were read otherwise than the id has them (Hamming distance).
        whiteness: Share of white in each inner cell, shape [cells, cells].
        pose: ``None`` without a camera matrix.
    """

    id: int
    symbol: int | None
    corners: FloatArray
    distance: int
    whiteness: FloatArray
    pose: TagPose | None = None

    @property
    def _posed(self) -> TagPose:
        if self.pose is None:
            raise InvalidInputError(f"tag {self.id}: no pose; expected the intrinsics of the camera")
        return self.pose

    @property
    def rotation(self) -> FloatArray:
        """From the tag's frame (x right, y up, z its normal), shape [3, 3]."""
        return self._posed.rotation

    @property
    def normal(self) -> FloatArray:
        """Outward normal, shape [3]."""
        return self._posed.rotation[:, 2]

    def behind(self, depth: float) -> FloatArray:
        """Return the point ``depth`` metres behind its middle, shape [3]: the middle of a cube of twice that side."""
        return np.asarray(self._posed.position - depth * self.normal)

    @property
    def side(self) -> float:
        """Mean length of its sides in the image, pixels."""
        return float(np.linalg.norm(self.corners - np.roll(self.corners, 1, axis=0), axis=1).mean())

    def moved(self, rotation: FloatArray, translation: FloatArray) -> DetectedTag:
        """Return the tag with its pose in another frame: x becomes ``rotation @ x + translation``."""
        return replace(self, pose=self._posed.moved(rotation, translation))


class TagDetector:
    """Finds tags in images.

    Args:
        tags: Which tags, and through which camera.
        apart: Squares that lie closer together than this share of their perimeter are taken for one. The border of a
            face must not be taken for that of the tag on it.
    """

    def __init__(self, tags: Tags, *, apart: float = 0.05) -> None:
        self.tags = tags
        self._dictionary = _dictionary(tags.dictionary)
        parameters = cv2.aruco.DetectorParameters()
        # Lines fitted to a tag's sides: sub-pixel search strays on a foreshortened face (p95 of a cube's centre 14 mm,
        # against 6 mm).
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_CONTOUR
        parameters.minMarkerDistanceRate = apart
        self._detector = cv2.aruco.ArucoDetector(self._dictionary, parameters)
        half = tags.size / 2
        self._square = half * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]], dtype=np.float32)
        self._cells = self._dictionary.markerSize
        self._intrinsics = None if tags.intrinsics is None else checked_intrinsics(tags.intrinsics)
        self._distortion = None if tags.distortion is None else checked_distortion(tags.distortion)

    def detect(self, image: NDArray[np.uint8]) -> list[DetectedTag]:
        """Return the tags in an image, RGB of shape [height, width, 3] or grey of shape [height, width].

        Raises:
            InvalidInputError: No such image, or one of another size than the camera was calibrated for.
        """
        grey = self._grey(image)
        all_corners, ids, _ = self._detector.detectMarkers(grey)
        if ids is None:
            return []
        found = zip(all_corners, map(int, np.ravel(ids)), strict=True)
        return [self._read(grey, corners.reshape(4, 2), tag_id) for corners, tag_id in found]

    def _grey(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        if getattr(image, "dtype", None) != np.uint8 or image.ndim not in (2, 3) or 0 in image.shape:
            raise InvalidInputError(
                f"image: {getattr(image, 'dtype', type(image).__name__)} of shape {np.shape(image)}; expected bytes of "
                "shape [height, width, 3] (RGB) or [height, width]"
            )
        size = (image.shape[1], image.shape[0])
        if self.tags.image_size is not None and size != tuple(self.tags.image_size):
            raise InvalidInputError(
                f"image: {size[0]} by {size[1]} pixels; expected {self.tags.image_size[0]} by "
                f"{self.tags.image_size[1]}, which the camera was calibrated for"
            )
        if image.ndim == 2:
            return image
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)

    def _read(self, grey: NDArray[np.uint8], corners: NDArray[Any], tag_id: int) -> DetectedTag:
        whiteness = self._whiteness(grey, corners)
        bits = (whiteness > 0.5).astype(np.uint8)
        distance = int(self._dictionary.getDistanceToId(bits, tag_id, False))
        tag = DetectedTag(tag_id, self.tags.all_symbols.get(tag_id), corners.astype(np.float64), distance, whiteness)
        return tag if self._intrinsics is None else self._located(tag, corners, self._intrinsics)

    def _located(self, tag: DetectedTag, corners: NDArray[Any], intrinsics: FloatArray) -> DetectedTag:
        # Of the two poses that show a square alike, OpenCV puts the one with the smaller error first.
        _, rotations, translations, errors = cv2.solvePnPGeneric(
            self._square, corners, intrinsics, self._distortion, flags=cv2.SOLVEPNP_IPPE_SQUARE
        )
        first, *second = np.ravel(errors).tolist()
        ambiguity = min(1.0, first / second[0]) if second and second[0] > 0 else 1.0
        rotation, *others = (np.asarray(cv2.Rodrigues(each)[0], dtype=np.float64) for each in rotations)
        other = others[0] if others else None
        return replace(tag, pose=TagPose(np.ravel(translations[0]), rotation, first, other, ambiguity))

    def _whiteness(self, grey: NDArray[np.uint8], corners: NDArray[Any]) -> FloatArray:
        """Return the share of white in each inner cell, from a picture of the tag seen straight on."""
        cells = self._cells + 2
        side = cells * _CELL_PIXELS
        square = np.array([[0, 0], [side, 0], [side, side], [0, side]], dtype=np.float32) - 0.5
        straight = cv2.getPerspectiveTransform(corners.astype(np.float32), square)
        seen = cv2.warpPerspective(grey, straight, (side, side))
        _, white = cv2.threshold(seen, 0, 1, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
        margin = _CELL_PIXELS // 4
        each = np.reshape(white, (cells, _CELL_PIXELS, cells, _CELL_PIXELS))
        inner: FloatArray = each[:, margin:-margin, :, margin:-margin].mean(axis=(1, 3))
        return inner[1:-1, 1:-1]

    @cached_property
    def _codes(self) -> FloatArray:
        """Inner cells of each id that counts, in the tag's four rotations, shape [ids, 4, cells, cells]."""
        upright = [tag_cells(self.tags.dictionary, tag_id)[1:-1, 1:-1] for tag_id in self.tags.all_symbols]
        return np.array([[np.rot90(cells, turns) for turns in range(4)] for cells in upright], dtype=np.float64)

    def likelihood(self, tag: DetectedTag, n_symbols: int) -> FloatArray:
        """Return how probable what was read is if each symbol is there, up to a factor, shape [symbols].

        Each cell is read wrong by itself, with a probability that grows with the error of the corners: where they are
        off by a share of a cell, that share of its neighbours is taken for it. A cell half white and half black says
        nothing. What was read may also be no tag at all, in ``FALSE_ALARM`` of the cases, and then says nothing.
        """
        cell = tag.side / (self._cells + 2)
        off = 0.0 if tag.pose is None else min(1.0, tag.pose.corner_error / cell)
        wrong = min(0.5, _CELL_ERROR + 0.5 * off)
        agreement = np.where(self._codes == 1, tag.whiteness, 1 - tag.whiteness)
        logs = np.log((1 - 2 * wrong) * agreement + wrong).sum(axis=(2, 3)).max(axis=1)
        shares = np.exp(logs - logs.max())
        told = np.zeros(n_symbols)
        symbols = np.fromiter(self.tags.all_symbols.values(), dtype=np.int64)
        kept = symbols < n_symbols
        told[symbols[kept]] = shares[kept]
        total = told.sum()
        if not total:
            return np.ones(n_symbols)
        return np.asarray((1 - FALSE_ALARM) * told / total + FALSE_ALARM / n_symbols)

    def certainty(self, tag: DetectedTag, n_symbols: int) -> float:
        """Return the probability of the tag's own symbol if all were equally probable before; 0 if it has none."""
        if tag.symbol is None or tag.symbol >= n_symbols:
            return 0.0
        likelihood = self.likelihood(tag, n_symbols)
        return float(likelihood[tag.symbol] / likelihood.sum())

    def evidence(self, alphabet: PatternAlphabet, in_slots: Mapping[str, DetectedTag | None]) -> Evidence:
        """Return what the tags in the slots say about the pattern shown; a slot without one says nothing.

        Raises:
            InvalidInputError: One id in two slots, which no pattern has.
        """
        seen = [in_slots.get(slot) for slot in alphabet.slots]
        ids = [tag.id for tag in seen if tag is not None]
        if len(set(ids)) != len(ids):
            raise InvalidInputError(f"tags: {', '.join(map(str, ids))} in view at once; expected no id twice")
        likelihood = np.ones(len(alphabet))
        detection: list[int | None] = [None] * len(seen)
        certainties: list[float | None] = [None] * len(seen)
        for slot, tag in enumerate(seen):
            if tag is not None:
                likelihood *= self.likelihood(tag, alphabet.n_symbols)[alphabet.symbols[:, slot]]
                detection[slot] = tag.symbol
                certainties[slot] = None if tag.symbol is None else self.certainty(tag, alphabet.n_symbols)
        certain = all(certainty is not None and certainty >= CERTAIN for certainty in certainties)
        pattern = alphabet.index([symbol for symbol in detection if symbol is not None]) if certain else None
        return Evidence(likelihood, pattern, tuple(detection), tuple(certainties))


def tag_facing(tags: Sequence[DetectedTag], direction: FloatArray) -> DetectedTag | None:
    """Return the tag that faces a direction best, ``None`` if none does within ``ALIGNMENT``."""
    facing = [tag for tag in tags if tag.normal @ direction > ALIGNMENT]
    return max(facing, key=lambda tag: float(tag.normal @ direction), default=None)
