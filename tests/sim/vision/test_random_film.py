import json

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.video import FrameSource
from atg_fg.storage.camera_files import CubeTags, read_calibration, write_tags
from atg_fg.worlds.arcube import ACTION_ROTATIONS, SUCCESSORS
from sim.vision.random_film import _turns, film_cubes
from sim.vision.turning_film import Webcam

CUBES = ((0, 1, 2, 3, 4, 5), (6, 7, 8, 9, 10, 11))


@pytest.fixture
def tags(tmp_path):
    path = tmp_path / "cubes.json"
    path.write_text(json.dumps(write_tags(CubeTags("5X5_50", 0.042, tuple(range(12)), CUBES))))
    return path


def test_each_cube_is_filmed_once_before_any_comes_again(tags, tmp_path):
    webcam = Webcam(image_size=(64, 48), rate=4.0)
    film = tmp_path / "film.avi"
    trials = film_cubes(tags, film, tmp_path / "camera.json", 3, 1, 0, webcam)
    assert sorted(cube for cube, _ in trials[:2]) == [0, 1]
    assert all(len(turns) == 1 for _, turns in trials)
    assert read_calibration(tmp_path / "camera.json").image_size == (64, 48)
    with FrameSource("video", film) as frames:
        assert sum(1 for _ in frames) > 30


def test_turns_lead_to_views_not_shown_before_while_there_are_such():

    for seed in range(5):
        shown, stands = {0}, 0
        for turn in _turns(0, 12, np.random.default_rng(seed)):
            successors = SUCCESSORS[stands]
            new = {after for after in successors if after not in shown}
            stands = successors[list(ACTION_ROTATIONS).index(turn)]
            assert stands in new or not new
            shown.add(stands)


def test_a_file_without_cubes_and_another_suffix_are_refused(tags, tmp_path):
    with pytest.raises(InvalidInputError, match=r"film\.doc: suffix"):
        film_cubes(tags, tmp_path / "film.doc", tmp_path / "camera.json", 1, 1, 0)
    tags.write_text(json.dumps({**json.loads(tags.read_text()), "cubes": []}))
    with pytest.raises(InvalidInputError, match=r"cubes\.json: no cubes; expected a file that print cube wrote"):
        film_cubes(tags, tmp_path / "film.avi", tmp_path / "camera.json", 1, 1, 0)
