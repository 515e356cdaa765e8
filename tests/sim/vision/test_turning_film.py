import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.tags import TagDetector, Tags
from atg_fg.senses.turns import CubeAtRest, CubeTakenAway, TurnWatcher
from atg_fg.senses.video import FrameSource
from atg_fg.storage import named_pipes
from atg_fg.worlds.arcube import ACTION_ROTATIONS
from sim.bodies.cube import TAG_SIZE, face_image
from sim.vision.turning_film import TurningFilm, Webcam, write_video

QUICK = {"rest": 0.5, "turn": 0.5}


def events(frames, webcam):
    """What a watcher says of a film, with the number of the frame."""
    detector = TagDetector(
        Tags("5X5_50", TAG_SIZE, webcam.intrinsics, np.array(webcam.distortion), {tag: tag for tag in range(12)})
    )
    watcher = TurnWatcher(ACTION_ROTATIONS)
    said = [watcher.take(number / webcam.rate, detector.detect(frame)) for number, frame in enumerate(frames)]
    return [each for each in said if each is not None], watcher


def test_turns_are_noticed_behind_a_lens_in_wandering_light_with_blur_and_a_hand():
    film = TurningFilm([[face_image(tag) for tag in range(6)]], seed=0, **QUICK)
    said, watcher = events(film.frames(0, ["flip", "right"]), film.webcam)
    film.close()
    assert [getattr(each, "turn", "gone") for each in said] == [(), ("flip",), ("right",), "gone"]
    # The camera found out how far it looks down.
    pitch = np.degrees(np.arctan2(-watcher.viewpoint.up[2], -watcher.viewpoint.up[1]))
    assert pitch == pytest.approx(film.webcam.pitch, abs=4)


@pytest.mark.slow
def test_sixty_turns_of_six_films_are_all_noticed():
    wrong = []
    for seed in range(6):
        film = TurningFilm([[face_image(tag) for tag in range(6)]], seed=seed)
        actions = np.random.default_rng(seed).choice(list(ACTION_ROTATIONS), 10).tolist()
        said, _ = events(film.frames(0, actions), film.webcam)
        film.close()
        found = [each.turn for each in said if isinstance(each, CubeAtRest)]
        assert isinstance(said[-1], CubeTakenAway)
        if found != [(), *((action,) for action in actions)]:
            wrong.append((seed, actions, found))
    assert wrong == []


def test_the_lens_bends_what_is_straight():
    webcam = Webcam()
    image = np.zeros((*webcam.image_size[::-1], 3), dtype=np.uint8)
    image[40:44] = 255
    rows = [int(webcam.bent(image)[:, column, 0].argmax()) for column in (8, 200, 392)]
    assert rows[1] < min(rows[0], rows[2]) - 1


def test_the_same_seed_films_the_same():
    films = [TurningFilm([[face_image(tag) for tag in range(6)]], seed=3, **QUICK) for _ in range(2)]
    first, second = (next(film.frames(0, [])) for film in films)
    np.testing.assert_array_equal(first, second)
    for film in films:
        film.close()


def test_another_suffix_is_refused(tmp_path):
    with pytest.raises(InvalidInputError, match=r"film\.doc: suffix '\.doc'; expected one of: \.avi, \.mp4"):
        write_video(tmp_path / "film.doc", iter([]), 10)


FRAMES = [np.full((48, 64, 3), level, dtype=np.uint8) for level in (0, 100, 200)]


@pytest.mark.parametrize("suffix", [".avi", ".mp4", ".AVI"])
def test_a_pipe_without_a_reader_is_given_up_and_one_with_a_reader_gets_the_film(tmp_path, monkeypatch, suffix):
    monkeypatch.setattr(named_pipes, "PIPE_WAIT", 0.2)
    path = tmp_path / f"100%03d{suffix}"
    os.mkfifo(path)
    with pytest.raises(InvalidInputError, match="a pipe from which no one reads"):
        write_video(path, iter(FRAMES), 10)
    with ThreadPoolExecutor(1) as executor:
        read = executor.submit(path.read_bytes)
        assert write_video(path, iter(FRAMES), 10) == 3
        (tmp_path / "film.avi").write_bytes(read.result())
    with FrameSource("video", tmp_path / "film.avi") as frames:
        assert [round(float(frame.image.mean()) / 100) for frame in frames] == [0, 1, 2]


def test_a_film_that_is_broken_off_leaves_the_old_one(tmp_path):
    path = tmp_path / "film.avi"
    path.write_bytes(b"old")

    def broken_off():
        yield FRAMES[0]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video(path, broken_off(), 10)
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["film.avi"]
