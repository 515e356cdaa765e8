"""Every record that can be written can be reported, rescored, gone on with and imported: worlds, presets, engines."""

import json
from dataclasses import replace

import pytest

from atg_fg.engines import ENGINES
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.report.reading import read_report
from atg_fg.storage.database.checking import faults_of_database
from atg_fg.storage.presets import PRESETS, preset
from atg_fg.storage.recorded_test import recorded_tests
from atg_fg.storage.trial_log import to_line
from atg_fg.worlds.registry import ARCUBE_WORLDS, WORLDS
from tests.cli.conftest import run as run  # a fixture

SIMULATED = ("rendered", "robonaut", "robonaut-picture-box")
#: Worlds and engines that write what others do not: one slot, a tag twice, a bound. The rest of the grid is for CI.
QUICK_WORLDS, QUICK_ENGINES = ("ideal", "detector", "repeated-tags"), ("gtsam", "large-memory")
N_TRIALS = 2


def cases():
    """Yield (world, preset, engine): each world with each preset and an engine, and each engine with each preset."""
    for name, parameters in PRESETS.items():
        able = [each for each in ENGINES if ENGINES[each].knows_structure or not parameters.learn_structure]
        quick = "learned-structure" if parameters.learn_structure else "bayes-filter"
        for world in WORLDS:
            # The simulator needs its extra, and minutes for what an ideal world shows at once: one preset is enough.
            if world not in SIMULATED:
                is_quick = world == "ideal" or (name == "default" and world in QUICK_WORLDS)
                marks = [] if is_quick else [pytest.mark.slow]
                yield pytest.param(world, name, quick, id=f"{world}-{name}-{quick}", marks=marks)
        for engine in able:
            if engine != quick:
                marks = [] if name == "default" and engine in QUICK_ENGINES else [pytest.mark.slow]
                yield pytest.param("ideal", name, engine, id=f"ideal-{name}-{engine}", marks=marks)


def plan_of(world, name, engine):
    return TestPlan(world=world, engine=engine, parameters=preset(name), n_trials=N_TRIALS, n_actions=2, n_objects=100)


@pytest.mark.parametrize(("world", "name", "engine"), list(cases()))
def test_a_test_in_a_log_and_in_a_database(world, name, engine, run, tmp_path):
    plan = plan_of(world, name, engine)
    log, kept = tmp_path / "test-0000.jsonl.gz", tmp_path / "kept.db"
    result = run_test(plan, 0, tmp_path)
    run_test(plan, 0, kept)
    assert run("memory", "import", log, "--into", tmp_path / "imported.db")[0] == 0
    lines = []
    for file in (log, kept, tmp_path / "imported.db"):
        (test,) = recorded_tests(file)
        lines.append([json.loads(json.dumps(to_line(trial))) for trial in test.trials])
        report = read_report(file)
        assert len(report.trials) == N_TRIALS
        assert sum(page.right for page in report.trials) == result.success[0]
        rescored = run("rescore", file, "--preset", "default", "--json", "-")
        assert json.loads(rescored[1])["tests"][0]["success"][1] == N_TRIALS
    assert lines[0] == lines[1] == lines[2]
    for database in (kept, tmp_path / "imported.db"):
        assert faults_of_database(database) == []
    longer = replace(plan, n_trials=N_TRIALS)
    for file in (tmp_path, kept, tmp_path / "imported.db"):
        assert run_test(longer, 0, file, resume=True) == result


@pytest.mark.parametrize(("world", "name", "engine"), list(cases()))
def test_a_trial_in_a_record_and_in_a_database(world, name, engine, run, tmp_path):
    robot, record = tmp_path / "robot.db", tmp_path / "trial.jsonl"
    about = ("--world", world, "--preset", name, "--engine", engine, "--actions", "2")
    for memory in ((), ("--memory", robot)):
        assert run("trial", *about, *memory, "--save-memory", robot, "--record", record)[0] == 0
        assert len(read_report(record).trials[0].looks) == 3
    assert len(read_report(robot).trials) == 2
    assert faults_of_database(robot) == []
    assert run("memory", "import", robot, "--into", tmp_path / "other.db")[0] == 0
    assert len(read_report(tmp_path / "other.db").trials) == 2
    assert run("memory", "merge", robot, tmp_path / "other.db", "-o", tmp_path / "both.db")[0] == 0
    assert read_report(tmp_path / "both.db").trials


@pytest.mark.parametrize("name", PRESETS)
def test_a_run_of_the_goal_experiment(name, run, tmp_path):
    about = ("--preset", name, "--cubes", "2", "--memory-cubes", "2", "--actions", "4", "--trials", "1", "--jobs", "1")
    told = [run("goal", *about, "--records", tmp_path, "--json", "-", *again)[:2] for again in ((), ("--resume",))]
    assert told[0][0] == 0
    assert told[0] == told[1]
    assert len(read_report(tmp_path / "run-0000.json.gz").trials) == 2


@pytest.mark.slow
@pytest.mark.parametrize("world", SIMULATED)
def test_a_test_in_the_simulator(world, run, tmp_path):
    pytest.importorskip("pybullet")
    test_a_test_in_a_log_and_in_a_database(world, "default", "bayes-filter", run, tmp_path)


def test_the_worlds_that_are_simulated_are_all_tried():
    assert set(SIMULATED) == {*ARCUBE_WORLDS, *(name for name in WORLDS if name.startswith("robonaut"))} - {"ideal"}


def test_a_policy_of_ones_own_is_a_label_in_a_report(run, tmp_path, monkeypatch):
    ran = tmp_path / "ran"
    (tmp_path / "mine.py").write_text(
        "from pathlib import Path\n"
        f"Path({str(ran)!r}).write_text('imported')\n"
        "from atg_fg.policies import RandomPolicy\n"
        "class Mine(RandomPolicy):\n    pass\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    about = ("--policy", "mine:Mine", "--engine", "bayes-filter", "--tests", "1", "--trials", "2", "--jobs", "1")
    for records in (tmp_path / "logs", tmp_path / "records.db"):
        assert run("table1", *about, "--executor", "thread", "--records", records)[0] == 0
    assert ran.exists()
    ran.unlink()
    monkeypatch.delitem(__import__("sys").modules, "mine")
    for file in (tmp_path / "logs" / "test-0000.jsonl.gz", tmp_path / "records.db"):
        report = read_report(file)
        assert len(report.trials) == 2
        assert report.parameters["policy"] == "mine:Mine"
        assert run("rescore", file, "--preset", "default")[0] == 0
        assert run("memory", "import", file, "--into", tmp_path / "other.db")[0] == 0
    assert not ran.exists()
