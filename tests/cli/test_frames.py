import base64
import json

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.display.frames import FrameFolder, camera_picture, has_camera
from atg_fg.report.reading import read_report
from atg_fg.worlds.registry import make_world

PNG = b"\x89PNG\r\n\x1a\n"


def test_a_trial_leaves_a_picture_of_each_look_beside_its_record(run, tmp_path):
    record = tmp_path / "trial.jsonl"
    quick = ["--engine", "bayes-filter", "--actions", "2"]
    assert run("trial", "--world", "rendered", *quick, "--record", record, "--frames")[0] == 0
    steps = [json.loads(line) for line in record.read_text().splitlines()[1:-1]]
    assert [step["frame"] for step in steps] == [f"trial.frames/look-00{look}.png" for look in range(3)]
    pictures = [(tmp_path / step["frame"]).read_bytes() for step in steps]
    assert all(picture.startswith(PNG) for picture in pictures)
    assert len(set(pictures)) == 3


def test_pictures_are_what_the_camera_sees_with_the_detections_drawn(tmp_path):
    pytest.importorskip("pybullet")
    world = make_world("rendered")
    assert has_camera(world)
    world.reset(seed=0)
    picture = camera_picture(world)
    assert picture.shape == (240, 320, 3)
    assert (picture != world.get_wrapper_attr("frame")).any()
    folder = FrameFolder(tmp_path / "record.jsonl", world)
    assert folder.taken == []
    world.close()


def test_crops_of_what_was_seen_are_kept_and_stand_for_their_classes(run, tmp_path):
    pytest.importorskip("cv2")
    record = tmp_path / "trial.jsonl"
    quick = ["--engine", "bayes-filter", "--actions", "3", "--missing", "0.3"]
    assert run("trial", "--world", "picture-box", *quick, "--record", record, "--frames")[0] == 0
    steps = [json.loads(line) for line in record.read_text().splitlines()[1:-1]]
    assert [None in step["observed"] for step in steps] == [None in step["crops"] for step in steps]
    assert any(None in step["crops"] for step in steps)
    for look, step in enumerate(steps):
        for slot, (symbol, crop) in enumerate(zip(step["observed"], step["crops"], strict=True)):
            assert crop == (None if symbol is None else f"trial.frames/look-{look:03}-crop-{slot}.png")
    (page,) = read_report(record).trials
    assert set(page.thumbnails) == {symbol for step in steps for symbol in step["observed"]} - {None}
    address = page.thumbnails[steps[0]["observed"][0]]
    taken = [
        base64.b64encode((tmp_path / crop).read_bytes()).decode() for step in steps for crop in step["crops"] if crop
    ]
    assert address.removeprefix("data:image/png;base64,") in taken
    assert all(look.shown is None for look in page.looks)  # pictures have other numbers than classes


def test_the_robots_camera_offers_the_same(tmp_path):
    pytest.importorskip("pybullet")
    world = make_world("robonaut")
    world.reset(seed=0)
    assert camera_picture(world).dtype == np.uint8
    world.close()


def test_a_world_without_a_camera_is_refused(run, refused, tmp_path):
    with pytest.raises(InvalidInputError, match="expected a world with a camera"):
        FrameFolder(tmp_path / "record.jsonl", make_world("ideal"))
    assert "expected a world with a camera" in refused("trial", "--record", tmp_path / "a.jsonl", "--frames")
    assert list(tmp_path.iterdir()) == []


def test_frames_need_a_record(refused):
    assert "--frames: no record to keep them with" in refused("trial", "--world", "rendered", "--frames")
