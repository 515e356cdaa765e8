import json

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from sim.noise_calibration import Counts, calibrate, read_counts
from sim.reliability import Fit, Look, Run, ScoredAction, run_actions, summarise


def scored(name="flip", **info):
    usual = {
        "right": True,
        "slipped": False,
        "lost": False,
        "orientation": 4,
        "expected_orientation": 4,
        "angle_error": 1.0,
        "position_error": 0.002,
        "peak_force": 90.0,
        "squarings": 0,
        "simulated_seconds": 6.0,
    }
    return ScoredAction(name, usual | info)


def a_run(actions, looks):
    shares = np.full((2, 7), 0.5)
    return Run(shares, shares, actions, looks, saturated_steps=3, self_contacts=0, steps=1000, wall_seconds=2.0)


STAYED = {"right": False, "slipped": True, "orientation": 1, "angle_error": 90.0}
ELSEWHERE = {"right": False, "orientation": 7, "angle_error": 88.0}
LOST = {"right": False, "lost": True, "orientation": 7}
RUNS = [
    a_run(
        [scored(), scored(**STAYED), scored("left"), scored("left", **ELSEWHERE)],
        [
            Look((3, 4), (3, 4)),
            Look((3, -1), (3, 4)),
            Look((-1, -1), (3, 4)),
            Look((5, 4), (3, 4)),
            Look((1, 2), (1, 2)),
        ],
    ),
    a_run([scored("right", **LOST)], [Look((1, 2), (1, 2))]),
]


def test_rates_are_counted_by_action_with_their_intervals():
    summary = summarise(RUNS)
    assert (summary["success"]["count"], summary["success"]["of"], summary["success"]["rate"]) == (2, 5, 0.4)
    low, high = summary["success"]["interval95"]
    assert 0.1 < low < 0.4 < high < 0.8
    assert {name: (rate["count"], rate["of"]) for name, rate in summary["by_action"].items()} == {
        "flip": (1, 2),
        "left": (1, 2),
        "right": (0, 1),
    }
    assert summary["failures"] == {"stayed": 1, "lost": 1, "another_orientation": 1}


def test_detections_are_counted_by_how_many_tags_and_whether_they_were_there():
    counts = {name: rate["count"] for name, rate in summarise(RUNS)["detection"].items()}
    assert counts == {"both": 4, "one": 1, "none": 1, "wrong_ids": 1}


def test_errors_are_those_of_the_actions_that_came_out_right():
    summary = summarise(RUNS)
    assert summary["angle_error_degrees"]["max"] == 1.0
    assert summary["joints"]["share_of_steps_at_effort_limit"] == pytest.approx(0.003)
    assert summary["timing"] == {"wall_seconds_per_action": 0.8, "steps_per_wall_second": 500.0}


def test_a_summary_is_json():
    assert json.loads(json.dumps(summarise(RUNS), allow_nan=False)) == summarise(RUNS)


def test_boxes_without_tags_are_counted_by_how_well_they_were_found_and_weighed():
    run = a_run([scored(), scored("left")], [])
    run.fits = [Fit(None, None, None), Fit(0.001, 0.2, 0.1), Fit(0.003, 0.4, -0.1)]
    summary = summarise([run])
    assert "detection" not in summary
    boxes = summary["boxes"]
    assert (boxes["found"]["count"], boxes["found"]["of"]) == (2, 3)
    assert boxes["position_error_metres"]["mean"] == pytest.approx(0.002)
    assert boxes["yaw_error_degrees"]["max"] == 0.4
    assert (boxes["weighed"], boxes["mass_error_kilograms"]) == (2, {"mean": 0.0, "deviation": pytest.approx(0.1)})
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary


def test_boxes_stand_on_one_table():
    with pytest.raises(InvalidInputError, match="stations: 3; expected 1 for boxes with pictures"):
        run_actions("nominal", 1, n_stations=3, pictures=True)


@pytest.mark.slow
def test_boxes_with_pictures_are_turned_as_reliably_as_cubes():
    (run,) = run_actions("nominal", 4, seed=1, pictures=True)
    summary = summarise([run])
    assert (summary["success"]["count"], summary["boxes"]["found"]["count"]) == (4, 5)
    assert summary["boxes"]["position_error_metres"]["max"] < 0.006


def test_an_action_without_a_try_has_no_rate():
    flips = summarise([a_run([scored()], [Look((1, 2), (1, 2))])])
    assert flips["by_action"]["left"] == {"count": 0, "of": 0, "rate": None, "interval95": None}


def test_calibration_counts_what_reliability_wrote(tmp_path):
    for name in ("a.json", "b.json"):
        (tmp_path / name).write_text(json.dumps(summarise(RUNS)))
    once = Counts(actions=4, failed=2, looks=6, wrong=1, missing=3)
    assert read_counts([tmp_path / "a.json"]) == once
    assert read_counts([tmp_path / "a.json", tmp_path / "b.json"]) == Counts(8, 4, 12, 2, 6)


def test_calibration_by_hand():
    parameters, missing_rate = calibrate(Counts(actions=99, failed=4, looks=999, wrong=0, missing=100))
    # f = 4.5/100, so α = 0.045/0.955; e = 0.5/1000 of the 131 other patterns of 132.
    assert parameters.transition_concentration == pytest.approx(0.045 / 0.955)
    assert parameters.observation_noise == pytest.approx(0.0005 * 132 / 131)
    assert parameters.learn_in_trial
    assert missing_rate == pytest.approx(100.5 / 1999)


@pytest.mark.parametrize("text", ["{}", "[]", "nonsense", '{"failures": {}, "detection": {}, "success": {"of": 3}}'])
def test_what_is_no_reliability_run_is_refused_by_name(tmp_path, text):
    file = tmp_path / "other.json"
    file.write_text(text)
    with pytest.raises(InvalidInputError, match=r"other\.json"):
        read_counts([file])


@pytest.mark.slow
def test_a_run_is_the_same_for_any_number_of_processes():
    one, two = (run_actions("nominal", 3, seed=1, jobs=jobs) for jobs in (1, 2))
    assert [run.actions for run in one] == [run.actions for run in two]
    assert [run.looks for run in one] == [run.looks for run in two]
    assert [len(run.actions) for run in one] == [3]
    assert len(one[0].looks) == 4
    assert summarise(one)["success"]["rate"] == 1
    assert summarise(one)["detection"]["both"]["rate"] == 1


@pytest.mark.parametrize(
    ("arguments", "error"),
    [(("new", 10), UnknownNameError), (("nominal", 0), InvalidInputError), (("nominal", 1, 0, 0), InvalidInputError)],
)
def test_bad_arguments_are_refused(arguments, error):
    with pytest.raises(error):
        run_actions(*arguments)


@pytest.mark.slow
def test_a_hundred_nominal_actions_are_right():
    summary = summarise(run_actions("nominal", 100, seed=0, jobs=2))
    assert summary["success"]["count"] >= 99
    assert summary["angle_error_degrees"]["mean"] < 1.5
    assert summary["detection"]["wrong_ids"]["count"] == 0
    assert summary["detection"]["both"]["rate"] >= 0.97
    assert summary["joints"]["self_contacts"] == 0
    assert summary["joints"]["largest_share_of_effort_limit"] <= 1


def test_where_there_are_several_cubes_each_is_looked_at_before_the_action():
    (run,) = run_actions("nominal", 2, seed=1, n_stations=2)
    assert len(run.looks) == 5
    assert {action.info["station"] for action in run.actions} <= {0, 1}
    assert summarise([run])["success"]["rate"] == 1
