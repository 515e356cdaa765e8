import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.senses.tags import DetectedTag, TagPose
from atg_fg.worlds.arcube import FACE_NORMALS
from sim.bodies.cube import CUBE_CENTRE, FACE_UPS
from sim.manipulation.waypoints import about_vertical
from sim.vision.cube_pose import cube_pose

FRONT, BACK, LEFT, RIGHT, TOP, BOTTOM = range(6)


def marker(face, *, centre=CUBE_CENTRE, degrees=0.0, lean=0.0, quarters=0):
    """The tag of a face of a cube that is turned about the vertical, and leans forward.

    ``quarters``: how the tag is turned on its face.
    """
    radians = np.radians(lean)
    forward = np.array([[np.cos(radians), 0, np.sin(radians)], [0, 1, 0], [-np.sin(radians), 0, np.cos(radians)]])
    normal, up = FACE_NORMALS[face], FACE_UPS[face]
    tag = np.column_stack([np.cross(up, normal), up, normal]) @ np.round(about_vertical(quarters * np.pi / 2))
    rotation = forward @ about_vertical(np.radians(degrees)) @ tag
    pose = TagPose(np.asarray(centre) + 0.14 * rotation[:, 2], rotation)
    return DetectedTag(face, face, np.zeros((4, 2)), 0, np.zeros((5, 5)), pose)


def test_nothing_seen_is_nothing_known():
    assert cube_pose([]) is None


@pytest.mark.parametrize("face", [FRONT, BACK, LEFT, RIGHT, TOP])
def test_any_tag_but_the_bottoms_shows_where_the_cube_stands(face):
    pose = cube_pose([marker(face, centre=[0.44, -0.03, 0.30], degrees=12)])
    np.testing.assert_allclose(pose.position, [0.44, -0.03, 0.30])
    assert pose.yaw == pytest.approx(np.radians(12))


def test_a_tag_that_looks_down_shows_nothing():
    assert cube_pose([marker(BOTTOM)]) is None


def test_the_top_is_preferred_to_a_side():
    top, side = marker(TOP, centre=[0.42, 0.01, 0.30], degrees=3), marker(FRONT, centre=[0.47, 0.02, 0.30], degrees=8)
    for seen in ([top, side], [side, top], [side, side, top]):
        pose = cube_pose(seen)
        np.testing.assert_allclose(pose.position, [0.42, 0.01, 0.30])
        assert pose.yaw == pytest.approx(np.radians(3))


def test_a_side_is_used_if_there_is_no_top():
    pose = cube_pose([marker(BOTTOM), marker(LEFT, centre=[0.47, 0.02, 0.30], degrees=-8)])
    np.testing.assert_allclose(pose.position, [0.47, 0.02, 0.30])
    assert pose.yaw == pytest.approx(np.radians(-8))


@pytest.mark.parametrize(
    ("face", "lean", "seen"),
    [(TOP, 25, True), (TOP, 40, False), (TOP, 80, True), (FRONT, 15, True), (FRONT, 30, False), (FRONT, -30, False)],
)
def test_a_tag_between_upright_and_level_shows_nothing(face, lean, seen):
    # A top that leans by 80 degrees is a side.
    assert (cube_pose([marker(face, lean=lean)]) is not None) == seen


def test_a_leaning_tag_does_not_hide_one_that_stands():
    pose = cube_pose([marker(TOP, lean=45), marker(LEFT, degrees=5)])
    assert pose.yaw == pytest.approx(np.radians(5))


@given(height=st.floats(-0.05, 0.05), ahead=st.floats(-0.05, 0.05), left=st.floats(-0.05, 0.05))
def test_the_cubes_height_is_the_tables(height, ahead, left):
    for face in (TOP, FRONT):
        pose = cube_pose([marker(face, centre=CUBE_CENTRE + np.array([ahead, left, height]))])
        np.testing.assert_allclose(pose.position, CUBE_CENTRE + np.array([ahead, left, 0]), atol=1e-12)


@given(degrees=st.floats(-44.9, 44.9), quarters=st.integers(-4, 4), face=st.sampled_from([FRONT, LEFT, TOP]))
def test_a_quarter_turn_cannot_be_seen(degrees, quarters, face):
    pose = cube_pose([marker(face, degrees=degrees + 90 * quarters)])
    assert np.degrees(pose.yaw) == pytest.approx(degrees, abs=1e-9)


@given(degrees=st.floats(-44.9, 44.9), quarters=st.integers(0, 3), face=st.sampled_from([FRONT, LEFT, TOP]))
def test_how_a_tag_is_turned_on_its_face_does_not_matter(degrees, quarters, face):
    pose = cube_pose([marker(face, degrees=degrees, quarters=quarters)])
    assert np.degrees(pose.yaw) == pytest.approx(degrees, abs=1e-9)


@given(degrees=st.floats(-1000, 1000), face=st.sampled_from([FRONT, RIGHT, TOP]))
def test_a_yaw_is_never_more_than_half_a_quarter_turn(degrees, face):
    pose = cube_pose([marker(face, degrees=degrees)])
    assert abs(pose.yaw) <= np.pi / 4
    # And it is the yaw up to quarter turns.
    assert np.sin(2 * (pose.yaw - np.radians(degrees))) ** 2 == pytest.approx(0, abs=1e-12)


def test_a_cube_at_forty_five_degrees_is_seen_at_forty_five_degrees_on_either_side():
    yaws = [np.degrees(cube_pose([marker(TOP, degrees=degrees)]).yaw) for degrees in (44, 46, 134, 136)]
    assert yaws == pytest.approx([44, -44, 44, -44])
