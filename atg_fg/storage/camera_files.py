"""Files of a camera's calibration, and of the tags on cubes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from atg_fg.core.checks import number, plain_text, whole_number
from atg_fg.core.errors import InvalidInputError, placed
from atg_fg.senses.camera_calibration import Calibration
from atg_fg.senses.tags import Tags, check_ids, dictionary_name
from atg_fg.storage.checked_json import check_format, parse_json, read_entries, read_list, read_object
from atg_fg.storage.plain_files import read_text_file

CALIBRATION_FORMAT: Final = "atg-fg/camera"
TAGS_FORMAT: Final = "atg-fg/tags"


def write_calibration(calibration: Calibration) -> dict[str, Any]:
    """Return a calibration as a JSON document."""
    return {
        "format": CALIBRATION_FORMAT,
        "version": 1,
        "image_size": list(calibration.image_size),
        "intrinsics": np.asarray(calibration.intrinsics).tolist(),
        "distortion": np.ravel(calibration.distortion).tolist(),
        "error_pixels": calibration.error,
        "pictures": calibration.n_pictures,
    }


def read_calibration(path: Path | str) -> Calibration:
    """Return the calibration in a file.

    Raises:
        InvalidInputError: The file cannot be read or is no calibration; the message names the place.
    """
    place = str(path)
    document = parse_json(read_text_file(path), place)
    keys = ("format", "version", "image_size", "intrinsics", "distortion")
    read_object(document, place, keys, ("error_pixels", "pictures"))
    check_format(document, CALIBRATION_FORMAT, place)
    size = read_list(document["image_size"], f"{place}: image_size")
    if len(size) != 2:
        raise InvalidInputError(f"{place}: image_size: {size!r}; expected width and height")
    width, height = (whole_number(side, f"{place}: image_size", 1) for side in size)
    with placed(place):
        return Calibration(
            document["intrinsics"], document["distortion"], (width, height), document.get("error_pixels")
        )


@dataclass(frozen=True)
class CubeTags:
    """The tags of one cube or several, as they are printed and as a camera is to read them.

    Attributes:
        dictionary: Of the tags.
        size: Side of a tag, m.
        ids: All tags; a tag's symbol is its place here.
        cubes: Ids on the faces of each cube, in the order of ``atg_fg.worlds.arcube.FACES``; none if it is not known.

    Raises:
        UnknownNameError: There is no such dictionary.
        InvalidInputError: A size that is not above 0, ids that are not in the dictionary or repeated, faces that are
            not six of them.
    """

    dictionary: str
    size: float
    ids: tuple[int, ...]
    cubes: tuple[tuple[int, ...], ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "dictionary", dictionary_name(self.dictionary))
        if not 0 < self.size < math.inf:
            raise InvalidInputError(f"size of tags: {self.size!r}; expected metres above 0")
        check_ids(self.dictionary, self.ids)
        if len(self.ids) < 2:
            raise InvalidInputError(f"tag ids: {list(self.ids)}; expected at least two, for front and top")
        for index, faces in enumerate(self.cubes):
            if len(faces) != 6 or not set(faces) <= set(self.ids) or len(set(faces)) != 6:
                raise InvalidInputError(f"cubes[{index}]: {list(faces)}; expected six different ids of these tags")

    def seen_by(self, calibration: Calibration) -> Tags:
        """Return what a detector is to look for through a camera."""
        symbols = {tag_id: symbol for symbol, tag_id in enumerate(self.ids)}
        return Tags(
            self.dictionary,
            self.size,
            np.asarray(calibration.intrinsics),
            np.asarray(calibration.distortion),
            symbols,
            calibration.image_size,
        )


def write_tags(tags: CubeTags) -> dict[str, Any]:
    """Return tags as a JSON document."""
    return {
        "format": TAGS_FORMAT,
        "version": 1,
        "dictionary": tags.dictionary,
        "size_metres": tags.size,
        "ids": list(tags.ids),
        "cubes": [list(faces) for faces in tags.cubes],
    }


def read_tags(path: Path | str) -> CubeTags:
    """Return the tags in a file.

    Raises:
        UnknownNameError: There is no such dictionary.
        InvalidInputError: The file cannot be read or is none of tags; the message names the place.
    """
    place = str(path)
    document = parse_json(read_text_file(path), place)
    read_object(document, place, ("format", "version", "dictionary", "size_metres", "ids"), ("cubes",))
    check_format(document, TAGS_FORMAT, place)
    size = number(document["size_metres"], f"{place}: size_metres", least=0.0)
    ids = _ids(document["ids"], f"{place}: ids")
    faces = tuple(_ids(each, where) for each, where in read_entries(document.get("cubes", []), f"{place}: cubes"))
    with placed(place):
        return CubeTags(plain_text(document["dictionary"], "dictionary"), size, ids, faces)


def _ids(value: Any, place: str) -> tuple[int, ...]:
    return tuple(whole_number(each, place, 0) for each in read_list(value, place))
