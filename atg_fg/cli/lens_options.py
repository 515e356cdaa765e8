"""Options of the commands that look through a camera: which tags, and which lens."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from atg_fg.core.errors import InvalidInputError

if TYPE_CHECKING:
    from atg_fg.senses.camera_calibration import Calibration
    from atg_fg.storage.camera_files import CubeTags

#: Horizontal field of view of an ordinary webcam, degrees.
USUAL_FIELD_OF_VIEW = 60.0

TagsFile = Annotated[Path | None, typer.Option("--tags", help="Tags of the cubes, as print cube wrote them (JSON).")]
Dictionary = Annotated[
    str | None, typer.Option(help="Dictionary of the tags, such as DICT_5X5_50; instead of --tags.", show_default=False)
]
TagSize = Annotated[float, typer.Option(help="Side of a tag's black square, mm; goes with --dictionary.")]
CalibrationFile = Annotated[
    Path | None, typer.Option("--calibration", help="Calibration of the camera, as camera calibrate wrote it (JSON).")
]
FieldOfView = Annotated[
    float, typer.Option(help="Horizontal field of view of a camera without a calibration, degrees.")
]


def numbers_of(text: str, option: str) -> tuple[int, ...]:
    """Return the whole numbers of a text such as ``0-5,8``."""
    numbers: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdecimal() or (dash and not last.isdecimal()) or len(part) > 20:
            raise InvalidInputError(f"{option}: {text!r}; expected whole numbers and ranges, such as 0-5,8")
        begin, end = int(first), int(last or first)
        if end < begin or end - begin > 10_000:
            raise InvalidInputError(f"{option}: {part!r}; expected a range from low to high, of at most 10000")
        numbers += range(begin, end + 1)
    return tuple(numbers)


def tags_of(file: Path | None, dictionary: str | None, tag_size: float) -> CubeTags | None:
    """Return the tags that the options name; ``None`` if neither a file nor a dictionary was given."""
    from atg_fg.senses.tags import n_tags
    from atg_fg.storage.camera_files import CubeTags, read_tags

    if file is not None and dictionary is not None:
        raise InvalidInputError(f"--dictionary: {dictionary}; expected none with --tags, whose file says it")
    if file is not None:
        return read_tags(file)
    if dictionary is None:
        return None
    return CubeTags(dictionary, tag_size / 1000, tuple(range(n_tags(dictionary))))


def lens_of(file: Path | None, field_of_view: float, image_size: tuple[int, int], name: str) -> Calibration:
    """Return the calibration for images of this size, guessed from the field of view if no file is given."""
    from atg_fg.senses.camera_calibration import Calibration
    from atg_fg.storage.camera_files import read_calibration

    if file is None:
        return Calibration.guessed(image_size, field_of_view)
    calibration = read_calibration(file)
    if calibration.image_size != image_size:
        raise InvalidInputError(
            f"{name}: {image_size[0]} by {image_size[1]} pixels; expected {calibration.image_size[0]} by "
            f"{calibration.image_size[1]}, which {file} was made for"
        )
    return calibration
