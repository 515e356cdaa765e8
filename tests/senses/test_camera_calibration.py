import cv2
import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.camera_calibration import Calibration, CalibrationBoard, calibrate
from tests.senses.images import FACING, turned

BOARD = CalibrationBoard()
INTRINSICS = np.array([[610.0, 0, 331], [0, 605, 236], [0, 0, 1]])
DISTORTION = np.array([-0.25, 0.08, 0.001, -0.001, 0.0])
#: How the board is held: turned about two axes, degrees, and where its middle is, m.
HELD = [
    ((0, 0), (0, 0, 0.30)),
    ((30, 0), (0.02, 0, 0.33)),
    ((-30, 5), (-0.03, 0.02, 0.34)),
    ((5, 30), (0.05, -0.02, 0.33)),
    ((0, -30), (-0.05, 0.02, 0.35)),
    ((25, 25), (0.03, 0.03, 0.36)),
    ((-20, -25), (0.06, 0.04, 0.36)),
    ((20, -20), (-0.07, -0.04, 0.34)),
]


def picture(held, shape=(480, 640)):
    """The board as a camera with a bad lens sees it."""
    (about_x, about_y), position = held
    rotation = turned([1, 0, 0], about_x) @ turned([0, 1, 0], about_y) @ FACING
    flat = BOARD.image(100)
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    pixels = np.stack([x.ravel(), y.ravel()], axis=1)[:, None]
    rays = cv2.undistortPoints(pixels, INTRINSICS, DISTORTION).reshape(-1, 2)
    directions = np.column_stack([rays, np.ones(len(rays))])
    normal = rotation[:, 2]
    distance = (normal @ np.array(position)) / (directions @ normal)
    on_board = (directions * distance[:, None] - position) @ rotation[:, :2] / BOARD.square
    column = (on_board[:, 0] + BOARD.columns / 2) * 100 - 0.5
    row = (BOARD.rows / 2 - on_board[:, 1]) * 100 - 0.5
    maps = [part.reshape(shape).astype(np.float32) for part in (column, row)]
    grey = cv2.remap(flat, *maps, cv2.INTER_AREA, borderMode=cv2.BORDER_CONSTANT, borderValue=128)
    return np.repeat(grey[:, :, None], 3, axis=2)


@pytest.fixture(scope="module")
def pictures():
    return [(f"picture {number}", picture(held)) for number, held in enumerate(HELD)]


def test_the_camera_behind_the_pictures_is_found(pictures):
    found = calibrate(pictures, BOARD)
    np.testing.assert_allclose(found.intrinsics, INTRINSICS, atol=4)
    np.testing.assert_allclose(found.distortion[:2], DISTORTION[:2], atol=0.05)
    assert found.error < 0.3
    assert (found.image_size, found.n_pictures) == ((640, 480), len(HELD))


def test_pictures_without_the_board_are_left_out(pictures):
    blank = ("blank", np.full((480, 640, 3), 90, dtype=np.uint8))
    assert calibrate([blank, *pictures], BOARD).n_pictures == len(HELD)


def test_too_few_pictures_of_the_board_are_refused(pictures):
    with pytest.raises(
        InvalidInputError, match="the board is seen in 4 of 4 pictures; expected at least 5, of a board"
    ):
        calibrate(pictures[:4], BOARD)
    with pytest.raises(InvalidInputError, match="the board is seen in 0 of 0 pictures"):
        calibrate([], BOARD)


def test_pictures_of_two_sizes_are_refused(pictures):
    with pytest.raises(InvalidInputError, match="small: 320 by 240 pixels; expected 640 by 480"):
        calibrate([*pictures, ("small", np.zeros((240, 320, 3), dtype=np.uint8))], BOARD)


def test_a_guess_has_the_field_of_view_that_it_was_made_for():
    guess = Calibration.guessed((640, 480), 60)
    assert guess.field_of_view == pytest.approx(60)
    assert guess.intrinsics[0, 0] == pytest.approx(320 / np.tan(np.radians(30)))
    assert guess.error is None


@pytest.mark.parametrize("angle", [0, 180, -3, float("nan")])
def test_a_field_of_view_that_is_none_is_refused(angle):
    with pytest.raises(InvalidInputError, match=r"field of view: .*; expected degrees between 0 and 180"):
        Calibration.guessed((640, 480), angle)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"columns": 2}, "board: 2 by 5 squares; expected at least 3 by 3"),
        *(({"tag": tag}, "expected smaller tags") for tag in (0.04, 0.001, 1e-320, -0.02, float("nan"))),
        *(({"square": square}, "expected smaller tags") for square in (0.026, 1.0, 1e308, float("inf"), float("nan"))),
        ({"columns": 30, "rows": 30}, "tags of the board: 50; expected 0 to 49"),
    ],
)
def test_a_board_that_cannot_be_is_refused(arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        CalibrationBoard(**arguments)
