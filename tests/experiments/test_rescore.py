import gzip
import json
from dataclasses import replace
from pathlib import Path

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.experiments.rescore import rescore
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.storage.presets import preset
from atg_fg.storage.recorded_test import recorded_tests
from atg_fg.worlds.arcube import ACTION_SOURCES

RECORDED = Path(__file__).parents[2] / "results" / "robonaut"


def rescored(path, engine, parameters):
    (test,) = recorded_tests(path)
    return rescore(test, engine, parameters)


PLAN = TestPlan(engine="bayes-filter", parameters=preset("default"), n_trials=25, n_actions=5)


@pytest.mark.parametrize("world_options", [{}, {"missing": 0.2, "slip": 0.1}], ids=["ideal", "noisy"])
@pytest.mark.parametrize("name", ["paper", "default"])
def test_the_model_that_ran_the_test_scores_as_it_did(tmp_path, name, world_options):
    plan = replace(PLAN, parameters=preset(name), world_options=world_options)
    ran = run_test(plan, 0, tmp_path)
    again = rescored(tmp_path / "test-0000.jsonl.gz", "bayes-filter", preset(name))
    assert (again.identification, again.recognition, again.success) == (
        ran.identification,
        ran.recognition,
        ran.success,
    )


def test_engines_judge_alike(tmp_path):
    run_test(PLAN, 1, tmp_path)
    path = tmp_path / "test-0001.jsonl.gz"
    first, second = (rescored(path, each, preset("default")) for each in ("gtsam", "bayes-filter"))
    assert first == second


@pytest.mark.parametrize("preset_name", ["paper", "default"])
def test_what_the_robot_recorded_gives_the_scores_that_were_reported(preset_name):
    """The test of the robot in ``worn`` has lost and undecided trials, too."""
    reported = json.loads((RECORDED.parent / f"table1_robonaut_worn_{preset_name}.json").read_text())["tests"][0]
    path = RECORDED / f"worn_{preset_name}" / "test-0000.jsonl.gz"
    again = rescored(path, "bayes-filter", preset(preset_name))
    assert list(again.identification) == reported["identification"]
    assert list(again.recognition) == reported["recognition"]
    assert (again.lost, again.undecided) == (reported["lost"], reported["undecided"])


@pytest.mark.slow
def test_learned_structure_is_no_worse_on_the_robots_evidence():
    path = RECORDED / "worn_default" / "test-0000.jsonl.gz"
    default, learned = (
        rescored(path, engine, preset(name)).success[0]
        for engine, name in (("bayes-filter", "default"), ("learned-structure", "learned"))
    )
    assert learned >= default


def test_trials_of_other_objects_are_refused(tmp_path):
    run_test(PLAN, 0, tmp_path)
    path = tmp_path / "test-0000.jsonl.gz"
    lines = [json.loads(line) for line in gzip.decompress(path.read_bytes()).splitlines()]
    lines[3]["actions"][0] = "jump"
    assert "jump" not in ACTION_SOURCES
    path.write_bytes(b"".join(gzip.compress(json.dumps(line).encode() + b"\n", mtime=0) for line in lines))
    with pytest.raises(InvalidInputError, match=r"test-0000.*: trial 2: look 0: action: .jump.; expected one of: flip"):
        rescored(path, "bayes-filter", preset("default"))
