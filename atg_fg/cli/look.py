"""``atg-fg look``: the tags in images."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.table import Table

from atg_fg.cli import options
from atg_fg.cli.lens_options import (
    USUAL_FIELD_OF_VIEW,
    CalibrationFile,
    Dictionary,
    FieldOfView,
    TagsFile,
    TagSize,
    lens_of,
    tags_of,
)
from atg_fg.cli.paths import same_file
from atg_fg.core.errors import InvalidInputError
from atg_fg.storage import plain_files

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from atg_fg.senses.tags import DetectedTag, TagDetector
    from atg_fg.storage.camera_files import CubeTags


def look(
    images: Annotated[list[Path], options.argument(help="Photographs, PNG or JPEG.")],
    tags: TagsFile = None,
    dictionary: Dictionary = None,
    tag_size: TagSize = 45.0,
    calibration: CalibrationFile = None,
    field_of_view: FieldOfView = USUAL_FIELD_OF_VIEW,
    draw: Annotated[Path | None, options.written(help="Folder for the images with the tags drawn in.")] = None,
    json_file: options.JsonFile = None,
) -> None:
    """Look at photographs: which tags are in them, where, and how surely they were read.

    Without --tags and --dictionary the dictionary that fits best is found.

    Example: atg-fg look photograph.jpg --dictionary DICT_6X6_250 --draw seen
    """
    known = tags_of(tags, dictionary, tag_size)
    if draw is not None:
        _check_drawings(draw, images)
        plain_files.make_folder(draw)
    looks = [_look(image, known, tags, tag_size, calibration, field_of_view) for image in images]
    for path, image, detector, found in looks:
        if draw is not None:
            _draw(image, found, _drawing(draw, path))
        if json_file != "-":
            options.console().print(_table(str(path), detector, found) if found else f"{path}: no tags", soft_wrap=True)
    document = {"command": "look", "images": [_document(path, detector, found) for path, _, detector, found in looks]}
    options.write_json(document, json_file)


def _check_drawings(folder: Path, images: list[Path]) -> None:
    """Refuse a folder in which a drawing would overwrite an image, or another drawing."""
    drawings: dict[Path, Path] = {}
    for image in images:
        drawing = _drawing(folder, image)
        spared = next((each for each in images if same_file(each, drawing)), None) or drawings.get(drawing)
        if spared is not None:
            raise InvalidInputError(
                f"--draw: {drawing} would overwrite what is there of {spared}; expected another folder"
            )
        drawings[drawing] = image


def _drawing(folder: Path, image: Path) -> Path:
    return folder / f"{image.stem}.png"


def _look(
    path: Path,
    known: CubeTags | None,
    file: Path | None,
    tag_size: float,
    calibration: Path | None,
    field_of_view: float,
) -> tuple[Path, NDArray[np.uint8], TagDetector, list[DetectedTag]]:
    """Return an image, and the tags in it from above to below."""
    from atg_fg.senses.dictionary_search import find_dictionary
    from atg_fg.senses.tags import TagDetector
    from atg_fg.senses.video import read_image

    image = read_image(path)
    lens = lens_of(calibration, field_of_view, (image.shape[1], image.shape[0]), str(path))
    chosen = known or tags_of(None, find_dictionary(image) or "5X5_50", tag_size)
    assert chosen is not None
    detector = TagDetector(chosen.seen_by(lens))
    found = sorted(detector.detect(image), key=lambda tag: tuple(tag.corners.mean(axis=0)[::-1]))
    if file is not None:
        _check_cube(path, file, found)
    return path, image, detector, found


def _check_cube(path: Path, file: Path, found: list[DetectedTag]) -> None:
    """Refuse what no cube with the tags of a file can show."""
    ids = [tag.id for tag in found]
    for tag_id in ids:
        if ids.count(tag_id) > 1:
            raise InvalidInputError(f"{path}: tag {tag_id} is in view twice; expected each tag once")
    if found and all(tag.symbol is None for tag in found):
        raise InvalidInputError(f"{path}: tags {', '.join(map(str, ids))}; expected some of the tags in {file}")


def _draw(image: NDArray[np.uint8], found: list[DetectedTag], path: Path) -> None:
    from atg_fg.senses.opencv import png_of
    from atg_fg.senses.tag_drawing import draw_tags

    drawn = draw_tags(image, [(tag, str(tag.id), (0, 140, 60)) for tag in found])
    plain_files.write_bytes_atomically(path, png_of(drawn))


def _table(title: str, detector: TagDetector, found: list[DetectedTag]) -> Table:
    tags = detector.tags
    table = Table(title=f"{title}: {len(found)} tags of {tags.dictionary}", title_justify="left")
    for heading in ("id", "symbol", "x", "y", "side", "wrong cells", "certainty", "distance", "aslant"):
        table.add_column(heading, justify="right")
    for tag in found:
        x, y = tag.corners.mean(axis=0)
        assert tag.pose is not None
        table.add_row(
            str(tag.id),
            "-" if tag.symbol is None else str(tag.symbol),
            f"{x:.0f}",
            f"{y:.0f}",
            f"{tag.side:.0f} px",
            str(tag.distance),
            f"{_certainty(detector, tag):.3f}",
            f"{1000 * float(tag.pose.position[2]):.0f} mm",
            f"{_aslant(tag):.0f}°",
        )
    return table


def _certainty(detector: TagDetector, tag: DetectedTag) -> float:
    return detector.certainty(tag, len(detector.tags.all_symbols))


def _aslant(tag: DetectedTag) -> float:
    """Return the angle between a tag's normal and the line to the camera, degrees."""
    import numpy as np

    assert tag.pose is not None
    towards = -tag.pose.position / np.linalg.norm(tag.pose.position)
    return float(np.degrees(np.arccos(np.clip(tag.normal @ towards, -1, 1))))


def _document(path: Path, detector: TagDetector, found: list[DetectedTag]) -> dict[str, Any]:
    return {
        "image": str(path),
        "dictionary": detector.tags.dictionary,
        "tags": [
            {
                "id": tag.id,
                "symbol": tag.symbol,
                "corners_pixels": tag.corners.tolist(),
                "wrong_cells": tag.distance,
                "certainty": _certainty(detector, tag),
                "corner_error_pixels": None if tag.pose is None else tag.pose.corner_error,
                "position_metres": None if tag.pose is None else tag.pose.position.tolist(),
                "normal": tag.normal.tolist(),
            }
            for tag in found
        ],
    }
