"""Sheets to print at true scale: nets of cubes to cut, fold and glue, single faces, and boards to calibrate a camera.

All lengths here are millimetres; x goes right and y up from the sheet's lower left corner.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.display.figures import figure_class
from atg_fg.senses.camera_calibration import CalibrationBoard
from atg_fg.senses.tags import tag_cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Width and height of sheets.
PAPERS: Final = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
#: What a printer may leave white around, and the band below that the ruler takes, and the one above for the title.
_BORDER, _RULER, _TITLE = 8.0, 16.0, 14.0
_FLAP: Final = 7.0
_MILLIMETRES: Final = 25.4  # an inch
#: Column and row of each face in the net, in the order front, back, left, right, top, bottom, and whether its tag
#: stands on its head there.
_NET: Final = ((1, 1, False), (1, 3, True), (0, 1, False), (2, 1, False), (1, 2, False), (1, 0, False))
#: Flaps: column and row of a square, and the side of it that the flap is on.
_FLAPS: Final = (
    (0, 1, "left"), (0, 1, "top"), (0, 1, "bottom"), (2, 1, "right"), (2, 1, "top"), (2, 1, "bottom"),
    (1, 0, "bottom"),
)  # fmt: skip
_FACES: Final = ("front", "back", "left", "right", "top", "bottom")
_CUT, _FOLD, _GLUE = "0.25", "0.6", "0.88"


def largest_net(paper: str) -> float:
    """Return the largest side of a cube whose net fits on a sheet, mm."""
    width, height = _room(paper)
    return min((width - 2 * _FLAP) / 3, (height - _FLAP) / 4)


def net_squares(side: float, paper: str) -> list[tuple[float, float, bool]]:
    """Return where each face of a net is on its sheet: its lower left corner, mm, and whether it stands on its head.

    Raises:
        UnknownNameError: There is no such paper.
    """
    left, bottom = _middle(paper, 3 * side, 4 * side)
    return [(left + column * side, bottom + _FLAP / 2 + row * side, on_head) for column, row, on_head in _NET]


def cube_sheets(
    cubes: Sequence[Sequence[int]], dictionary: str, side: float, tag_size: float, paper: str = "a4"
) -> bytes:
    """Return the sheets of cubes as a PDF document: a net each, or single faces where a net does not fit.

    Args:
        cubes: Ids of the tags on the faces of each cube: front, back, left, right, top, bottom.
        dictionary: Of the tags.
        side: Of a cube, mm.
        tag_size: Side of a tag's black square, mm; there must be a white cell around it.
        paper: One of ``PAPERS``.

    Raises:
        UnknownNameError: There is no such paper or dictionary.
        InvalidInputError: A tag too large for its face, or a face too large for the sheet.
        MissingDependencyError: matplotlib is not installed.
    """
    cells = len(tag_cells(dictionary, cubes[0][0]))
    most = side * cells / (cells + 2)
    if not 0 < tag_size <= most + 1e-9:
        raise InvalidInputError(
            f"tags of {tag_size:g} mm on a cube of {side:g} mm; expected at most {most:.1f} mm, so that a white cell "
            "is around them"
        )
    pages: list[Figure] = []
    for number, cube in enumerate(cubes):
        ids = " ".join(map(str, cube))
        title = f"cube {number + 1} of {len(cubes)}, side {side:g} mm; tags {ids} of {dictionary}, {tag_size:g} mm"
        if side <= largest_net(paper):
            pages.append(_net_page(title, cube, dictionary, side, tag_size, paper))
        else:
            pages += _face_pages(title, cube, dictionary, side, tag_size, paper)
    return _document(pages)


def board_sheet(board: CalibrationBoard, paper: str = "a4") -> bytes:
    """Return a board to calibrate a camera with as a PDF document.

    Raises:
        UnknownNameError: There is no such paper.
        InvalidInputError: The board is larger than the sheet.
        MissingDependencyError: matplotlib is not installed.
    """
    square = 1000 * board.square
    across, up = board.columns * square, board.rows * square
    width, height = _room(paper)
    image = board.image(120)
    if across > width and across <= height and up <= width:
        image, across, up = np.rot90(image), up, across
    if across > width or up > height:
        raise InvalidInputError(
            f"board of {across:g} by {up:g} mm; expected at most {width:g} by {height:g} on {paper}, either way round"
        )
    tags = f"tags of {1000 * board.tag:g} mm of {board.dictionary}"
    title = f"board of {board.columns} by {board.rows} squares of {square:g} mm; {tags}"
    figure, axes = _page(title, "glue it to something flat", paper)
    left, bottom = _middle(paper, across, up)
    axes.imshow(image, cmap="gray", vmin=0, vmax=255, extent=(left, left + across, bottom, bottom + up), **_SHARP)
    return _document([figure])


_SHARP: Final[dict[str, Any]] = {"interpolation": "none", "zorder": 3}


def _room(paper: str) -> tuple[float, float]:
    """Return width and height of what may be drawn on."""
    width, height = _paper(paper)
    return width - 2 * _BORDER, height - 2 * _BORDER - _RULER - _TITLE


def _paper(name: str) -> tuple[float, float]:
    if name.lower() not in PAPERS:
        raise unknown_name("paper", name, PAPERS)
    return PAPERS[name.lower()]


def _middle(paper: str, across: float, up: float) -> tuple[float, float]:
    """Return the lower left corner of a drawing in the middle of its room."""
    width, height = _room(paper)
    return _BORDER + (width - across) / 2, _BORDER + _RULER + (height - up) / 2


def _page(title: str, how: str, paper: str) -> tuple[Figure, Axes]:
    """Return a sheet with its title, what to do with it, and a ruler."""
    width, height = _paper(paper)
    figure = figure_class()(figsize=(width / _MILLIMETRES, height / _MILLIMETRES))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height), autoscale_on=False)
    axes.axis("off")
    axes.text(width / 2, height - _BORDER - 4, title, ha="center", va="center", fontsize=8, parse_math=False)
    advice = f"print at 100 %, not fitted to the page; {how}"
    axes.text(width / 2, height - _BORDER - 8.5, advice, ha="center", va="center", fontsize=6.5, color="0.4")
    _draw_ruler(axes, width)
    return figure, axes


def _draw_ruler(axes: Axes, width: float) -> None:
    """Draw a ruler of 100 mm: what it measures says whether the printer kept the scale."""
    left, bottom, length = width / 2 - 50, _BORDER + 5, 100
    axes.plot([left, left + length], [bottom, bottom], color="black", linewidth=0.6)
    for millimetre in range(length + 1):
        tall = 4 if millimetre % 10 == 0 else 2.5 if millimetre % 5 == 0 else 1.5
        axes.plot([left + millimetre] * 2, [bottom, bottom + tall], color="black", linewidth=0.4)
        if millimetre % 10 == 0:
            axes.text(left + millimetre, bottom - 0.8, str(millimetre), ha="center", va="top", fontsize=5.5)
    axes.text(left + length + 3, bottom + 1, "mm", ha="left", va="center", fontsize=5.5)


def _net_page(title: str, cube: Sequence[int], dictionary: str, side: float, tag_size: float, paper: str) -> Figure:
    figure, axes = _page(title, "cut along full lines, fold along dashed ones, glue the grey flaps", paper)
    squares = net_squares(side, paper)
    left, bottom = squares[_FACES.index("left")][0], squares[_FACES.index("bottom")][1]
    for column, row, edge in _FLAPS:
        _draw_flap(axes, left + column * side, bottom + row * side, side, edge)
    for face, (x, y, on_head) in enumerate(squares):
        _draw_square(axes, x, y, side, _CUT, "-")
        _draw_face(axes, x, y, side, tag_size, dictionary, cube[face], f"{_FACES[face]} {cube[face]}", on_head)
    # Edges at which two squares meet are folded.
    for row in (1, 2, 3):
        _draw_fold(axes, [left + side, left + 2 * side], [bottom + row * side] * 2)
    for column in (1, 2):
        _draw_fold(axes, [left + column * side] * 2, [bottom + side, bottom + 2 * side])
    for column, row, edge in _FLAPS:
        x, y = left + column * side, bottom + row * side
        near, far = _edge(x, y, side, edge)
        _draw_fold(axes, [near[0], far[0]], [near[1], far[1]])
    return figure


def _face_pages(
    title: str, cube: Sequence[int], dictionary: str, side: float, tag_size: float, paper: str
) -> list[Figure]:
    """Return sheets of single faces with cut marks, to glue on a box."""
    width, height = _room(paper)
    gap = 6.0
    columns, rows = int((width + gap) // (side + gap)), int((height + gap) // (side + gap))
    if not columns or not rows:
        most = min(_room(paper))
        raise InvalidInputError(f"cube of {side:g} mm; expected at most {most:g} mm on {paper}")
    pages = []
    for first in range(0, len(cube), columns * rows):
        figure, axes = _page(title, "cut from mark to mark, and glue each square on a side of a box", paper)
        left, bottom = _middle(paper, columns * (side + gap) - gap, rows * (side + gap) - gap)
        for place, tag_id in enumerate(cube[first : first + columns * rows]):
            row, column = divmod(place, columns)
            x, y = left + column * (side + gap), bottom + (rows - 1 - row) * (side + gap)
            _draw_cut_marks(axes, x, y, side)
            name = f"{_FACES[first + place]} {tag_id}"
            _draw_face(axes, x, y, side, tag_size, dictionary, tag_id, name, False)
        pages.append(figure)
    return pages


def _draw_face(
    axes: Axes, x: float, y: float, side: float, tag_size: float, dictionary: str, tag_id: int, name: str, on_head: bool
) -> None:
    """Draw a tag in the middle of a square, and its name in a corner."""
    cells = tag_cells(dictionary, tag_id)
    # Cells of many pixels stay sharp in viewers that smooth images.
    image = np.kron(cells[::-1, ::-1] if on_head else cells, np.ones((32, 32), dtype=np.uint8))
    margin = (side - tag_size) / 2
    extent = (x + margin, x + margin + tag_size, y + margin, y + margin + tag_size)
    axes.imshow(image, cmap="gray", vmin=0, vmax=1, extent=extent, **_SHARP)
    corner = (x + side - 1, y + side - 1) if on_head else (x + 1, y + 1)
    axes.text(*corner, name, fontsize=min(5.0, 1.2 * margin), color="0.5", rotation=180 if on_head else 0,
              ha="right" if on_head else "left", va="top" if on_head else "bottom")  # fmt: skip


def _draw_square(axes: Axes, x: float, y: float, side: float, colour: str, style: str) -> None:
    axes.plot(
        [x, x + side, x + side, x, x], [y, y, y + side, y + side, y], style, color=colour, linewidth=0.5, zorder=1
    )


def _draw_fold(axes: Axes, x: Sequence[float], y: Sequence[float]) -> None:
    """Draw over a cut line that is a fold."""
    axes.plot(x, y, color="white", linewidth=1.2, zorder=2, solid_capstyle="butt")
    axes.plot(x, y, "--", color=_FOLD, linewidth=0.4, zorder=2)


def _edge(x: float, y: float, side: float, edge: str) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return both ends of a square's edge."""
    return {
        "left": ((x, y), (x, y + side)),
        "right": ((x + side, y), (x + side, y + side)),
        "bottom": ((x, y), (x + side, y)),
        "top": ((x, y + side), (x + side, y + side)),
    }[edge]


def _draw_flap(axes: Axes, x: float, y: float, side: float, edge: str) -> None:
    near, far = (np.array(end) for end in _edge(x, y, side, edge))
    outward = {"left": (-1, 0), "right": (1, 0), "bottom": (0, -1), "top": (0, 1)}[edge]
    along = (far - near) / side
    slant = min(_FLAP, side / 3)
    out = np.array(outward) * _FLAP
    corners = np.array([near, near + slant * along + out, far - slant * along + out, far])
    axes.fill(*corners.T, facecolor=_GLUE, edgecolor=_CUT, linewidth=0.5, zorder=0)


def _draw_cut_marks(axes: Axes, x: float, y: float, side: float) -> None:
    """Draw where to cut, outside of the corners."""
    for corner_x, step_x in ((x, -1), (x + side, 1)):
        for corner_y, step_y in ((y, -1), (y + side, 1)):
            axes.plot([corner_x + 0.5 * step_x, corner_x + 2.5 * step_x], [corner_y] * 2, color=_CUT, linewidth=0.4)
            axes.plot([corner_x] * 2, [corner_y + 0.5 * step_y, corner_y + 2.5 * step_y], color=_CUT, linewidth=0.4)
    _draw_square(axes, x, y, side, "0.9", "-")


def _document(pages: Sequence[Figure]) -> bytes:
    from matplotlib.backends.backend_pdf import PdfPages

    buffer = io.BytesIO()
    with PdfPages(buffer, metadata={"Creator": "atg-fg", "CreationDate": None}) as document:
        for page in pages:
            document.savefig(page)
    return buffer.getvalue()
