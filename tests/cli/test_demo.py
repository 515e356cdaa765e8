import json
import os

import pytest

from atg_fg.storage import memory_files


def test_the_demo_films_the_robot(run, tmp_path):
    status, output, error = run("demo", "--output", tmp_path / "out", "--actions", "1", "--engine", "bayes-filter")
    assert (status, error) == (0, "")
    assert "look 1: front" in output
    assert (tmp_path / "out" / "film.gif").read_bytes().startswith(b"GIF89a")
    assert {"belief.png", "entropy.png", "memory.json", "trial.jsonl"} < set(os.listdir(tmp_path / "out"))


def test_the_demo_recognises_an_object_from_camera_images(run, tmp_path):
    status, output, error = run("demo", "--world", "rendered", "--output", tmp_path / "out", "--actions", "5")
    assert (status, error) == (0, "")
    assert "look 0: front" in output
    assert "expected entropy" in output
    verdict = output.split("verdict: ")[1].split(" ")[0]
    assert f"truth:   {verdict}" in output
    assert sorted(os.listdir(tmp_path / "out")) == [
        "belief.png",
        "entropy.png",
        "frame.png",
        "memory.json",
        "trial.frames",
        "trial.jsonl",
    ]
    assert len(os.listdir(tmp_path / "out" / "trial.frames")) == 6
    assert len(memory_files.load_memory(tmp_path / "out" / "memory.json")) == 6


@pytest.mark.slow
def test_the_robot_recognises_a_box_whose_pictures_it_met_before_a_rendered_camera(run, tmp_path):
    for world in ("picture-box", "robonaut-picture-box"):
        out = tmp_path / world
        status, output, error = run("demo", "--world", world, "--output", out, "--actions", "3")
        assert (status, error) == (0, "")
        assert "remembers 6 boxes" in output
        verdict = output.split("verdict: ")[1].split(" ")[0]
        assert f"truth:   {verdict}" in output
        assert (out / "film.gif").read_bytes().startswith(b"GIF89a")
        assert len([name for name in os.listdir(out / "trial.frames") if "crop" not in name]) == 4


def test_the_demo_tells_a_new_object(run, tmp_path):
    quick = ["--world", "ideal", "--engine", "bayes-filter", "--json", "-"]
    status, output, story = run("demo", "--output", tmp_path, "--novel", *quick)
    assert status == 0
    assert "verdict: a new object" in story
    document = json.loads(output)
    assert (document["judged_novel"], document["matched"], document["truth"]) == (True, None, None)
    assert "frame.png" not in os.listdir(tmp_path)


def test_a_folder_that_cannot_be_made_is_refused(refused, tmp_path):
    (tmp_path / "file").write_text("")
    assert "cannot be written" in refused("demo", "--output", tmp_path / "file" / "out")


def test_the_demo_is_of_arcubes_alone(refused, tmp_path):
    message = refused("demo", "--world", "half-and-half", "--output", tmp_path / "out")
    assert "--world: 'half-and-half'; expected a world of ARcubes: ideal, rendered, robonaut" in message
    assert not (tmp_path / "out").exists()
