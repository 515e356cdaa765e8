"""Results of experiments as tables."""

from dataclasses import replace

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.experiments.goal_scores import ServedObject
from atg_fg.experiments.goals import GoalRun
from atg_fg.experiments.result_tables import results_table
from atg_fg.experiments.scores import TestResult
from tests.core.test_table import Reader

TESTS = [
    TestResult(0, (90, 100), (40, 50), (80, 100), lost=1),
    TestResult(1, (100, 100), (0, 0), (100, 100)),
]
POINTS = [
    {"actions": actions, "policy": policy, "success": 0.5, "interval95": [0.25, 0.75]}
    for actions in (4, 8)
    for policy in ("entropy", "<b>")
]
SERVED = ServedObject(3, (1, None), "reached", 3, False, True, True, 2, 4, 3, None)


def lines(results, **options):
    return str(results_table(results, **options)).splitlines()


def test_tests_are_rows_with_their_average_and_the_interval_over_all_trials():
    title, _, first, second, average, interval, note = lines(TESTS)
    assert title == "2 tests"
    assert first.split() == ["0", "90/100", "40/50", "80/100"]
    assert second.split() == ["1", "100/100", "0/0", "100/100"]
    assert average.split() == ["average", "95.0", "%", "80.0", "%", "90.0", "%"]
    # Wilson, by hand: 180 of 200.
    assert interval.endswith("85.1–93.4")
    assert note == "1 lost"


def test_one_test_has_no_average_and_shows_itself_in_a_notebook():
    assert not any(line.startswith("average") for line in lines(TESTS[:1]))
    assert Reader(TESTS[0]._repr_html_()).texts[0] == "1 test"
    assert lines(TESTS[0]) == lines(TESTS[:1])


def test_of_what_never_happened_there_is_no_rate():
    assert lines([TESTS[1]])[-1].split() == ["95", "%", "interval", "96.3–100.0", "–", "96.3–100.0"]


def test_named_tests_are_compared():
    table = results_table({"ours": TESTS, "<b>": TESTS[1:]}, title="Models")
    assert lines({"ours": TESTS})[2].split()[:5] == ["ours", "2", "95.0", "%", "(91.0–97.3)"]
    assert {"Models", "<b>"} <= set(Reader(table._repr_html_()).texts)
    assert [bar.share for bar in table.rows[0][2:]] == pytest.approx([0.95, 0.8, 0.9])


def test_points_of_figure_3_are_a_row_an_action_and_a_column_a_policy():
    title, headings, four, eight, _ = lines(POINTS)
    assert headings.split() == ["actions", "entropy", "<b>"]
    assert four.split() == ["4", "50.0", "%", "(25.0–75.0)", "50.0", "%", "(25.0–75.0)"]
    assert eight.startswith("8")
    assert title == "Success by actions"


def test_goals_say_what_came_of_them():
    given_up = replace(SERVED, ending="unreachable", matched=None, judged_new=True, goal_actions=0)
    title, _, first, second, note = lines([SERVED, given_up])
    assert title == "2 goals"
    assert first.split() == ["3", "(1,", "any)", "reached", "3", "2", "4", "of", "at", "least", "3"]
    assert second.split()[3:5] == ["unreachable", "new"]
    assert note.startswith("reached 1 of 2 (9.5–90.5 %")
    assert lines([[SERVED], [given_up]]) == lines([SERVED, given_up])


def test_a_goal_and_a_run_show_themselves_in_a_notebook():
    assert "1 goal" in Reader(SERVED._repr_html_()).texts
    assert "2 goals" in Reader(GoalRun((SERVED, SERVED), ())._repr_html_()).texts


@pytest.mark.parametrize("results", [[], {}, 3, ["x"], [TESTS[0], SERVED], {"ours": []}, {"ours": POINTS}, [[]], None])
def test_other_things_are_refused(results):
    with pytest.raises(InvalidInputError, match=r"results: .*expected test results"):
        results_table(results)


def test_a_point_that_lacks_something_is_refused():
    with pytest.raises(InvalidInputError, match=r"points\[0\]: .*expected the key 'policy'"):
        results_table([{"actions": 4}])
