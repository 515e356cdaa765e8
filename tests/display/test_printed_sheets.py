"""Sheets are read back: rasterised as a printer does it, and looked at by the detector."""

import numpy as np
import pytest

pytest.importorskip("cv2", reason="OpenCV is not installed: pip install atg-fg[vision]")
pypdfium2 = pytest.importorskip("pypdfium2")
pytest.importorskip("matplotlib")

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.display.printed_sheets import PAPERS, board_sheet, cube_sheets, largest_net
from atg_fg.senses.camera_calibration import CalibrationBoard
from atg_fg.senses.tags import TagDetector, Tags

CUBES = [(0, 1, 2, 3, 4, 5), (6, 7, 8, 9, 10, 11)]
DOTS = 300 / 25.4  # a millimetre


def printed(document):
    """Pages as RGB images of 300 dots an inch, and their sizes in mm."""
    pages = list(pypdfium2.PdfDocument(document))
    sizes = [tuple(points * 25.4 / 72 for points in page.get_size()) for page in pages]
    return [page.render(scale=300 / 72).to_numpy()[:, :, :3].copy() for page in pages], sizes


def seen(page, dictionary="5X5_50"):
    return {tag.id: tag for tag in TagDetector(Tags(dictionary, 1.0)).detect(page)}


def test_a_net_shows_the_six_tags_of_its_cube_on_a_sheet_of_the_papers_size():
    pages, sizes = printed(cube_sheets(CUBES, "5X5_50", 52, 39))
    assert [sorted(seen(page)) for page in pages] == [sorted(cube) for cube in CUBES]
    for size in sizes:
        assert size == pytest.approx(PAPERS["a4"], abs=0.1)


@pytest.mark.parametrize(
    ("side", "tag_size", "paper"),
    [
        pytest.param(*size, paper, marks=[pytest.mark.slow] if paper != usual else [])
        for usual, size in zip(PAPERS, [(40, 30), (52, 35.5), (90, 68)], strict=True)
        for paper in PAPERS
    ],
)
def test_tags_have_their_true_size_and_place(paper, side, tag_size):
    pages, _ = printed(cube_sheets(CUBES[:1], "5X5_50", side, tag_size, paper))
    tags = {tag_id: tag for page in pages for tag_id, tag in seen(page).items()}
    assert sorted(tags) == [0, 1, 2, 3, 4, 5]
    for tag in tags.values():
        assert tag.distance == 0
        # A contour runs through the middle of the outermost black pixels.
        assert (tag.side + 1) / DOTS == pytest.approx(tag_size, abs=0.2)
    if side <= largest_net(paper):
        middle = {tag_id: tag.corners.mean(axis=0) / DOTS for tag_id, tag in tags.items()}
        for neighbour, step in ((4, (0, -side)), (5, (0, side)), (2, (-side, 0)), (3, (side, 0)), (1, (0, -2 * side))):
            np.testing.assert_allclose(middle[neighbour] - middle[0], step, atol=0.2)


def test_the_ruler_is_a_hundred_millimetres_long():
    (page,), _ = printed(cube_sheets(CUBES[:1], "5X5_50", 40, 30))
    below = page[-round(20 * DOTS) :].mean(axis=2)
    line = max((np.flatnonzero(row < 128) for row in below), key=len)
    assert (line[-1] - line[0]) / DOTS == pytest.approx(100, abs=0.4)


def test_faces_are_put_together_by_the_net_as_the_worlds_cube_has_them():
    # Folded up, the tag on top stands upright as seen from the front, and the one behind stands on its head in the net.
    (page,), _ = printed(cube_sheets(CUBES[:1], "5X5_50", 52, 39))
    tags = seen(page)
    upright = {tag_id: bool(tag.corners[0, 1] < tag.corners[3, 1]) for tag_id, tag in tags.items()}
    assert upright == {0: True, 1: False, 2: True, 3: True, 4: True, 5: True}


def test_a_cube_too_large_for_a_net_comes_face_by_face_and_one_too_large_for_that_is_refused():
    side = largest_net("a4")
    assert len(printed(cube_sheets(CUBES[:1], "5X5_50", side, 0.75 * side))[0]) == 1
    assert len(printed(cube_sheets(CUBES[:1], "5X5_50", 150, 110))[0]) == 6
    with pytest.raises(InvalidInputError, match="cube of 280 mm; expected at most 194 mm on a4"):
        cube_sheets(CUBES[:1], "5X5_50", 280, 210)


def test_a_tag_without_a_white_cell_around_it_is_refused():
    cube_sheets(CUBES[:1], "5X5_50", 54, 42)  # seven cells of nine
    with pytest.raises(InvalidInputError, match=r"tags of 43 mm on a cube of 54 mm; expected at most 42\.0 mm"):
        cube_sheets(CUBES[:1], "5X5_50", 54, 43)


def test_the_same_cubes_are_the_same_bytes():
    assert cube_sheets(CUBES[:1], "5X5_50", 40, 30) == cube_sheets(CUBES[:1], "5X5_50", 40, 30)


def test_paper_that_there_is_not_is_refused_with_what_there_is():
    with pytest.raises(UnknownNameError, match="paper: unknown name 'b7'; expected one of: a3, a4, letter"):
        cube_sheets(CUBES[:1], "5X5_50", 40, 30, "b7")


@pytest.mark.parametrize(("columns", "rows"), [(7, 5), (5, 7)])
def test_every_corner_of_a_printed_board_is_found_at_true_scale(columns, rows):
    board = CalibrationBoard(columns, rows)
    (page,), _ = printed(board_sheet(board))
    corners, places = board.corners(page.mean(axis=2).astype(np.uint8))
    assert len(corners) == (columns - 1) * (rows - 1)
    first, last = corners[0], corners[-1]
    across = np.linalg.norm(places[-1] - places[0]) / DOTS
    assert across == pytest.approx(1000 * np.linalg.norm(last - first), rel=0.005)


def test_a_board_larger_than_the_sheet_is_refused():
    with pytest.raises(InvalidInputError, match="board of 420 by 300 mm; expected at most 194 by 251 on a4"):
        board_sheet(CalibrationBoard(7, 5, 0.060, 0.045))
