import json

import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.engines import begin_trial
from atg_fg.experiments.goals import GoalPlan, run_many
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import EntropyPolicy
from atg_fg.storage.presets import preset
from atg_fg.storage.trial_log import to_json_lines
from atg_fg.worlds.registry import make_world
from tests.cli.conftest import refused, run

__all__ = ["refused", "run"]  # fixtures of the command line, for the tests of this folder, too

#: What a name could hold to break out of a page.
NASTY = "</script><script>document.title='broken'</script><img src=x onerror=alert(1)>&amp;\"'{{ 7*7 }}\u2028"


@pytest.fixture(scope="session")
def trial():
    """The memory of one object, and the record of a trial with it that the memory recognises."""
    memory = RobotMemory(arcube_assumptions())
    world = make_world("ideal")
    shown = {"reset_options": {"object": 3, "orientation": 0}}
    first = run_trial(
        world,
        begin_trial("bayes-filter", memory, preset("default")),
        EntropyPolicy(),
        8,
        np.random.default_rng(0),
        **shown,
    )
    memory.learn(first.patterns, first.actions, None)
    inference = begin_trial("bayes-filter", memory, preset("default"))
    return memory, run_trial(world, inference, EntropyPolicy(), 4, np.random.default_rng(1), **shown)


@pytest.fixture
def record(trial, tmp_path):
    """The path of a trial's record."""
    path = tmp_path / "trial.jsonl"
    path.write_text(to_json_lines(trial[1], seed=1, preset="default"))
    return path


@pytest.fixture(scope="session")
def test_log(tmp_path_factory):
    """The path of a test of twelve trials."""
    folder = tmp_path_factory.mktemp("log")
    run_test(TestPlan(engine="bayes-filter", n_trials=12, n_actions=6, n_objects=4), 3, folder)
    return folder / "test-0003.jsonl.gz"


@pytest.fixture(scope="session")
def goal_run(tmp_path_factory):
    """The path of a run of the goal experiment."""
    folder = tmp_path_factory.mktemp("goal")
    plan = GoalPlan(engine="bayes-filter", n_stations=2, n_remembered=3)
    list(run_many(plan, 0, 1, 1, folder, False))
    return next(folder.iterdir())


@pytest.fixture
def nasty_record(trial, tmp_path):
    """A record in which names of objects and of the preset hold what could break a page."""
    lines = [json.loads(line) for line in to_json_lines(trial[1], preset=NASTY).splitlines()]
    lines[0]["objects"] = [NASTY]
    lines[-1]["verdict"]["matched"] = NASTY
    lines[1]["purpose"] = NASTY
    path = tmp_path / "nasty.jsonl"
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path
