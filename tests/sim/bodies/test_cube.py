import cv2
import numpy as np
import pytest

from atg_fg.senses.tags import DICTIONARIES
from atg_fg.worlds.arcube import ACTION_SOURCES, BACK, FACE_NORMALS, LEFT, ORIENTATIONS, SUCCESSORS, TOP, rotation_of
from sim.bodies.cube import FACE_UPS, TAG_DICTIONARY, face_image, quaternion_of, tag_image

QUARTER = {
    # The top comes to the front (−x): about −y. The left (+y) comes to the front: about +z. The right: about −z.
    "flip": ([0, -1, 0], 1),
    "left": ([0, 0, 1], 1),
    "right": ([0, 0, -1], 1),
}


@pytest.mark.parametrize("orientation", range(24))
def test_a_rotation_takes_every_face_to_the_place_the_permutation_says(orientation):
    rotation = rotation_of(orientation)
    assert np.linalg.det(rotation) == pytest.approx(1)
    for place, face in enumerate(ORIENTATIONS[orientation]):
        np.testing.assert_array_equal(rotation @ FACE_NORMALS[face], FACE_NORMALS[place])


@pytest.mark.parametrize("action", ACTION_SOURCES)
def test_each_action_is_a_quarter_turn_about_its_axis(action):
    axis, turns = QUARTER[action]
    turn = cv2.Rodrigues(np.array(axis, dtype=float) * turns * np.pi / 2)[0]
    for orientation in range(24):
        after = SUCCESSORS[orientation][list(ACTION_SOURCES).index(action)]
        np.testing.assert_allclose(rotation_of(after), turn @ rotation_of(orientation), atol=1e-12)


@pytest.mark.parametrize("orientation", range(24))
def test_a_quaternion_is_the_same_rotation(orientation):
    x, y, z, w = quaternion_of(rotation_of(orientation))
    matrix = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    np.testing.assert_allclose(matrix, rotation_of(orientation), atol=1e-12)


def test_the_tag_of_every_face_lies_in_the_face():
    assert not np.einsum("ij,ij->i", FACE_NORMALS, FACE_UPS).any()


def test_the_world_has_its_back_left_and_top_where_the_robot_sees_them():
    assert FACE_NORMALS[[BACK, LEFT, TOP]].tolist() == np.eye(3).tolist()


def test_every_symbol_has_a_tag_of_its_own_that_opencv_reads():
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(DICTIONARIES[TAG_DICTIONARY]))
    for symbol in range(12):
        assert tag_image(symbol).shape == (84, 84)
        _, found, _ = detector.detectMarkers(face_image(symbol))
        assert found.ravel().tolist() == [symbol]
