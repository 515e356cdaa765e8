"""Where a box stands, told from its outline: against the poses that it was drawn at."""

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.worlds.arcube import FACES, rotation_of
from sim.bodies.pictures import draw_picture
from sim.vision.box_pose import find_box
from sim.vision.camera import Camera
from sim.vision.picture_box_camera import PictureBoxCamera

STILL = dict.fromkeys(("position_jitter", "yaw_jitter", "light_jitter", "image_noise", "blur"), 0.0)
USUAL = {"position_jitter": 0.02, "yaw_jitter": 10.0, "light_jitter": 0.5, "image_noise": 8.0, "blur": 0.6}


def drawn_at(camera, rng, orientation):
    """Return a frame, and the pose that it was drawn at: what the camera draws first."""
    pictures = [draw_picture(rng) for _ in FACES]
    ahead = np.random.default_rng()
    ahead.bit_generator.state = rng.bit_generator.state
    frame = camera.frame(pictures, rotation_of(orientation), rng)
    x, y = ahead.uniform(-1, 1, 2) * camera.position_jitter
    return frame, np.array([x, y, np.radians(ahead.uniform(-1, 1) * camera.yaw_jitter)])


def test_poses_are_right_to_millimetres_whatever_is_on_the_box():
    camera, rng = PictureBoxCamera(Camera(), **USUAL), np.random.default_rng(0)
    errors = []
    for number in range(96):
        frame, true = drawn_at(camera, rng, number % 24)
        found = find_box(frame, camera.empty, camera.camera.project)
        if found is not None:
            errors.append(np.abs(found - true))
    assert len(errors) >= 93
    position, angle = np.array(errors)[:, :2], np.degrees(np.array(errors)[:, 2])
    assert position.mean() < 0.0015
    assert np.percentile(position, 95) < 0.005
    assert angle.mean() < 0.5


def test_what_is_no_box_is_not_taken_for_one():
    camera = PictureBoxCamera(Camera(), **STILL)
    empty = np.round(camera.empty).astype(np.uint8)
    assert find_box(empty, camera.empty, camera.camera.project) is None
    pole = empty.copy()
    pole[20:200, 150:170] = 0
    assert find_box(pole, camera.empty, camera.camera.project) is None


@pytest.mark.parametrize(
    "frame", [np.zeros((240, 320), np.uint8), np.zeros((120, 160, 3), np.uint8), np.zeros((240, 320, 3), np.float32)]
)
def test_a_frame_of_another_size_or_type_is_refused(frame):
    camera = PictureBoxCamera(Camera(), **STILL)
    with pytest.raises(InvalidInputError, match=r"frame: shape .* expected RGB bytes, 320 by 240 pixels"):
        camera.crops(frame)


def test_of_a_black_frame_what_is_cut_out_is_black():
    crops = PictureBoxCamera(Camera(), **STILL).crops(np.zeros((240, 320, 3), np.uint8))
    assert crops.shape == (2, 48, 48, 3)
    assert not crops.any()
