"""What ``atg-fg watch --save`` leaves can be read back, and holds what was promised."""

import importlib.util
import re
import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

from atg_fg.cli.demo import learn_beforehand
from atg_fg.display.rerun_viewer import TrialViewer
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import EntropyPolicy
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.registry import make_world

needs_rerun = pytest.mark.skipif(importlib.util.find_spec("rerun") is None, reason="rerun-sdk is not installed")


def said(*arguments):
    """Return what Rerun's own command line says of a recording."""
    command = [sys.executable, "-m", "rerun_cli", "rrd", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout + done.stderr


def rows_of(path):
    """Return, for each entity of a recording, how many rows it has in all; how many chunks they are in is by chance."""
    rows = Counter()
    for number, name in re.findall(r"with ([\d ]+) rows \([^)]*\) - (/\S*)", said("print", path)):
        rows[name] += int(number.replace(" ", ""))
    return rows


@needs_rerun
def test_a_recording_of_the_robot_holds_robot_cube_camera_belief_and_entropy(run, tmp_path):
    pytest.importorskip("pybullet")
    path = tmp_path / "trial.rrd"
    status, output, error = run("watch", "--world", "robonaut", "--actions", "1", "--save", path)
    assert (status, error) == (0, "")
    assert "look 1: front" in output
    assert "verified without error" in said("verify", path)
    rows = rows_of(path)
    for entity in (
        "/world", "/world/camera", "/world/cube_0", "/world/cube_0/face_5",
        "/belief/bars", "/belief/names", "/belief/unseen", "/entropy/now", "/entropy/expected/flip", "/story",
    ):  # fmt: skip
        assert entity in rows, entity
    assert any(name.startswith("/world/table_0/") and name.endswith("/shape_0") for name in rows)
    links = {name.split("/")[3] for name in rows if name.startswith("/world/robot/")}
    assert {"r2.left_arm.wrist.yaw", "r2.right_arm.wrist.yaw"} <= links
    assert sum("/world/robot/" in name and "/shape_" in name for name in rows) == 68
    # The action takes some simulated seconds, in which poses are logged ten times a second.
    assert rows["/world/cube_0"] > 20
    assert rows["/belief/unseen"] == 2


@pytest.mark.slow
@needs_rerun
def test_a_box_with_pictures_is_watched_as_a_cube_is(run, tmp_path):
    pytest.importorskip("pybullet")
    path = tmp_path / "trial.rrd"
    status, _, error = run("watch", "--world", "picture-box", "--actions", "1", "--save", path)
    assert (status, error) == (0, "")
    assert "verified without error" in said("verify", path)
    assert {"/world/camera", "/world/cube_0/face_5", "/belief/bars"} <= set(rows_of(path))


@needs_rerun
def test_what_is_logged_of_a_trial_is_what_its_record_says(tmp_path):
    from rerun.chunk import RrdReader

    cubes = make_arcubes(7, 0)
    memory = learn_beforehand(cubes, preset("default"), np.random.default_rng(0))
    world = make_world("ideal", cubes=cubes)
    viewer = TrialViewer(world, memory, tmp_path / "trial.rrd")
    inference = begin_trial("bayes-filter", memory, preset("default"))
    record = run_trial(world, inference, EntropyPolicy(), 3, np.random.default_rng(1), on_step=viewer.tell)
    viewer.verdict(record)
    viewer.close()
    logged = {"/belief/unseen": {}, "/entropy/now": {}}
    for chunk in RrdReader(tmp_path / "trial.rrd").stream().to_chunks():
        if chunk.entity_path in logged:
            table = chunk.to_record_batch()
            if "look" not in table.schema.names:
                continue  # how the line looks
            values = [value[0] for value in table.column("Scalars:scalars").to_pylist()]
            logged[chunk.entity_path] |= dict(zip(table.column("look").to_pylist(), values, strict=True))
    assert logged["/belief/unseen"] == {time: step.belief.unseen for time, step in enumerate(record.steps)}
    assert logged["/entropy/now"] == {time: step.belief.entropy for time, step in enumerate(record.steps)}


@needs_rerun
def test_a_recording_that_cannot_be_saved_is_refused_before_the_trial(refused, tmp_path):
    assert "suffix '.txt'; expected .rrd" in refused("watch", "--save", tmp_path / "trial.txt")
    assert "cannot be written" in refused("watch", "--save", tmp_path / "no" / "trial.rrd")
    assert "expected a world of ARcubes" in refused("watch", "--world", "prism", "--save", tmp_path / "trial.rrd")
    assert list(tmp_path.iterdir()) == []


def test_without_rerun_the_extra_is_named(refused, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert 'pip install "atg-fg[viewer]"' in refused("watch", "--save", tmp_path / "trial.rrd")
