from contextlib import closing

import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.goals import Goal
from atg_fg.core.memory import RobotMemory
from atg_fg.core.statistics import wilson_interval
from atg_fg.engines import begin_trial
from atg_fg.experiments.exploration import complete_memory
from atg_fg.experiments.goal_scores import ServedObject, fewest_actions, score, summarise
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import GoalPolicy
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern
from atg_fg.worlds.arcube_world import ARcubeWorld

ASSUMPTIONS = arcube_assumptions()
CUBES = make_arcubes(3, seed=0)
FLIP, LEFT = 0, 1


def scored(memory, goal, n_actions=40, seed=0, start=(1, 0)):
    policy = GoalPolicy(goal)
    with closing(ARcubeWorld(CUBES)) as world:
        inference = begin_trial("bayes-filter", memory, preset("default"))
        options = {"object": start[0], "orientation": start[1]}
        record = run_trial(world, inference, policy, n_actions, np.random.default_rng(seed), reset_options=options)
    return score(record, goal, policy.is_reached(inference), memory, CUBES[start[0]])


def goal_of(cube, orientation):
    return Goal(ASSUMPTIONS.alphabet, shown_pattern(CUBES[cube], orientation))


def test_the_fewest_actions_are_counted_on_the_true_graph():
    flipped_twice = SUCCESSORS[SUCCESSORS[0][FLIP]][FLIP]
    assert fewest_actions(CUBES[1], 0, goal_of(1, 0)) == 0
    assert fewest_actions(CUBES[1], 0, goal_of(1, SUCCESSORS[0][LEFT])) == 1
    assert fewest_actions(CUBES[1], 0, goal_of(1, flipped_twice)) == 2
    in_front = Goal.of_slots(ASSUMPTIONS.alphabet, {"front": shown_pattern(CUBES[1], 0)[1]})
    assert fewest_actions(CUBES[1], 0, in_front) == 1  # the top comes to the front by a flip


def test_a_goal_reached_is_scored_by_the_truth():
    served = scored(complete_memory(ASSUMPTIONS, CUBES), goal_of(1, 13))
    assert (served.ending, served.shown, served.reachable) == ("reached", True, True)
    assert (served.object, served.matched, served.wrong_object) == (1, 1, False)
    assert served.goal_actions == served.optimum
    assert served.recognition_actions >= 1


def test_a_goal_that_only_the_memory_lacks_is_unreachable_and_the_nearest_is_named():
    memory = complete_memory(ASSUMPTIONS, CUBES)
    other = complete_memory(ASSUMPTIONS, make_arcubes(3, seed=1))
    unknown = RobotMemory(ASSUMPTIONS, [memory["object-000"], other["object-001"], memory["object-002"]])
    served = scored(unknown, goal_of(1, 13))
    assert (served.ending, served.shown, served.reachable) == ("unreachable", False, False)
    assert served.judged_new
    assert served.wrong_object
    assert served.matched is None
    assert served.nearest in [shown_pattern(CUBES[1], orientation) for orientation in range(24)]


def test_actions_that_run_out_are_no_verdict():
    served = scored(complete_memory(ASSUMPTIONS, CUBES), goal_of(1, 13), n_actions=1)
    assert (served.ending, served.matched, served.wrong_object) == ("exhausted", None, False)


def outcome(ending, shown=True, reachable=True, matched=0, actions=2, optimum=2):
    nearest = (1, 2) if ending == "unreachable" else None
    return ServedObject(0, (1, 2), ending, matched, False, shown, reachable, 1, actions, optimum, nearest)


def test_rates_and_means_are_counted_by_hand():
    runs = [
        [outcome("reached"), outcome("reached", actions=4), outcome("unreachable", shown=False, reachable=False)],
        [
            outcome("exhausted", shown=False),
            outcome("reached", reachable=False),
            outcome("lost", shown=False, matched=1),
        ],
    ]
    summary = summarise(runs)
    counts = {name: (rate["count"], rate["of"]) for name, rate in summary.items() if isinstance(rate, dict)}
    assert counts == {
        "reached": (3, 6),
        "reachable": (4, 6),
        "reached_of_reachable": (2, 4),
        "declared_of_unreachable": (1, 1),
        "runs_with_all_reachable_reached": (1, 2),
        "wrong_success": (0, 3),
        "wrong_object": (1, 6),
        "optimal": (1, 2),
    }
    assert summary["reached"]["interval95"] == list(wilson_interval(3, 6))
    assert (summary["goal_actions"], summary["optimum"], summary["exhausted"], summary["lost"]) == (3.0, 2.0, 1, 1)


def test_a_wrong_success_shows_in_the_summary():
    summary = summarise([[outcome("reached", shown=False)]])
    assert summary["wrong_success"]["count"] == 1
    assert summary["runs_with_all_reachable_reached"]["count"] == 0


@pytest.mark.parametrize("runs", [[], [[]]])
def test_nothing_served_has_no_rate(runs):
    assert summarise(runs)["reached"]["rate"] is None
