import math

import networkx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.goals import Goal
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.experiments.exploration import complete_memory
from atg_fg.inference.known_transitions import transition_graph, transitions_of_graph, transitions_of_hypothesis
from atg_fg.inference.recognition_model import RecognitionModel
from atg_fg.policies.shortest_paths import (
    action_costs,
    exploration_costs,
    goal_aspects,
    nearest_aspect,
    reachable_aspects,
    shortest_path,
)
from atg_fg.worlds.arcube import make_arcubes

ALPHABET = PatternAlphabet(("front", "top"), 4)
ASSUMPTIONS = Assumptions(10, 6, ("turn", "push"), ALPHABET)
TURN, PUSH = 0, 1
#: In the order in which aspects are added below.
PATTERNS = [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)]


def graph_of(*edges, n_aspects=5):
    """An ATG with (source, action, target, count)."""
    graph = AspectTransitionGraph("thing", ASSUMPTIONS)
    for pattern in PATTERNS[:n_aspects]:
        graph.add_aspect(pattern)
    for edge in edges:
        graph.add_transition(*edge)
    return graph


def path(graph, source, wanted, cost="attempts"):
    return shortest_path(transitions_of_graph(graph), source, Goal(ALPHABET, wanted), cost)


def test_the_shortest_of_two_ways_is_taken():
    graph = graph_of((0, TURN, 1, 1), (1, TURN, 2, 1), (2, TURN, 3, 1), (0, PUSH, 2, 1))
    found = path(graph, 0, PATTERNS[3])
    assert found.aspects == (0, 2, 3)
    assert found.actions == (PUSH, TURN)
    assert (found.cost, found.probability) == (2.0, 1.0)


def test_a_reliable_way_wins_over_a_short_one_that_often_fails():
    """Pushing works one time in four, so four attempts; turning twice always does."""
    graph = graph_of((0, TURN, 1, 5), (1, TURN, 2, 5), (0, PUSH, 2, 1), (0, PUSH, 0, 3))
    found = path(graph, 0, PATTERNS[2])
    assert found.actions == (TURN, TURN)
    assert found.cost == 2.0
    assert path(graph, 0, PATTERNS[2], "surprise").actions == (TURN, TURN)


def test_a_short_way_that_sometimes_fails_wins_where_the_other_is_longer_than_its_attempts():
    """Three attempts in four work: 4/3 attempts are less than 2 actions, but the surprise ln 4/3 is more than none."""
    graph = graph_of((0, TURN, 1, 5), (1, TURN, 2, 5), (0, PUSH, 2, 3), (0, PUSH, 0, 1))
    assert path(graph, 0, PATTERNS[2]).actions == (PUSH,)
    assert path(graph, 0, PATTERNS[2]).cost == pytest.approx(4 / 3, abs=1e-12)
    assert path(graph, 0, PATTERNS[2], "surprise").actions == (TURN, TURN)


def test_of_paths_without_surprise_the_shorter_is_taken():
    graph = graph_of((0, TURN, 1, 1), (1, TURN, 2, 1), (0, PUSH, 2, 1))
    assert path(graph, 0, PATTERNS[2], "surprise").actions == (PUSH,)


def test_surprise_is_minus_the_logarithm_of_the_probability():
    graph = graph_of((0, TURN, 1, 3), (0, TURN, 0, 1), (1, TURN, 2, 1), (1, TURN, 0, 1))
    found = path(graph, 0, PATTERNS[2], "surprise")
    assert found.probability == pytest.approx(3 / 8)
    assert found.cost == pytest.approx(math.log(8 / 3), abs=1e-8)


def test_being_there_already_takes_no_action():
    assert path(graph_of(), 2, PATTERNS[2]) == ((2,), (), 0.0, 1.0)


def test_a_goal_against_the_arrows_is_out_of_reach():
    graph = graph_of((0, TURN, 1, 1), (1, TURN, 2, 1))
    assert path(graph, 2, PATTERNS[0]) is None
    assert reachable_aspects(transitions_of_graph(graph), 1) == {1, 2}
    assert reachable_aspects(transitions_of_graph(graph), 3) == {3}


def test_a_goal_never_seen_is_out_of_reach():
    assert path(graph_of((0, TURN, 1, 1)), 0, (3, 1)) is None


def test_a_partial_goal_is_reached_at_the_nearest_aspect_that_shows_it():
    """Both 0 and 4 show tag 0 in front; from 1, aspect 4 is nearer."""
    graph = graph_of((1, TURN, 2, 1), (2, TURN, 0, 1), (1, PUSH, 4, 1))
    assert goal_aspects(transitions_of_graph(graph), Goal(ALPHABET, (0, None))) == [0, 4]
    assert path(graph, 1, (0, None)).aspects == (1, 4)


def test_the_nearest_aspect_is_the_most_like_the_goal_then_the_cheapest():
    graph = graph_of((0, TURN, 1, 1), (1, TURN, 2, 1), (2, TURN, 3, 1))
    transitions = transitions_of_graph(graph)
    assert nearest_aspect(transitions, 0, Goal(ALPHABET, (3, 2))).aspects == (0, 1)  # top 2
    assert nearest_aspect(transitions, 0, Goal(ALPHABET, (3, None))).aspects == (0, 1, 2, 3)
    assert nearest_aspect(transitions, 3, Goal(ALPHABET, (0, 1))).aspects == (3,)


def test_costs_of_first_actions_are_their_edge_and_the_way_from_there():
    transitions = transitions_of_graph(graph_of((0, TURN, 1, 1), (1, TURN, 2, 1), (0, PUSH, 0, 1), (0, PUSH, 2, 1)))
    costs = action_costs(transitions, [2], 2, "attempts")
    assert costs[0].tolist() == [2.0, 2.0]
    assert costs[1].tolist() == [1.0, np.inf]
    assert np.isinf(costs[2]).all()
    assert all(np.isinf(row).all() for row in action_costs(transitions, [], 2, "attempts").values())


def test_exploring_goes_to_the_nearest_aspect_with_an_action_never_tried():
    transitions = transitions_of_graph(
        graph_of((0, TURN, 1, 1), (0, PUSH, 0, 1), (1, TURN, 2, 1), (1, PUSH, 0, 1), n_aspects=3)
    )
    costs = exploration_costs(transitions, 2, "attempts")
    assert costs[0].tolist() == [3.0, 4.0]
    assert costs[1].tolist() == [2.0, 4.0]
    assert costs[2].tolist() == [1.0, 1.0]


def test_where_everything_was_tried_exploring_leads_nowhere():
    transitions = transitions_of_graph(graph_of((0, TURN, 0, 1), (0, PUSH, 0, 1), n_aspects=1))
    assert np.isinf(exploration_costs(transitions, 2, "attempts")[0]).all()


def test_edges_carry_the_models_transition_probabilities():
    graph = graph_of((0, TURN, 1, 3), (0, TURN, 0, 1))
    edges = transitions_of_graph(graph, concentration=0.5).edges
    assert edges[0, 1, TURN]["probability"] == pytest.approx((3 + 0.5 / 6) / 4.5)
    model = RecognitionModel(RobotMemory(ASSUMPTIONS, [graph]), ModelParameters(transition_concentration=0.5))
    of_model = transitions_of_hypothesis(model, 0)
    for source, target, data in of_model.edges(data=True):
        assert data["probability"] == pytest.approx(model.transition(data["action"])[0, source, target], abs=1e-15)
    assert [of_model.nodes[state]["pattern"] for state in of_model] == list(graph.pattern_indices)


def test_a_complete_cube_is_crossed_in_as_few_actions_as_the_true_graph_needs():
    assumptions = arcube_assumptions()
    graph = next(iter(complete_memory(assumptions, make_arcubes(1, seed=0))))
    transitions = transitions_of_graph(graph)
    lengths = dict(networkx.all_pairs_shortest_path_length(networkx.DiGraph(transitions)))
    for source in range(24):
        for target, pattern in enumerate(graph.aspects):
            found = shortest_path(transitions, source, Goal(assumptions.alphabet, pattern))
            assert len(found.actions) == lengths[source][target]


EDGES = st.lists(st.tuples(st.integers(0, 4), st.integers(0, 1), st.integers(0, 4), st.integers(1, 4)), max_size=12)


@given(EDGES, st.integers(0, 4), st.integers(0, 4))
def test_following_a_path_leads_to_its_goal_and_no_other_path_is_cheaper(edges, source, target):
    graph = graph_of(*edges)
    transitions = transitions_of_graph(graph)
    found = path(graph, source, PATTERNS[target])
    prices = {(a, b, k): 1 / data["probability"] for a, b, k, data in transitions.edges(keys=True, data=True)}
    simple = networkx.all_simple_edge_paths(transitions, source, target) if source != target else [[]]
    costs = [sum(prices[edge] for edge in way) for way in simple]
    if found is None:
        assert not costs
        return
    assert found.aspects[0] == source
    assert found.aspects[-1] == target
    for here, action, there in zip(found.aspects, found.actions, found.aspects[1:], strict=False):
        assert (here, action, there) in graph.counts
    assert found.cost == pytest.approx(min(costs), abs=1e-9)


def test_bad_input_is_named():
    transitions = transition_graph({0: 3}, {}, 0.0, 6)
    with pytest.raises(InvalidInputError, match=r"aspect: 7; expected one of \[0\]"):
        shortest_path(transitions, 7, Goal(ALPHABET, (0, 1)))
    with pytest.raises(UnknownNameError, match="'time'; expected one of: attempts, surprise"):
        shortest_path(transitions, 0, Goal(ALPHABET, (0, 1)), cost="time")
