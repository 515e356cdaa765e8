"""``atg-fg print``: cubes and boards to print at true scale."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from atg_fg.cli import options
from atg_fg.cli.camera import BoardDictionary, BoardTag, Columns, Rows, Square
from atg_fg.cli.lens_options import numbers_of
from atg_fg.cli.terminal import say
from atg_fg.core.errors import InvalidInputError
from atg_fg.storage import plain_files

app = typer.Typer(
    help="Print cubes with tags, and boards to calibrate a camera. Example: atg-fg print cube -o cube.pdf",
    no_args_is_help=True,
)

Paper = Annotated[str, typer.Option(help="Paper: a4, a3 or letter.")]


@app.command()
def cube(
    tags: Annotated[str, typer.Option(help="Ids of the tags that may be on the cubes, such as 0-11.")] = "0-11",
    cubes: Annotated[
        int, typer.Option(min=1, max=100, help="Number of cubes, told apart in as few actions as can be.")
    ] = 1,
    dictionary: Annotated[str, typer.Option(help="Dictionary of the tags.")] = "5X5_50",
    side: Annotated[float, typer.Option(help="Side of a cube, mm.")] = 56.0,
    tag_size: Annotated[float | None, typer.Option(help="Side of a tag, mm; three quarters of the cube's.")] = None,
    paper: Paper = "a4",
    output: Annotated[
        Path, options.written("--output", "-o", help="PDF to cut and glue, or .3mf or .stl for a 3D printer.")
    ] = Path("cube.pdf"),
    seed: Annotated[int, typer.Option(min=0, help="Seed of the draws among which the cubes are chosen.")] = 0,
    json_file: options.JsonFile = None,
) -> None:
    """Make cubes of your own, and the file that tells look and live which tags are on them.

    A net where it fits on the paper, single faces to glue on a box where it does not.

    Example: atg-fg print cube --tags 0-11 --cubes 3 -o cubes.pdf
    """
    for name, length in (("--side", side), ("--tag-size", tag_size)):
        if length is not None and not 1 <= length <= 2000:
            raise InvalidInputError(f"{name}: {length}; expected 1 to 2000 mm")
    plain_files.check_writable(output)
    from atg_fg.senses.tags import check_ids, dictionary_name
    from atg_fg.storage.camera_files import CubeTags, write_tags
    from atg_fg.worlds.distinct_arcubes import expected_actions, make_distinct_arcubes

    dictionary = dictionary_name(dictionary)
    ids = check_ids(dictionary, numbers_of(tags, "--tags"), "--tags")
    size = 0.75 * side if tag_size is None else tag_size
    chosen = make_distinct_arcubes(cubes, ids, seed)
    content = _content(output, chosen, dictionary, side, size, paper)
    known = CubeTags(dictionary, size / 1000, ids, chosen)
    beside = output.with_suffix(".json")
    _check_replaceable(beside)
    plain_files.write_bytes_atomically(output, content)
    options.write_json(write_tags(known), str(beside))
    needed = expected_actions(chosen)
    result = {"tags": write_tags(known), "expected_actions": needed, "output": str(output), "tags_file": str(beside)}
    if options.write_json({"command": "print cube", **result}, json_file):
        for number, each in enumerate(chosen):
            say(f"cube {number + 1}: tags {' '.join(map(str, each))}")
        if cubes > 1:
            say(f"told apart after {needed:.2f} actions on average, once all are known")
        say(f"saved: {output}, {beside}")


@app.command()
def board(
    columns: Columns = 7,
    rows: Rows = 5,
    square: Square = 35.0,
    tag: BoardTag = 26.0,
    dictionary: BoardDictionary = "5X5_50",
    paper: Paper = "a4",
    output: Annotated[Path, options.written("--output", "-o", help="PDF to write.")] = Path("board.pdf"),
) -> None:
    """Print a board to calibrate a camera with.

    Example: atg-fg print board -o board.pdf
    """
    _check_pdf(output)
    from atg_fg.display.printed_sheets import board_sheet
    from atg_fg.senses.camera_calibration import CalibrationBoard

    made = CalibrationBoard(columns, rows, square / 1000, tag / 1000, dictionary)
    plain_files.write_bytes_atomically(output, board_sheet(made, paper))
    say(f"saved: {output}")


def _check_replaceable(beside: Path) -> None:
    """Raise ``InvalidInputError`` unless the tags of cubes can be written here, over nothing but tags of cubes."""
    from atg_fg.storage.camera_files import read_tags

    plain_files.check_writable(beside)
    if plain_files.is_plain_file(beside):
        try:
            read_tags(beside)
        except InvalidInputError as error:
            raise InvalidInputError(
                f"{beside}: holds something else, and would be overwritten; expected another --output"
            ) from error


def _check_pdf(path: Path) -> None:
    if path.suffix.lower() != ".pdf":
        raise InvalidInputError(f"{path}: suffix {path.suffix!r}; expected .pdf")
    plain_files.check_writable(path)


def _content(
    output: Path, cubes: tuple[tuple[int, ...], ...], dictionary: str, side: float, tag_size: float, paper: str
) -> bytes:
    """Return the document, or the solids, by the suffix of the file."""
    if output.suffix.lower() in (".3mf", ".stl"):
        from atg_fg.display.cube_solid import check_solid_path, cube_solids

        return cube_solids(cubes, dictionary, side, tag_size, check_solid_path(output))
    if output.suffix.lower() != ".pdf":
        raise InvalidInputError(f"{output}: suffix {output.suffix!r}; expected .pdf, .3mf or .stl")
    from atg_fg.display.printed_sheets import cube_sheets

    return cube_sheets(cubes, dictionary, side, tag_size, paper)
