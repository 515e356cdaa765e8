"""``explain`` with a memory that has learned of kinds."""

import json

import numpy as np
import pytest

from atg_fg.storage.memory_files import save_memory
from tests.learning.test_object_kinds import memory
from tests.learning.worlds import ARCUBES, cubes, trial_of

__all__ = ["memory"]  # a fixture


@pytest.fixture(scope="module")
def files(memory, tmp_path_factory):
    """The memory, and a script of a trial with a new cube."""
    folder = tmp_path_factory.mktemp("explain")
    save_memory(memory, folder / "robot.json")
    trial = trial_of(cubes(9)[8], 8, np.random.default_rng(1))
    steps = [{"observe": list(trial.detections[0])}]
    for action, look in zip(trial.actions, trial.detections[1:], strict=True):
        steps += [{"act": ARCUBES.actions[action]}, {"observe": list(look)}]
    saved = json.loads((folder / "robot.json").read_text())
    script = {
        "format": "atg-fg/scripted-trial",
        "version": 1,
        "assumptions": saved["assumptions"],
        "parameters": {"transition_concentration": 1e-8, "observation_noise": 1e-8, "learn_in_trial": True},
        "memory": [],
        "steps": steps,
    }
    (folder / "trial.json").write_text(json.dumps(script))
    return folder / "trial.json", folder / "robot.json", trial


def test_it_tells_what_kind_of_thing_it_is(files, run):
    script, robot, trial = files
    status, output, _ = run("explain", script, "--memory", robot)
    assert status == 0
    assert "a thing like these 6: 6 places, 24 poses" in output
    document = json.loads(run("explain", script, "--memory", robot, "--k", 3, "--json", "-")[1])
    best = document["explanations"][0]
    assert (best["kind"], best["object"]) == ("6 places, 24 poses", None)
    assert [tuple(aspect) for aspect in best["aspects"]] == list(trial.detections)
    assert best["probability"] > 0.02
    kinds = document["kinds"]
    assert kinds[0]["kind"].startswith("a thing like these 6")
    assert kinds[0]["probability"] > 0.99
    assert sum(kind["probability"] for kind in kinds) == pytest.approx(1.0, abs=0.01)
    assert -sum(document["surprise"]) == pytest.approx(document["log_evidence"])


def test_explanations_of_one_object_sum_to_what_it_is_believed_to_be(files, run):
    script, robot, _ = files
    document = json.loads(run("explain", script, "--memory", robot, "--k", 500, "--json", "-")[1])
    explained = sum(each["probability"] for each in document["explanations"])
    assert 0.9 < explained <= 1.0 + 1e-9


def test_what_cannot_be_is_refused_in_one_line(files, refused, tmp_path):
    script, robot, _ = files
    assert "--samples" in refused("explain", script, "--memory", robot, "--samples", 3)
    other = json.loads(robot.read_text())
    other["assumptions"]["n_aspects"] = 25
    (tmp_path / "other.json").write_text(json.dumps(other))
    assert "other assumptions" in refused("explain", script, "--memory", tmp_path / "other.json")
