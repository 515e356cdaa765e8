import gzip
import json

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.parameters import ModelParameters
from atg_fg.experiments.goal_scores import summarise
from atg_fg.experiments.goals import COMPLETE, GoalPlan, run_goals, run_many, run_seed

SMALL = GoalPlan(engine="bayes-filter", n_remembered=6, n_objects=12, learning_actions=8, n_actions=20)
COMPLETE_PLAN = GoalPlan(engine="bayes-filter", learning_actions=COMPLETE)


def test_with_a_complete_memory_all_goals_are_reached_the_shortest_way():
    summary = summarise(list(run_many(COMPLETE_PLAN, seed=0, n_runs=8)))
    for rate in ("reached", "reached_of_reachable", "optimal"):
        assert summary[rate]["count"] == summary[rate]["of"] == 24
    assert summary["wrong_success"]["count"] == summary["wrong_object"]["count"] == 0


def test_with_a_partial_memory_what_has_a_path_is_reached_and_the_rest_declared():
    plan = GoalPlan(engine="bayes-filter")
    summary = summarise(list(run_many(plan, seed=0, n_runs=3)))
    assert summary["reached_of_reachable"]["rate"] >= 0.9
    assert summary["declared_of_unreachable"]["count"] == summary["declared_of_unreachable"]["of"] > 0
    assert summary["wrong_success"]["count"] == 0


def test_objects_are_different_and_goals_are_patterns_of_theirs():
    run = run_goals(SMALL, run_seed(0, 3))
    assert len({served.object for served in run.served}) == 3
    for served, record in zip(run.served, run.records, strict=True):
        assert record.steps[0].truth["object"] == served.object
        assert record.steps[0].truth["station"] == run.served.index(served)


def test_what_was_recognised_is_ruled_out_at_the_next_station():
    run = run_goals(COMPLETE_PLAN, run_seed(0, 0))
    first, second = run.served[0].object, run.records[1]
    assert all(step.belief.objects[first] < 1e-3 for step in second.steps)


def test_engines_agree_on_what_is_done():
    plans = [
        GoalPlan(engine=engine, n_remembered=4, n_stations=2, learning_actions=6)
        for engine in ("gtsam", "bayes-filter")
    ]
    first, second = (run_goals(plan, run_seed(1, 0)) for plan in plans)
    assert first.served == second.served


@pytest.mark.parametrize("executor", ["thread", pytest.param("process", marks=pytest.mark.slow)])
def test_any_number_of_jobs_gives_the_same_and_another_seed_another(executor):
    serial = list(run_many(SMALL, seed=0, n_runs=3))
    assert list(run_many(SMALL, seed=0, n_runs=3, jobs=2, executor=executor)) == serial
    assert list(run_many(SMALL, seed=1, n_runs=3)) != serial


def test_runs_are_saved_and_not_run_again(tmp_path):
    whole = list(run_many(SMALL, seed=0, n_runs=2, records=tmp_path / "a"))
    list(run_many(SMALL, seed=0, n_runs=1, records=tmp_path / "b"))
    assert list(run_many(SMALL, seed=0, n_runs=2, records=tmp_path / "b", resume=True)) == whole
    for name in ("run-0000.json.gz", "run-0001.json.gz"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    document = json.loads(gzip.decompress((tmp_path / "a" / "run-0001.json.gz").read_bytes()))
    trial = document["served"][0]["trial"]
    assert len(trial["observed"]) == len(trial["actions"]) + 1 == len(trial["purpose"])


def test_records_of_another_experiment_are_refused(tmp_path):
    list(run_many(SMALL, seed=0, n_runs=1, records=tmp_path))
    with pytest.raises(InvalidInputError, match=r"run-0000.*already there.*--resume"):
        list(run_many(SMALL, seed=0, n_runs=1, records=tmp_path))
    with pytest.raises(InvalidInputError, match=r'run-0000.*"seed": 0.*expected.*"seed": 1'):
        list(run_many(SMALL, seed=1, n_runs=1, records=tmp_path, resume=True))


@pytest.mark.parametrize("content", [b"", b"not gzip", gzip.compress(b"[1]", mtime=0), gzip.compress(b"{", mtime=0)])
def test_other_files_are_refused_by_name(tmp_path, content):
    (tmp_path / "run-0000.json.gz").write_bytes(content)
    with pytest.raises(InvalidInputError, match=r"run-0000.*cannot be read.*expected a run"):
        list(run_many(SMALL, seed=0, n_runs=1, records=tmp_path, resume=True))


def test_without_learning_in_the_trial_it_works_too():
    plan = GoalPlan(engine="bayes-filter", parameters=ModelParameters(learn_in_trial=False), learning_actions=COMPLETE)
    assert all(served.ending == "reached" for served in run_goals(plan, run_seed(0, 0)).served)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"n_stations": 0}, "n_stations: 0; expected a whole number from 1 to 100000"),
        ({"n_stations": 21}, "n_stations: 21; expected at most n_remembered = 20"),
        ({"n_remembered": 101}, "n_remembered: 101; expected at most n_objects = 100"),
        ({"learning_actions": -1}, "learning_actions: -1"),
    ],
)
def test_plans_that_cannot_be_are_refused(wrong, message):
    with pytest.raises(InvalidInputError, match=message):
        GoalPlan(**wrong)


@pytest.mark.parametrize("name", ["engine", "planner", "learning_policy", "unreachable"])
def test_names_are_checked_before_any_work(name):
    with pytest.raises(UnknownNameError, match="'nonsense'"):
        GoalPlan(**{name: "nonsense"})


def test_run_seeds_are_those_that_the_seed_spawns():
    spawned = np.random.SeedSequence(5).spawn(3)[2]
    assert run_seed(5, 2).generate_state(4).tolist() == spawned.generate_state(4).tolist()
