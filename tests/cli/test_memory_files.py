import json

import pytest

from atg_fg.core.memory import RobotMemory
from atg_fg.storage import memory_files
from atg_fg.storage.memory_files import open_memory
from tests.storage.database.small import add_cube, plain

QUICK = ["--engine", "bayes-filter", "--actions", "3"]


@pytest.fixture
def json_file(tmp_path):
    memory_files.save_memory(plain(2), tmp_path / "memory.json")
    return tmp_path / "memory.json"


@pytest.fixture
def robot(run, tmp_path):
    """A database in which two trials were run."""
    file = tmp_path / "robot.db"
    assert run("trial", *QUICK, "--save-memory", file)[0] == 0
    assert run("trial", *QUICK, "--seed", "1", "--memory", file, "--save-memory", file)[0] == 0
    return file


def test_trials_learn_in_place_and_leave_their_records(run, robot):
    with open_memory(robot, read_only=True) as memory:
        assert memory.names == ("object-000", "object-001")
        assert [(each.kind, each.seed, each.parameters["actions"]) for each in memory.experiments()] == [
            ("trial", 0, 3),
            ("trial", 1, 3),
        ]
        assert [trial.learned for trial in memory.trials()] == ["object-000", "object-001"]
    document = json.loads(run("memory", "show", robot, "--json", "-")[1])
    assert [row["name"] for row in document["objects"]] == ["object-000", "object-001"]
    assert (document["trials"], [each["trials"] for each in document["experiments"]]) == (2, [1, 1])
    assert "trial, seed 1" in run("memory", "show", robot)[1]
    assert run("memory", "check", robot)[:2] == (0, f"{robot}: sound, 2 ATGs\n")


def test_export_and_import_change_nothing(run, robot, tmp_path):
    assert run("memory", "export", robot, "--format", "json", "--output", tmp_path / "copy.json")[0] == 0
    assert run("memory", "diff", robot, tmp_path / "copy.json")[:2] == (0, "")
    lines = run("memory", "export", robot, "--format", "trials")[1].splitlines()
    assert [json.loads(line)["learned"] for line in lines] == ["object-000", "object-001"]
    copy = tmp_path / "copy.db"
    assert "2 ATGs, 0 experiments and 0 trials" in run("memory", "import", tmp_path / "copy.json", "--into", copy)[1]
    assert "0 ATGs, 2 experiments and 2 trials" not in run("memory", "check", copy)[1]
    whole = tmp_path / "whole.db"
    assert "2 ATGs, 2 experiments and 2 trials" in run("memory", "import", robot, "--into", whole)[1]
    assert run("memory", "export", whole, "--format", "trials")[1].splitlines() == lines


def test_import_takes_logs_of_tests_and_one_memory(run, refused, robot, json_file, tmp_path):
    records = tmp_path / "records"
    assert run("table1", "--tests", "1", "--trials", "3", *QUICK, "--records", records)[0] == 0
    log = records / "test-0000.jsonl.gz"
    into = tmp_path / "all.db"
    assert "0 ATGs, 1 experiments and 3 trials" in run("memory", "import", log, "--into", into)[1]
    assert "2 ATGs, 0 experiments and 0 trials" in run("memory", "import", log, json_file, "--into", into)[1]
    assert "more than one memory" in refused("memory", "import", robot, "--into", into)
    assert memory_files.load_memory(into) == plain(2)
    assert run("memory", "check", into)[0] == 0


def test_table1_writes_trials_into_a_database_and_goes_on_with_them(run, refused, tmp_path):
    file = tmp_path / "records.db"
    plan = ["table1", "--tests", "1", "--jobs", "1", *QUICK, "--records", file]
    result = json.loads(run(*plan, "--trials", "4", "--json", "-")[1])
    assert "has this test already" in refused(*plan, "--trials", "4")
    assert json.loads(run(*plan, "--trials", "4", "--resume", "--json", "-")[1]) == result
    document = json.loads(run("memory", "show", file, "--json", "-")[1])
    assert [(each["kind"], each["trials"]) for each in document["experiments"]] == [("test", 4)]
    assert "holds no memory, only records" in refused("memory", "export", file)
    assert run("memory", "check", file)[:2] == (0, f"{file}: sound, 0 ATGs\n")


def test_table1_saves_the_memory_of_one_test_into_a_database(run, refused, tmp_path):
    file = tmp_path / "memory.db"
    plan = ["table1", "--trials", "3", *QUICK, "--save-memories", file]
    assert run(*plan, "--tests", "1")[0] == 0
    assert len(memory_files.load_memory(file)) == 3
    assert "expected --tests 1 or a folder" in refused(*plan, "--tests", "2")


def test_merge_unites_objects_and_records(run, refused, robot, tmp_path):
    other, both = tmp_path / "other.db", tmp_path / "both.db"
    assert run("trial", *QUICK, "--seed", "7", "--save-memory", other)[0] == 0
    status, output, _ = run("memory", "merge", robot, other, "-o", both)
    assert status == 0
    assert "3 ATGs, 0 of them in both; 3 trials" in output
    assert "object-000 is object-002" in output
    with open_memory(both, read_only=True) as memory:
        assert [trial.learned for trial in memory.trials()] == ["object-000", "object-001", "object-002"]
    assert run("memory", "check", both)[0] == 0
    assert "is already there" in refused("memory", "merge", robot, other, "-o", both)
    again = tmp_path / "again.db"
    document = json.loads(run("memory", "merge", both, robot, "-o", again, "--json", "-")[1])
    assert (document["objects"], document["same"], document["trials"]) == (3, ["object-000", "object-001"], 3)


def test_diff_leaves_with_status_1_where_there_is_something_to_say(run, json_file, tmp_path):
    other = tmp_path / "other.db"
    memory = plain(2)
    add_cube(memory, 3)
    memory_files.save_memory(memory, other)
    status, output, _ = run("memory", "diff", json_file, other)
    assert (status, output) == (1, "+ object-002\n")
    document = json.loads(run("memory", "diff", other, json_file, "--json", "-")[1])
    assert (document["same"], document["difference"]) == (False, {"only_first": ["object-002"]})


def test_duplicates_are_merged_and_unmerged_in_a_database(run, tmp_path):
    file = tmp_path / "robot.db"
    memory = RobotMemory(plain(0).assumptions)
    for _ in range(2):
        memory.learn([0, 1, 2, 3, 4, 5], [0, 1, 2, 0, 1], matched=None)
    memory_files.save_memory(memory, file)
    assert "1 pairs of 2 ATGs merged" in run("memory", "duplicates", file, "--merge")[1]
    assert memory_files.load_memory(file).names == ("object-000",)
    assert run("memory", "unmerge", file, "object-001")[0] == 0
    assert memory_files.load_memory(file) == memory


def test_check_leaves_with_status_1_for_a_damaged_database_and_2_for_none(run, refused, robot):
    content = bytearray(robot.read_bytes())
    content[8192:12288] = bytes(4096)
    robot.write_bytes(content)
    status, output, _ = run("memory", "check", robot)
    assert (status, bool(output)) == (1, True)
    robot.write_bytes(content[:16] + bytes(100))
    assert "damaged" in refused("memory", "check", robot)
