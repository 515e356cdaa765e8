import sqlite3
from contextlib import closing

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.parameters import ModelParameters
from atg_fg.experiments.trial import learn_from
from atg_fg.learning.structured_memory import memory_for
from atg_fg.storage.database.checking import faults_of_database
from atg_fg.storage.memory_files import open_memory
from tests.storage.database.small import ARCUBES, a_record


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "robot.db"
    with open_memory(path, ARCUBES) as memory:
        memory.begin_experiment("trial", {"actions": 4}, seed=0)
        for seed in range(2):
            learn_from(a_record(seed), memory)
    return path


def change(path, statement):
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("PRAGMA ignore_check_constraints = ON")
        connection.execute(statement)


def test_a_sound_database_has_no_faults(path):
    assert faults_of_database(path) == []


def test_a_trial_that_changed_hands_is_no_fault(tmp_path):
    path = tmp_path / "robot.db"
    with memory_for(ModelParameters(learn_structure=True), open_memory(path, ARCUBES)) as memory:
        assert [learn_from(a_record(seed), memory) for seed in range(2)] == ["object-000", "object-001"]
        memory.reassign({1: "object-000"})
        assert memory.names == ("object-000",)
    assert faults_of_database(path) == []


@pytest.mark.parametrize(
    ("statement", "fault"),
    [
        ("UPDATE transitions SET count = 0", "CHECK constraint failed in transitions"),
        ("DELETE FROM graphs WHERE id = 1", "aspects: a row refers to one of graphs that is not there"),
        ("UPDATE aspects SET symbols = '[3, 3]' WHERE number = 0", "symbol 3 is repeated"),
        ("UPDATE aspects SET number = 9 WHERE number = 0", "number 1; expected 0"),
        ("UPDATE assumptions SET n_objects = -1", "n_objects: -1; expected a whole number"),
        ("UPDATE trials SET verdict = 'perhaps'", "verdict: 'perhaps'; expected one of: novel, known, lost, undecided"),
        ("UPDATE trials SET verdict = 'known'", "verdict known, matched None"),
        ("UPDATE trials SET verdict = 'lost'", "expected the last truth of what is lost only"),
        ("UPDATE trials SET learned = 'cup'", "learned: 'cup'; expected the name of an ATG in this memory"),
        ("UPDATE trials SET number = number + 7", "trial 7; expected 0"),
        ("DELETE FROM steps WHERE number = 0", "number 1; expected 0"),
        ("UPDATE steps SET action = 'jump' WHERE action = 'flip'", "does not fit the assumptions"),
        ("UPDATE steps SET unseen = 2.0", "unseen: 2.0; expected a finite number from 0 to 1"),
        ("UPDATE steps SET truth = '{'", "truth: not valid JSON"),
        ("UPDATE experiments SET parameters = '[]'", "parameters: []; expected an object"),
        ("UPDATE experiments SET seed = 'one'", "seed: 'one'; expected a whole number"),
    ],
)
def test_what_is_wrong_is_named(path, statement, fault):
    change(path, statement)
    faults = faults_of_database(path)
    assert any(fault in each for each in faults), faults
    assert all(each.startswith(str(path)) for each in faults)


def test_a_damaged_page_is_a_fault(path):
    content = bytearray(path.read_bytes())
    content[8192:12288] = bytes(4096)
    path.write_bytes(content)
    assert faults_of_database(path)


def test_what_is_no_database_has_no_faults_but_an_error(path):
    path.write_bytes(b"SQLite format 3\0" + bytes(4096))
    with pytest.raises(InvalidInputError, match=r"robot\.db: damaged"):
        faults_of_database(path)
