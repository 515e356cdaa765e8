import json
import subprocess
import sys

import pytest

from atg_fg.storage.presets import preset


def test_reliability_prints_rates_and_writes_them(run, tmp_path):
    file = tmp_path / "reliability.json"
    status, output, error = run("sim", "reliability", "--actions", 2, "--jobs", 1, "--json", file)
    assert (status, error) == (0, "")
    assert "nominal: 2 random actions, seed 0" in output
    document = json.loads(file.read_text())
    assert document["command"] == "sim reliability"
    assert document["parameters"] == {"condition": "nominal", "actions": 2, "seed": 0}
    assert document["success"]["of"] == 2
    assert len(document["success"]["interval95"]) == 2
    assert set(document["by_action"]) == {"flip", "left", "right"}
    preset_file = tmp_path / "mine.json"
    status, output, error = run("sim", "calibrate", file, "--output", preset_file)
    assert (status, error) == (0, "")
    assert "transition_concentration" in output
    assert preset(str(preset_file)).transition_concentration > 0
    assert json.loads(preset_file.read_text())["command"] == f"atg-fg sim calibrate {file}"


def test_json_alone_goes_to_standard_output(run):
    status, output, _ = run("sim", "reliability", "--actions", 1, "--jobs", 1, "--json", "-")
    assert status == 0
    assert json.loads(output)["success"]["of"] == 1


@pytest.mark.slow
def test_pictures_and_a_film_are_written(run, tmp_path):
    picture, film, table = tmp_path / "robot.png", tmp_path / "robot.gif", tmp_path / "table.png"
    status, _, error = run("sim", "picture", "--output", picture, "--film", film, "--table", table)
    assert (status, error) == (0, "")
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in (picture, table))
    assert film.read_bytes().startswith(b"GIF89a")


@pytest.mark.slow
def test_boxes_with_pictures_are_filmed_and_counted(run, refused, tmp_path):
    picture, film = tmp_path / "robot.png", tmp_path / "robot.gif"
    status, _, error = run("sim", "picture", "--pictures", "--output", picture, "--film", film)
    assert (status, error) == (0, "")
    assert film.read_bytes().startswith(b"GIF89a")
    status, output, error = run("sim", "reliability", "--pictures", "--actions", "2", "--jobs", "1", "--json", "-")
    assert (status, json.loads(output)["parameters"]["pictures"]) == (0, True)
    (tmp_path / "boxes.json").write_text(output)
    assert "detection.both.of is missing" in refused("sim", "calibrate", tmp_path / "boxes.json")


def test_bad_options_are_refused(refused, tmp_path):
    assert "condition: unknown name 'new'" in refused("sim", "reliability", "--condition", "new")
    assert "'--actions': Input should be greater than or equal to 1" in refused("sim", "reliability", "--actions", 0)
    assert "'--jobs': Input should be greater than or equal to 1" in refused("sim", "reliability", "--jobs", 0)
    assert "'--stations': Input should be greater than or equal to 1" in refused("sim", "reliability", "--stations", 0)
    assert "n_stations: 6" in refused("sim", "reliability", "--stations", 6, "--actions", 1, "--jobs", 1)
    assert "nowhere.urdf" in refused("sim", "reliability", "--urdf", "nowhere.urdf", "--actions", 1, "--jobs", 1)
    assert "nowhere.json" in refused("sim", "calibrate", "nowhere.json")
    assert "cannot be written" in refused("sim", "reliability", "--json", tmp_path / "none" / "file.json")
    assert "suffix" in refused("sim", "picture", "--output", tmp_path / "robot.txt")
    assert "suffix" in refused("sim", "picture", "--output", tmp_path / "robot.png", "--table", tmp_path / "table.txt")


def test_a_table_on_the_robot_is_recorded_and_gone_on_with(run, refused, tmp_path):
    arguments = ["table1", "--world", "robonaut", "--engine", "bayes-filter", "--tests", 1, "--actions", 1]
    arguments += ["--jobs", 1, "--condition", "worn", "--records", tmp_path, "--json", "-"]
    status, whole, _ = run(*arguments, "--trials", 2)
    assert status == 0
    assert json.loads(whole)["parameters"]["condition"] == "worn"
    assert "already there" in refused(*arguments, "--trials", 2)
    status, again, _ = run(*arguments, "--trials", 2, "--resume")
    assert (status, again) == (0, whole)
    assert "--resume: no records" in refused("table1", "--resume")
    assert "option 'condition': unknown" in refused("table1", "--condition", "worn", "--jobs", 1)


COUNTS = {
    "success": {"of": 10},
    "failures": {"lost": 1, "stayed": 2, "another_orientation": 1},
    "detection": {"both": {"of": 20}, "wrong_ids": {"count": 1}, "one": {"count": 2}, "none": {"count": 1}},
}


def test_calibration_needs_no_simulator(tmp_path):
    (tmp_path / "counts.json").write_text(json.dumps(COUNTS))
    code = "import sys; sys.modules.update(pybullet=None, cv2=None); from atg_fg.cli import main; main()"
    words = ["sim", "calibrate", tmp_path / "counts.json", "--output", tmp_path / "preset.json"]
    subprocess.run([sys.executable, "-c", code, *map(str, words)], check=True)
    assert preset(str(tmp_path / "preset.json")).observation_noise > 0


@pytest.mark.parametrize("value", [None, "many", 1.5, -1, 10**400, [], {}, True, 2**53 + 1, 10**6])
def test_counts_that_are_none_are_refused(refused, tmp_path, value):
    file, output = tmp_path / "counts.json", tmp_path / "preset.json"
    for place in (("failures", "stayed"), ("detection", "one", "count"), ("detection", "wrong_ids"), ("success",)):
        document = json.loads(json.dumps(COUNTS))
        holder = document
        for key in place[:-1]:
            holder = holder[key]
        holder[place[-1]] = value
        file.write_text(json.dumps(document))
        assert "counts.json: " in refused("sim", "calibrate", file, "--output", output)
        assert not output.exists()
