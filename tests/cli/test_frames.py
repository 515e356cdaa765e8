import base64
import gzip
import json
import shutil

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


def test_a_picture_of_each_class_that_a_trial_shows_is_kept_beside_a_test(run, tmp_path):
    pytest.importorskip("cv2")
    records, whole, log = tmp_path / "a", tmp_path / "b", "test-0000.jsonl.gz"
    quick = ["table1", "--world", "picture-box", "--engine", "bayes-filter", "--tests", "1", "--actions", "3"]
    quick += ["--objects", "2", "--trials", "3", "--crops", "--records"]
    assert run(*quick, whole)[0] == 0
    shutil.copytree(whole, records)
    lines = gzip.decompress((whole / log).read_bytes()).splitlines(keepends=True)
    (records / log).write_bytes(b"".join(gzip.compress(line) for line in lines[:2]))  # cut off in the second trial
    for crop in (records / "test-0000.crops").glob("trial-00[12]*"):
        crop.unlink()
    assert run(*quick, records, "--resume")[0] == 0
    assert gzip.decompress((records / log).read_bytes()) == b"".join(lines)
    kept = [
        {file.name: file.read_bytes() for file in (each / "test-0000.crops").iterdir()} for each in (whole, records)
    ]
    assert kept[0] == kept[1]
    trials = [json.loads(line) for line in lines[1:]]
    for trial in trials:
        looks = zip(trial["observed"], trial["crops"], strict=True)
        shown = [symbol for look, crops in looks for symbol, crop in zip(look, crops, strict=True) if crop]
        assert sorted(shown) == sorted({symbol for look in trial["observed"] for symbol in look} - {None})
    assert sum(len(list(filter(None, crops))) for trial in trials for crops in trial["crops"]) == len(kept[0])
    pages = read_report(whole / log).trials
    addresses = ["data:image/png;base64," + base64.b64encode(content).decode() for content in kept[0].values()]
    for page in pages:
        drawn = {symbol for graph in page.graphs for aspect in graph.aspects for symbol in aspect}
        assert set(page.thumbnails) == drawn
        assert set(page.thumbnails.values()) <= set(addresses)


def test_crops_beside_a_test_need_a_folder_and_a_world_that_has_some(refused, tmp_path):
    quick = ["table1", "--engine", "bayes-filter", "--tests", "1", "--trials", "2", "--actions", "2", "--crops"]
    assert "crops: records None; expected a folder" in refused(*quick)
    assert "expected a folder of records" in refused(*quick, "--records", tmp_path / "trials.db")
    assert "offers no crops; expected a world of boxes" in refused(*quick, "--records", tmp_path / "trials")


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
