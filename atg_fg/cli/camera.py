"""``atg-fg camera``: calibration from pictures of a board."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.errors import InvalidInputError
from atg_fg.storage import plain_files

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

app = typer.Typer(help="Cameras: calibration. Example: atg-fg camera calibrate --video board.mp4", no_args_is_help=True)

Columns = Annotated[int, typer.Option(help="Squares of the board across.")]
Rows = Annotated[int, typer.Option(help="Squares of the board down.")]
Square = Annotated[float, typer.Option(help="Side of a square, mm.")]
BoardTag = Annotated[float, typer.Option("--tag", help="Side of a tag in a square, mm.")]
BoardDictionary = Annotated[str, typer.Option(help="Dictionary of the board's tags.")]
#: Of a video, one frame in as many is used: those between show much the same.
_FRAMES_APART = 15


@app.callback()
def _group() -> None:
    """Keep this a group although it has one command."""


@app.command()
def calibrate(
    pictures: Annotated[list[Path] | None, options.argument(help="Pictures of the board, each from elsewhere.")] = None,
    video: Annotated[Path | None, typer.Option(help="A video of the board instead of pictures.")] = None,
    columns: Columns = 7,
    rows: Rows = 5,
    square: Square = 35.0,
    tag: BoardTag = 26.0,
    dictionary: BoardDictionary = "5X5_50",
    output: Annotated[
        Path, options.written("--output", "-o", help="Calibration to write, JSON."), plain_files.check_writable
    ] = Path("camera.json"),
    json_file: options.JsonFile = None,
) -> None:
    """Measure a camera and its lens from pictures of a board (OpenCV's ChArUco), such as print board makes.

    Example: atg-fg camera calibrate board-1.jpg board-2.jpg board-3.jpg board-4.jpg board-5.jpg -o camera.json
    """
    from atg_fg.senses.camera_calibration import CalibrationBoard
    from atg_fg.senses.camera_calibration import calibrate as measure
    from atg_fg.senses.video import read_image
    from atg_fg.storage.camera_files import write_calibration

    if bool(pictures) == (video is not None):
        raise InvalidInputError("camera calibrate: expected pictures of the board, or --video FILE")
    board = CalibrationBoard(columns, rows, square / 1000, tag / 1000, dictionary)
    images = ((str(picture), read_image(picture)) for picture in pictures or [])
    found = measure(images if video is None else _frames(video), board)
    document = write_calibration(found)
    options.write_json(document, str(output))
    if options.write_json({"command": "camera calibrate", "output": str(output), "calibration": document}, json_file):
        say(
            f"{found.n_pictures} pictures show the board; its corners lie {found.error:.2f} pixels off, "
            f"the field of view is {found.field_of_view:.1f} degrees"
        )
        say(f"saved: {output}")


def _frames(video: Path) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    from atg_fg.senses.video import FrameSource

    with FrameSource("video", video) as frames:
        for number, frame in enumerate(frames):
            if number % _FRAMES_APART == 0:
                yield f"{video}, frame {number}", frame.image
