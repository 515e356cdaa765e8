import io
import json

import networkx
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.storage import memory_files


@pytest.fixture
def file(tmp_path):
    memory = RobotMemory(arcube_assumptions())
    memory.learn([0, 1, 2], [0, 1], matched=None)
    memory_files.save_memory(memory, tmp_path / "memory.json")
    return tmp_path / "memory.json"


def test_show_lists_what_is_known_of_each_object(run, file):
    status, output, _ = run("memory", "show", file)
    assert status == 0
    assert "object-000" in output
    status, output, _ = run("memory", "show", file, "--json", "-")
    (row,) = json.loads(output)["objects"]
    assert (row["aspects"], row["unobserved"], row["edges"], row["unknown_edges"]) == (3, 21, 2, 7)


def test_check_says_that_a_memory_is_sound(run, file):
    assert run("memory", "check", file)[:2] == (0, f"{file}: sound, 1 ATGs\n")
    assert json.loads(run("memory", "check", file, "--json", "-")[1])["sound"] is True


def test_check_leaves_with_status_1_if_there_is_a_fault_and_2_if_it_is_no_memory(run, refused, file, tmp_path):
    file.write_text(file.read_text().replace('"count": 1', '"count": -1', 1))
    status, output, _ = run("memory", "check", file)
    assert (status, output.count("\n")) == (1, 1)
    assert "memory[0].transitions[0].count: -1; expected a whole number of at least 1" in output
    assert json.loads(run("memory", "check", file, "--json", "-")[1])["sound"] is False
    assert "cannot be read" in refused("memory", "check", tmp_path / "absent.json")
    file.write_text("{}")
    assert "is no memory file" in refused("memory", "check", file)


def test_export_writes_graphml_that_networkx_reads(run, file, tmp_path):
    status, output, _ = run("memory", "export", file)
    assert status == 0
    assert networkx.read_graphml(io.BytesIO(output.encode())).number_of_edges() == 9
    run("memory", "export", file, "--format", "dot", "--output", tmp_path / "atg.dot")
    assert (tmp_path / "atg.dot").read_text().startswith("digraph")


def test_export_refuses_what_is_not_there(refused, file, tmp_path):
    assert "unknown name 'cup'; expected one of: object-000" in refused("memory", "export", file, "--name", "cup")
    assert "--format: 'svg'; expected one of: graphml, dot" in refused("memory", "export", file, "--format", "svg")
    memory_files.save_memory(RobotMemory(arcube_assumptions()), file)
    assert "the memory is empty" in refused("memory", "export", file)


def test_duplicates_are_found_merged_and_taken_apart_again(run, refused, tmp_path):
    file = tmp_path / "memory.json"
    memory = RobotMemory(arcube_assumptions())
    for _ in range(2):
        memory.learn([0, 1, 2, 3, 4, 5], [0, 1, 2, 0, 1], matched=None)
    memory.learn([50, 51], [0], matched=None)
    memory_files.save_memory(memory, file)
    before = file.read_text()
    status, output, _ = run("memory", "duplicates", file)
    assert (status, file.read_text()) == (0, before)
    assert "1 pairs of 3 ATGs probably of one object\nobject-000 and object-001: log odds" in output
    (pair,) = json.loads(run("memory", "duplicates", file, "--merge", "--json", "-")[1])["pairs"]
    assert (pair["keep"], pair["drop"]) == ("object-000", "object-001")
    assert memory_files.load_memory(file).names == ("object-000", "object-002")
    assert "0 pairs of 2 ATGs merged" in run("memory", "duplicates", file, "--merge")[1]
    assert "unknown name 'object-002'; expected one of: object-001" in refused("memory", "unmerge", file, "object-002")
    assert run("memory", "unmerge", file, "object-001")[0] == 0
    assert file.read_text() == before
    assert "threshold: nan" in refused("memory", "duplicates", file, "--threshold", "nan")


def test_a_compact_memory_is_shown_checked_and_tried_as_any_other(run, refused, file, tmp_path):
    arrays, record = tmp_path / "memory.npz", tmp_path / "trial.jsonl"
    status, output, _ = run("memory", "compact", file, "--output", arrays)
    assert (status, output.startswith(f"{arrays}: 1 ATGs")) == (0, True)
    assert run("memory", "show", arrays, "--json", "-") == run("memory", "show", file, "--json", "-")
    assert run("memory", "check", arrays)[:2] == (0, f"{arrays}: sound, 1 ATGs\n")
    assert run("memory", "export", arrays) == run("memory", "export", file)
    trial = ["trial", "--engine", "large-memory", "--actions", "2", "--record", record]
    status, output, _ = run(*trial, "--memory", arrays, "--save-memory", arrays)
    assert status == 0
    assert "off by a total variation of at most" in output
    assert json.loads(record.read_text().splitlines()[1])["total_variation_bound"] == 0
    assert "2 ATGs" in run("memory", "check", arrays)[1]
    assert "expected a name that ends in .npz" in refused("memory", "compact", file, "--output", tmp_path / "a.json")
    arrays.write_bytes(b"")
    assert "memory.npz: not a sound file of arrays" in refused("memory", "check", arrays)


def test_only_atgs_go_into_a_compact_memory(refused, tmp_path):
    memory = RobotMemory(arcube_assumptions())
    for _ in range(2):
        memory.learn([0, 1], [0], matched=None)
    memory.merge("object-000", "object-001")
    memory_files.save_memory(memory, tmp_path / "memory.json")
    error = refused("memory", "compact", tmp_path / "memory.json", "--output", tmp_path / "memory.npz")
    assert "merges or a learned structure" in error


@pytest.mark.parametrize("name", ["robot.json", "robot.db"])
def test_an_object_gets_another_name_and_keeps_what_was_learned(run, refused, tmp_path, name):
    path = tmp_path / name
    run("trial", "--preset", "learned", "--actions", "3", "--save-memory", path, "--seed", "1")
    before = memory_files.load_memory(path)
    assert run("memory", "rename", path, "object-000", "cup")[0] == 0
    after = memory_files.load_memory(path)
    assert after.names == ("cup",)
    assert after["cup"].counts == before["object-000"].counts
    assert after.learner.owners == ["cup"]
    assert "name 'cup' is taken" in refused("memory", "rename", path, "cup", "cup")
    assert "object-000" in refused("memory", "rename", path, "object-000", "mug")
    assert memory_files.load_memory(path) == after
