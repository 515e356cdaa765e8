"""Records from elsewhere: none is imported that could not be read, and one that got in can be taken out."""

import gzip
import json
import sqlite3
from contextlib import closing

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.report.reading import read_report
from atg_fg.storage.database.checking import faults_of_database
from atg_fg.storage.database.repairing import REPAIR_KIND, repair_database
from atg_fg.storage.database.trial_log import read_stored_experiments, read_stored_trials
from atg_fg.storage.recorded_test import recorded_tests
from tests.cli.conftest import run as run  # a fixture

PLAN = TestPlan(engine="bayes-filter", n_trials=6, n_actions=3)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("recorded")
    run_test(PLAN, 0, folder)
    return [json.loads(line) for line in gzip.decompress((folder / "test-0000.jsonl.gz").read_bytes()).splitlines()]


def write_log(path, lines):
    path.write_bytes(b"".join(gzip.compress(json.dumps(line).encode() + b"\n") for line in lines))


CHANGES = {
    "verdict": lambda trial: trial.update(verdict="perhaps"),
    "verdict of a list": lambda trial: trial.update(verdict=[]),
    "known without a match": lambda trial: trial.update(verdict="known", matched=None),
    "match of a number": lambda trial: trial.update(verdict="known", matched=3),
    "match of half a character": lambda trial: trial.update(verdict="known", matched="\ud800"),
    "lost without its truth": lambda trial: trial.update(verdict="lost", matched=None),
    "no looks": lambda trial: trial.update(observed=[], actions=[], unseen=[], entropy=[], truth=[]),
    "a look of text": lambda trial: trial["observed"].__setitem__(0, "front"),
    "a symbol too large": lambda trial: trial["observed"].__setitem__(0, [3, 99]),
    "a symbol of a fraction": lambda trial: trial["observed"].__setitem__(0, [3, 1.5]),
    "a symbol of a truth value": lambda trial: trial["observed"].__setitem__(0, [3, True]),
    "an action of another world": lambda trial: trial["actions"].__setitem__(0, "jump"),
    "an action of a number": lambda trial: trial["actions"].__setitem__(0, 1),
    "an action too few": lambda trial: trial["actions"].pop(),
    "a probability above one": lambda trial: trial["unseen"].__setitem__(0, 1.5),
    "a probability of text": lambda trial: trial["unseen"].__setitem__(0, "1"),
    "a probability too large for a float": lambda trial: trial["unseen"].__setitem__(0, 10**400),
    "an entropy below zero": lambda trial: trial["entropy"].__setitem__(0, -1.0),
    "a truth of text": lambda trial: trial["truth"].__setitem__(0, "cube"),
    "a truth too few": lambda trial: trial["truth"].pop(),
    "an object of a list": lambda trial: trial["truth"][0].update(object=[1]),
    "a purpose of a number": lambda trial: trial.update(purpose=[1, None, None, None]),
    "learned of a number": lambda trial: trial.update(learned=3),
    "learned of a pattern too large": lambda trial: trial.update(learned=[999, None, None, None]),
    "a key that is no key": lambda trial: trial.update(nothing=1),
    "gone": lambda trial: trial.clear(),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_an_unsound_trial_is_refused_everywhere_and_leaves_the_database_as_it_was(recorded, run, tmp_path, change):
    lines = json.loads(json.dumps(recorded))
    change(lines[3])
    write_log(tmp_path / "good.jsonl.gz", recorded)
    write_log(tmp_path / "bad.jsonl.gz", lines)
    robot = tmp_path / "robot.db"
    assert run("memory", "import", tmp_path / "good.jsonl.gz", "--into", robot)[0] == 0
    before = list(read_stored_trials(robot))
    for command in (
        ("memory", "import", tmp_path / "bad.jsonl.gz", "--into", robot),
        ("rescore", tmp_path / "bad.jsonl.gz", "--preset", "default"),
        ("report", tmp_path / "bad.jsonl.gz", "-o", tmp_path / "page.html"),
    ):
        status, _, errors = run(*command)
        assert (status, errors.count("\n")) == (2, 1), errors
        assert f"{tmp_path / 'bad.jsonl.gz'}: trial 2: " in errors
    assert list(read_stored_trials(robot)) == before
    assert faults_of_database(robot) == []


HEADERS = {
    "a seed of text": {"seed": "0"}, "a seed below zero": {"seed": -1}, "no seed": {"seed": None},
    "a world of a list": {"world": []}, "objects of text": {"n_objects": "many"}, "no objects": {"n_objects": 0},
    "parameters of a list": {"parameters": [1]}, "an unknown parameter": {"parameters": {"alpha": 1}},
    "a parameter out of its range": {"parameters": {"observation_noise": 2}}, "a policy of a number": {"policy": 3},
    "options of another world": {"world": "prism", "world_options": {"n_rings": 2}},
    "an option of text": {"world": "prism", "world_options": {"slip": "much"}},
    "too many symbols": {"world": "lock", "world_options": {"n_symbols": 10**12}},
    "merging of text": {"merge_duplicates": "yes"}, "nested deeply": {"note": json.loads("[" * 900 + "]" * 900)},
}  # fmt: skip


@pytest.mark.parametrize("change", HEADERS.values(), ids=HEADERS)
def test_an_unsound_header_is_refused_and_leaves_no_database(recorded, run, tmp_path, change):
    write_log(tmp_path / "bad.jsonl.gz", [{**recorded[0], **change}, *recorded[1:]])
    status, _, errors = run("memory", "import", tmp_path / "bad.jsonl.gz", "--into", tmp_path / "robot.db")
    assert (status, errors.count("\n")) == (2, 1), errors
    assert not (tmp_path / "robot.db").exists() or not list(read_stored_trials(tmp_path / "robot.db"))


@pytest.fixture
def database(tmp_path):
    for seed in (0, 1):
        run_test(PLAN, seed, tmp_path / "robot.db")
    return tmp_path / "robot.db"


def change_rows(path, *statements):
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        for statement in statements:
            connection.execute(statement)


BAD_ROWS = {
    "verdict": "UPDATE trials SET verdict = 'perhaps' WHERE id = 3",
    "steps gone": "DELETE FROM steps WHERE trial = 3",
    "truth": "UPDATE steps SET truth = '[1' WHERE trial = 3 AND number = 1",
    "no text": "UPDATE steps SET purpose = CAST(x'ff' AS TEXT) WHERE trial = 3",
    "bytes": "UPDATE trials SET matched = x'00' WHERE id = 3",
    "a symbol too large": "UPDATE steps SET observed = '[3, 99]' WHERE trial = 3 AND number = 0",
}


@pytest.mark.parametrize("statement", BAD_ROWS.values(), ids=BAD_ROWS)
def test_a_bad_trial_of_a_test_is_taken_out_with_those_after_it_and_the_test_goes_on(database, run, statement):
    before = [list(test.trials) for test in recorded_tests(database)]
    change_rows(database, statement)
    assert faults_of_database(database)
    with pytest.raises(InvalidInputError):
        read_report(database)
    status, output, _ = run("memory", "repair", database)
    assert status == 0
    assert "trial 3" in output
    assert faults_of_database(database) == []
    assert repair_database(database) == []
    tests = recorded_tests(database)
    assert [list(test.trials) for test in tests] == [before[0][:2], before[1]]
    (record,) = [each for each in read_stored_experiments(database) if each.kind == REPAIR_KIND]
    assert [entry["trial"][0] for entry in record.parameters["removed"]] == ["3", "4", "5", "6"]
    assert len(read_report(database).trials) == 8
    for seed in (0, 1):
        run_test(PLAN, seed, database, resume=True)
    assert [list(test.trials) for test in recorded_tests(database)] == before


def test_an_experiment_that_says_nothing_sound_is_taken_out_with_its_trials(database):
    change_rows(database, "UPDATE experiments SET parameters = '{' WHERE id = 1")
    assert len(repair_database(database)) == 1
    assert faults_of_database(database) == []
    assert [test.header["seed"] for test in recorded_tests(database)] == [1]


def test_a_bad_trial_that_belongs_to_no_test_is_taken_out_alone(database):
    change_rows(
        database, "UPDATE experiments SET kind = 'trial'", "UPDATE trials SET verdict = 'perhaps' WHERE number = 2"
    )
    assert len(repair_database(database)) == 2
    assert faults_of_database(database) == []
    assert [trial.number for trial in read_stored_trials(database, 1)] == [0, 1, 2, 3, 4]
