"""A printed cube before a webcam, from sheet to memory: the sheet is rasterised, folded and filmed by the renderer."""

import json

import pytest

pytest.importorskip("pybullet")
pytest.importorskip("pypdfium2")
pytest.importorskip("matplotlib")

from atg_fg.worlds.arcube import ACTION_ROTATIONS
from sim.vision.turning_film import TurningFilm, write_video
from tests.printed_faces import faces_of

QUICK = {"rest": 0.5, "turn": 0.5}


def lens_file(webcam, path):
    """The calibration of a webcam, as camera calibrate would write it."""
    lens = {"intrinsics": webcam.intrinsics.tolist(), "distortion": list(webcam.distortion)}
    path.write_text(json.dumps({"format": "atg-fg/camera", "version": 1, "image_size": webcam.image_size, **lens}))
    return path


def recognised(run, tmp_path, trials, **options):
    """Print two cubes, film them, let the first trials be learned, and return verdicts and truths of the last ones."""
    run("print", "cube", "--tags", "0-11", "--cubes", "2", "-o", tmp_path / "cubes.pdf")
    film = TurningFilm(faces_of(tmp_path / "cubes.pdf", side=56), **options)
    webcam = film.webcam
    for name, filmed in trials.items():
        write_video(
            tmp_path / f"{name}.avi",
            (frame for cube, actions, start in filmed for frame in film.frames(cube, actions, start)),
            webcam.rate,
        )
    film.close()
    common = ["--tags", tmp_path / "cubes.json", "--calibration", lens_file(webcam, tmp_path / "camera.json")]
    common += ["--memory", tmp_path / "robot.db"]
    status, output, _ = run("live", "--video", tmp_path / "learned.avi", *common, "--learn", "--json", "-")
    assert status == 0
    learned = [trial["learned"] for trial in json.loads(output)["trials"]]
    _, output, _ = run("live", "--video", tmp_path / "later.avi", *common, "--json", "-")
    return learned, [trial["matched"] for trial in json.loads(output)["trials"]]


@pytest.mark.slow
def test_a_printed_cube_is_learned_and_recognised_on_video_from_end_to_end(run, tmp_path):
    trials = {"learned": [(0, ["flip", "left"], None)], "later": [(0, ["flip"], None)]}
    learned, matched = recognised(run, tmp_path, trials, **QUICK)
    assert learned == ["object-000"]
    assert matched == ["object-000"]


@pytest.mark.slow
def test_two_printed_cubes_are_told_apart_on_video(run, tmp_path):
    turns = ["flip", "left", "left", "flip", "right", "flip"]
    trials = {
        "learned": [(0, turns, None), (1, turns, None)],
        "later": [(1, ["flip", "left"], None), (0, ["left", "left"], ACTION_ROTATIONS["flip"]), (1, ["left"], None)],
    }
    learned, matched = recognised(run, tmp_path, trials, seed=1)
    assert learned == ["object-000", "object-001"]
    assert matched == ["object-001", "object-000", "object-001"]
