from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.tags import DetectedTag, TagPose
from atg_fg.senses.turns import CUBE_ROTATIONS, CubeAtRest, CubeTakenAway, Patience, TurnWatcher, nearest_rotation
from atg_fg.senses.viewpoint import Viewpoint
from atg_fg.worlds.arcube import ACTION_ROTATIONS, FACE_NORMALS, rotation_of
from tests.senses.images import turned

UPS = np.array([[0, 0, 1]] * 4 + [[1, 0, 0], [-1, 0, 0]], dtype=float)
PITCH = 40.0
#: So steep that no pose taken for its other one looks straight on the table by chance.
STEEP = Viewpoint.pitched(65.0)


def frame(cube, view=None, offset=0.0, hidden=()):
    """The tags of a cube with the tags 0 to 5 on its faces that a camera sees, from its rotation on the table."""
    view = view or Viewpoint.pitched(PITCH)
    tags = []
    for face, (normal, up) in enumerate(zip(FACE_NORMALS, UPS, strict=True)):
        on_cube = np.column_stack([np.cross(up, normal), up, normal])
        rotation = view.axes.T @ cube @ on_cube
        if rotation[2, 2] < -0.3 and face not in hidden:
            corners = 100 * (rotation[:2, :2] @ np.array([[-1, 1, 1, -1], [1, 1, -1, -1]])).T + 50 * face + offset
            pose = TagPose(rotation[:, 2] + [0, 0, 5], rotation)
            tags.append(DetectedTag(face, face, corners, 0, np.zeros((5, 5)), pose))
    return tags


class Film:
    """Feeds a watcher frame after frame, ten a second, and keeps what it says."""

    def __init__(self, watcher):
        self.watcher, self.time, self.said = watcher, 0.0, []

    def show(self, tags, seconds=0.1):
        for _ in range(round(seconds * 10)):
            said = self.watcher.take(self.time, tags)
            self.time += 0.1
            if said is not None:
                self.said.append(said)

    def turn(self, start, rotation, steps=6, **options):
        """Turn the cube by a rotation of 90° or 180°, a few frames on the way, and leave it."""
        axis_angle = np.zeros(3)
        cosine = np.clip((np.trace(rotation) - 1) / 2, -1, 1)
        angle = np.arccos(cosine)
        if angle > 1e-6:
            values, vectors = np.linalg.eig(rotation)
            axis = np.real(vectors[:, np.argmin(abs(values - 1))])
            sign = 1 if np.allclose(turned(axis, np.degrees(angle)), rotation, atol=1e-6) else -1
            axis_angle = sign * axis * np.degrees(angle)
        for step in range(1, steps):
            part = turned(axis_angle, step / steps) @ start
            self.show(frame(part, offset=30 * step, **options))
        self.show(frame(rotation @ start, **options), 1.0)
        return rotation @ start


@pytest.fixture
def film():
    return Film(TurnWatcher(ACTION_ROTATIONS))


def symbols(rest):
    return tuple(None if tag is None else tag.symbol for tag in (rest.slots["front"], rest.slots["top"]))


def test_there_are_24_rotations_of_a_cube_and_the_worlds_are_among_them():
    assert CUBE_ROTATIONS.shape == (24, 3, 3)
    assert {nearest_rotation(rotation_of(orientation)) for orientation in range(24)} == {(0.0, n) for n in range(24)}


def test_the_actions_turn_the_faces_where_the_world_says():
    left, top = FACE_NORMALS[2], FACE_NORMALS[4]
    front = FACE_NORMALS[0]
    np.testing.assert_array_equal(ACTION_ROTATIONS["flip"] @ top, front)
    np.testing.assert_array_equal(ACTION_ROTATIONS["left"] @ left, front)
    np.testing.assert_array_equal(ACTION_ROTATIONS["right"] @ -left, front)


def test_a_cube_that_is_put_down_is_seen_once(film):
    film.show(frame(np.eye(3)), 3)
    (rest,) = film.said
    assert symbols(rest) == (0, 4)
    assert rest.turn == ()


@pytest.mark.parametrize("pitch", [15.0, 40.0, 65.0])
def test_the_camera_finds_out_how_far_it_looks_down(pitch):
    film = Film(TurnWatcher(ACTION_ROTATIONS))
    view = Viewpoint.pitched(pitch)
    film.show(frame(np.eye(3), view), 1)
    if film.said and None not in symbols(film.said[0]):
        np.testing.assert_allclose(film.watcher.viewpoint.up, view.up, atol=1e-9)
    else:
        assert pitch != 40.0  # so flat, or so steep, that one of the faces cannot be seen


@pytest.mark.parametrize("action", ACTION_ROTATIONS)
def test_an_action_is_noticed_and_told_from_the_others(film, action):
    film.show(frame(np.eye(3)), 1)
    film.turn(np.eye(3), ACTION_ROTATIONS[action])
    assert [rest.turn for rest in film.said] == [(), (action,)]


@given(actions=st.lists(st.sampled_from(list(ACTION_ROTATIONS)), min_size=1, max_size=8))
def test_any_sequence_of_actions_is_noticed_turn_by_turn(actions):
    film = Film(TurnWatcher(ACTION_ROTATIONS))
    cube = np.eye(3)
    film.show(frame(cube), 1)
    for action in actions:
        cube = film.turn(cube, ACTION_ROTATIONS[action])
    assert [rest.turn for rest in film.said] == [(), *((action,) for action in actions)]
    faces = FACE_NORMALS @ cube.T
    shown = int((faces @ [-1, 0, 0]).argmax()), int((faces @ [0, 0, 1]).argmax())
    assert symbols(film.said[-1]) == shown


@given(yaws=st.lists(st.floats(-14, 14), min_size=3, max_size=3))
def test_a_cube_put_down_askew_is_noticed_all_the_same(yaws):
    film = Film(TurnWatcher(ACTION_ROTATIONS, Viewpoint.pitched(PITCH)))
    straight = np.eye(3)
    film.show(frame(turned([0, 0, 1], yaws[0]) @ straight), 1)
    for yaw, action in zip(yaws[1:], ("left", "flip"), strict=True):
        straight = ACTION_ROTATIONS[action] @ straight
        film.show(frame(turned([0, 0, 1], yaw) @ straight, offset=200), 1)
    assert [rest.turn for rest in film.said] == [(), ("left",), ("flip",)]


def mirrored(tag):
    """The tag with its pose and the one that shows it much alike exchanged, as noise may do it."""
    pose = tag.pose
    view = np.array(pose.position) / np.linalg.norm(pose.position)
    across = np.cross(view, pose.rotation[:, 2])
    slant = np.degrees(np.arcsin(min(1.0, np.linalg.norm(across))))
    other = turned(across / np.linalg.norm(across), 2 * slant) @ pose.rotation
    return replace(tag, pose=replace(pose, rotation=other, other_rotation=pose.rotation, ambiguity=0.9))


@given(actions=st.lists(st.sampled_from(list(ACTION_ROTATIONS)), min_size=1, max_size=6), place=st.sampled_from([0, 1]))
def test_a_pose_taken_for_the_other_one_that_shows_the_tag_alike_misleads_nobody(actions, place):
    watcher = TurnWatcher(ACTION_ROTATIONS, STEEP)
    said, time, cube = [], 0.0, np.eye(3)
    for action in (None, *actions):
        cube = cube if action is None else ACTION_ROTATIONS[action] @ cube
        tags = frame(turned([0, 0, 1], 7) @ cube, STEEP, offset=100 * time)
        if action is not None:
            tags[place] = mirrored(tags[place])
        for _ in range(20):
            said.append(watcher.take(time, tags))
            time += 0.1
    turns = [each.turn for each in said if each is not None]
    # It is noticed right, or it is not known; never is it noticed wrong.
    known = [(action,) for action in actions]
    assert len(turns) == len(actions) + 1
    assert all(turn in (None, expected) for turn, expected in zip(turns[1:], known, strict=True))
    assert turns[1] == known[0]
    faces = FACE_NORMALS @ cube.T
    assert symbols([each for each in said if each is not None][-1]) == (
        int((faces @ [-1, 0, 0]).argmax()),
        int((faces @ [0, 0, 1]).argmax()),
    )


def test_two_turns_at_once_are_the_actions_that_they_are_worth(film):
    film.show(frame(np.eye(3)), 1)
    film.turn(np.eye(3), ACTION_ROTATIONS["left"] @ ACTION_ROTATIONS["left"], steps=8)
    assert film.said[-1].turn in (("left", "left"), ("right", "right"))


def test_a_turn_backwards_is_told_in_actions(film):
    film.show(frame(np.eye(3)), 1)
    film.turn(np.eye(3), ACTION_ROTATIONS["flip"].T)
    assert film.said[-1].turn == ("flip", "flip", "flip")


def test_a_cube_that_is_pushed_and_left_as_it_was_is_no_turn(film):
    film.show(frame(np.eye(3)), 1)
    film.show(frame(np.eye(3), offset=60), 0.3)
    film.show(frame(np.eye(3), offset=90), 1)
    assert len(film.said) == 1


def test_a_hand_before_a_face_is_waited_for_but_not_for_ever(film):
    film.show(frame(np.eye(3), hidden=[0]), 1.0)
    assert film.said == []
    film.show(frame(np.eye(3)), 0.5)
    assert symbols(film.said[0]) == (0, 4)
    other = Film(TurnWatcher(ACTION_ROTATIONS))
    other.show(frame(np.eye(3), hidden=[0]), 2.5)
    assert [symbols(rest) for rest in other.said] == [(None, 4)]


def test_a_cube_that_is_gone_for_a_while_was_taken_away(film):
    film.show(frame(np.eye(3)), 1)
    film.show([], 1.5)
    assert len(film.said) == 1  # a hand before it
    film.show([], 3)
    film.show(frame(np.eye(3)), 1)
    assert [type(said) for said in film.said] == [CubeAtRest, CubeTakenAway, CubeAtRest]
    assert film.said[-1].turn == ()


def test_a_turn_behind_a_hand_is_told_by_a_tag_that_was_seen_before(film):
    film.show(frame(np.eye(3)), 1)
    film.show([], 1)
    film.show(frame(ACTION_ROTATIONS["flip"]), 1)
    assert film.said[-1].turn == ("flip",)


def test_a_turn_after_which_no_tag_is_known_is_not_guessed(film):
    film.show(frame(np.eye(3)), 1)
    film.show([], 1)
    film.show(frame(ACTION_ROTATIONS["left"] @ ACTION_ROTATIONS["left"], hidden=[4]), 3)
    assert film.said[-1].turn is None
    assert symbols(film.said[-1]) == (1, None)


def test_an_id_that_is_seen_twice_and_a_tag_that_does_not_count_are_left_out(film):
    tags = frame(np.eye(3))
    stranger = DetectedTag(40, None, tags[0].corners + 300, 0, np.zeros((5, 5)), tags[0].pose)
    twice = DetectedTag(0, 0, tags[0].corners + 500, 0, np.zeros((5, 5)), tags[0].pose)
    film.show([*tags, stranger, twice], 2.5)
    assert symbols(film.said[0]) == (None, 4)


def test_pictures_show_a_cube_at_rest_each(film):
    film.watcher.patience = Patience.of_pictures()
    cube = np.eye(3)
    for action in (None, "left", "flip"):
        cube = cube if action is None else ACTION_ROTATIONS[action] @ cube
        film.show(frame(cube))
    film.show([])
    assert [getattr(said, "turn", "gone") for said in film.said] == [(), ("left",), ("flip",), "gone"]


def test_tags_without_poses_are_refused(film):
    tag = DetectedTag(0, 0, np.zeros((4, 2)), 0, np.zeros((5, 5)))
    with pytest.raises(InvalidInputError, match="tags without poses; expected the intrinsics of the camera"):
        film.watcher.take(0, [tag])


@pytest.mark.parametrize("degrees", [-1, 90, float("nan")])
def test_a_pitch_that_is_none_is_refused(degrees):
    with pytest.raises(InvalidInputError, match=r"pitch of the camera: .*; expected 0 to below 90 degrees"):
        Viewpoint.pitched(degrees)
