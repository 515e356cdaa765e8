import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.goals import Goal
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.experiments.exploration import complete_memory
from atg_fg.inference.known_transitions import transitions_of_hypothesis
from atg_fg.inference.recognition_model import RecognitionModel
from atg_fg.policies.shortest_paths import action_costs, goal_aspects
from atg_fg.policies.value_iteration import HORIZON, action_values
from atg_fg.worlds.arcube import make_arcubes, shown_pattern

ALPHABET = PatternAlphabet(("side",), 3)
SURE = ModelParameters(transition_concentration=0.0, observation_noise=0.0)


def model_of(*edges, n_aspects=2, patterns=((0,), (1,))):
    graph = AspectTransitionGraph("coin", Assumptions(2, n_aspects, ("turn",), ALPHABET))
    for pattern in patterns:
        graph.add_aspect(pattern)
    for edge in edges:
        graph.add_transition(*edge)
    return RecognitionModel(RobotMemory(graph.assumptions, [graph]), SURE)


def test_an_action_that_works_one_time_in_four_takes_four_attempts():
    model = model_of((0, 0, 1, 1), (0, 0, 0, 3))
    assert action_values(model, Goal(ALPHABET, (1,)))[0, 0, 1] == pytest.approx(4.0, abs=1e-6)


def test_an_action_never_tried_leads_anywhere():
    """Of two aspects half of the attempts lead to each: V = 1 + V / 2."""
    assert action_values(model_of(), Goal(ALPHABET, (1,)))[0, 0, 1] == pytest.approx(2.0, abs=1e-6)


def test_the_collection_node_may_show_the_goal():
    """A third aspect is not known: it shows the one pattern left, so 1 + V·2/3 = V."""
    model = model_of(n_aspects=3)
    assert action_values(model, Goal(ALPHABET, (2,)))[0, 0, 1] == pytest.approx(3.0, abs=1e-6)


def test_what_cannot_be_reached_costs_the_horizon():
    model = model_of((0, 0, 0, 1))
    assert action_values(model, Goal(ALPHABET, (1,)))[0, 0, 1] == HORIZON + 1
    assert action_values(model, Goal(ALPHABET, (1,)), horizon=7)[0, 0, 1] == 8


@pytest.mark.parametrize("seed", range(3))
def test_on_a_complete_cube_it_is_the_shortest_path(seed):
    """Every transition is known, so nothing is left to chance, and a first action costs what the path costs."""
    assumptions = arcube_assumptions()
    (cube,) = make_arcubes(1, seed)
    model = RecognitionModel(complete_memory(assumptions, [cube]), ModelParameters())
    goal = Goal(assumptions.alphabet, shown_pattern(cube, 5))
    values = action_values(model, goal)[:, 0]
    graph = transitions_of_hypothesis(model, 0)
    for state, costs in action_costs(graph, goal_aspects(graph, goal), 3, "attempts").items():
        assert values[:, state] == pytest.approx(costs, abs=1e-5)


def test_an_aspect_that_shows_the_goal_costs_no_further_action():
    values = action_values(model_of((0, 0, 1, 1), (1, 0, 0, 1)), Goal(ALPHABET, (1,)))
    assert values[0, 0, 1] == 1.0
    assert np.array_equal(values[0, 0, 2:], [2.0])
