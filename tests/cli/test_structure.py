import json

import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import memory_files
from tests.learning.boxes import INSIDE, box_memory
from tests.learning.worlds import uncertain_object, uncertain_trial


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("structure") / "memory.json"


def test_trials_one_after_the_other_make_a_memory_in_which_the_cube_is_found(run, file):
    for seed in range(5):
        before = ["--memory", file] if seed else []
        assert run("trial", "--preset", "learned", *before, "--save-memory", file, "--seed", seed)[0] == 0
    status, output, _ = run("memory", "structure", file)
    assert status == 0
    assert "24 aspects, registers front, top, c3, c4, c5, c6" in output
    assert "flip: front ← top" in output
    document = json.loads(run("memory", "structure", file, "--json", "-")[1])
    assert (document["trials"], document["structures"][0]["aspects"]) == (5, 24)
    assert document["evaluations"] > 0
    assert document["structures"][0]["gain"] > 50
    assert document["structures"][0]["sources"]["flip"][0] == "top"
    assert set(document["rates"]) == {"slip", "wrong", "repeat", "share"}
    for row in document["objects"]:
        assert row["follows"] > 0.99
        assert row["observed"] + row["predicted"] + row["unknown"] == 24


def test_structure_and_completed_graphs_are_drawn_and_exported(run, file, tmp_path):
    assert run("memory", "structure", file, "--plot", tmp_path / "structure.png")[0] == 0
    named = ("--object", "object-001", "--plot", tmp_path / "object.svg", "--json", tmp_path / "object.json")
    assert run("memory", "structure", file, *named)[0] == 0
    assert (tmp_path / "structure.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "object.svg").exists()
    completed = json.loads((tmp_path / "object.json").read_text())["completed"]
    assert (len(completed["aspects"]), len(completed["transitions"])) == (24, 72)
    exported = run("memory", "export", file, "--name", "object-001", "--completed")[1]
    assert exported.count("<node ") == 24


@pytest.mark.slow
def test_what_an_irreversible_action_loses_is_said_and_drawn(run, tmp_path):
    file, memory = tmp_path / "memory.json", box_memory()
    memory_files.save_memory(memory, file)
    assert memory_files.load_memory(file) == memory
    status, output, _ = run("memory", "structure", file)
    assert status == 0
    assert "8 aspects, registers front, right, top, c4, c5, c6" in output
    assert f"open: top ← c{INSIDE + 1}; lost: top" in output
    document = json.loads(run("memory", "structure", file, "--json", "-")[1])
    assert document["structures"][0]["sources"]["open"][2] == f"c{INSIDE + 1}"
    assert run("memory", "structure", file, "--plot", tmp_path / "structure.svg")[0] == 0


def test_memories_without_structure_say_so_in_one_line(run, refused, tmp_path):
    plain, empty = tmp_path / "plain.json", tmp_path / "empty.json"
    memory_files.save_memory(RobotMemory(arcube_assumptions()), plain)
    memory_files.save_memory(StructuredMemory(arcube_assumptions()), empty)
    for file, reason in ((plain, "its trials were not kept"), (empty, "none explains its 0 trials")):
        status, output, _ = run("memory", "structure", file)
        assert status == 0
        assert output.count("\n") == 1
        assert f"no learned structure: {reason}" in output
        assert json.loads(run("memory", "structure", file, "--json", "-")[1])["structures"] == []
        assert "no learned structure to draw" in refused("memory", "structure", file, "--plot", tmp_path / "x.png")
        assert not (tmp_path / "x.png").exists()


def test_what_is_not_there_is_refused(run, refused, file, tmp_path):
    assert "unknown name 'cup'" in refused("memory", "structure", file, "--object", "cup")
    assert "expected .png, .svg or .pdf" in refused("memory", "structure", file, "--plot", tmp_path / "x.gif")
    plain = tmp_path / "plain.json"
    memory = RobotMemory(arcube_assumptions())
    memory.learn([0], [], None)
    memory_files.save_memory(memory, plain)
    assert "--completed" in refused("memory", "export", plain, "--completed")


def test_objects_whose_actions_are_uncertain_are_shown_and_kept(run, refused, tmp_path):
    memory, rng = StructuredMemory(arcube_assumptions()), np.random.default_rng(0)
    objects = [uncertain_object(rng) for _ in range(3)]
    for number in range(12):
        trial = uncertain_trial(objects[number % 3], 10, rng)
        patterns = [memory.assumptions.alphabet.index(look) for look in trial.detections]
        name = memory.learn(patterns, list(trial.actions), None)
        memory.learn_shared(name, trial.detections, trial.actions)
    for file in (tmp_path / "memory.json", tmp_path / "memory.db"):
        memory_files.save_memory(memory, file)
        assert memory_files.load_memory(file) == memory
        status, output, _ = run("memory", "structure", file)
        assert status == 0
        assert f"uncertain actions, α = {memory.learner.noise.concentration:g}" in output
        document = json.loads(run("memory", "structure", file, "--json", "-")[1])
        assert document["structures"] == []
        assert document["uncertain"]["concentration"] == memory.learner.noise.concentration
        assert len(document["uncertain"]["members"]) > 8
    assert "uncertain actions" in refused("memory", "structure", file, "--plot", tmp_path / "structure.svg")
