from contextlib import closing

import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.goals import Goal
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import begin_trial
from atg_fg.experiments.exploration import complete_memory
from atg_fg.experiments.goal_scores import fewest_actions
from atg_fg.experiments.trial import run_trial
from atg_fg.inference.known_transitions import transitions_of_hypothesis
from atg_fg.inference.recognition_model import RecognitionModel
from atg_fg.policies.goal import HORIZON, PLANNERS, GoalPolicy, action_values
from atg_fg.policies.shortest_paths import action_costs, goal_aspects
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import ORIENTATIONS, SUCCESSORS, make_arcubes, shown_pattern
from atg_fg.worlds.arcube_world import ARcubeWorld
from tests.small import EXACT_ENGINES, each_of

ASSUMPTIONS = arcube_assumptions()
CUBES = make_arcubes(6, seed=0)
MEMORY = complete_memory(ASSUMPTIONS, CUBES)


def goal_of(cube, orientation):
    return Goal(ASSUMPTIONS.alphabet, shown_pattern(CUBES[cube], orientation))


def served(policy, memory=MEMORY, seed=0, engine="bayes-filter", parameters=None, start=None, n_actions=40, **noise):
    with closing(ARcubeWorld(CUBES, **noise)) as world:
        inference = begin_trial(engine, memory, parameters or preset("default"))
        rng = np.random.default_rng(seed)
        return run_trial(world, inference, policy, n_actions, rng, reset_options=start or {"object": 2})


def purposes(record):
    return [step.purpose for step in record.steps]


@each_of(name for name in EXACT_ENGINES if name != "enumeration")
def test_it_recognises_then_takes_the_shortest_way_and_stops(engine):
    record = served(GoalPolicy(goal_of(2, 9)), engine=engine)
    order = purposes(record)
    assert order[-1] == "reached"
    assert record.steps[-1].detection == goal_of(2, 9).symbols
    decided = order.index("approach")
    assert set(order[:decided]) == {"recognise"}
    assert set(order[decided:-1]) == {"approach"}
    start = record.steps[decided].truth["orientation"]
    assert len(order) - 1 - decided == fewest_actions(CUBES[2], start, goal_of(2, 9))


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("seed", range(5))
def test_with_all_known_every_planner_takes_as_few_actions_as_can_be(planner, seed):
    record = served(GoalPolicy(goal_of(2, 3 * seed), planner), seed=seed)
    order = purposes(record)
    assert order[-1] == "reached"
    decided = order.index("approach") if "approach" in order else len(order) - 1
    start = record.steps[decided].truth["orientation"]
    assert order.count("approach") == fewest_actions(CUBES[2], start, goal_of(2, 3 * seed))


def test_a_slip_is_planned_anew_from_where_the_object_really_is():
    slips = 0
    for seed in range(16):
        record = served(GoalPolicy(goal_of(2, 17)), seed=seed, parameters=ModelParameters(2.0, 1e-3), slip=0.25)
        assert record.steps[-1].purpose == "reached"
        assert tuple(record.steps[-1].truth["pattern"]) == goal_of(2, 17).symbols
        slips += sum(
            bool(after.truth["slipped"])
            for before, after in zip(record.steps, record.steps[1:], strict=False)
            if before.purpose == "approach"
        )
    assert slips >= 3


def test_part_of_a_pattern_is_a_goal():
    wanted = Goal.of_slots(ASSUMPTIONS.alphabet, {"front": shown_pattern(CUBES[2], 4)[0]})
    record = served(GoalPolicy(wanted))
    assert record.steps[-1].purpose == "reached"
    assert record.steps[-1].detection[0] == wanted.symbols[0]


def test_what_is_shown_at_the_first_look_needs_no_action():
    record = served(GoalPolicy(goal_of(2, 5)), start={"object": 2, "orientation": 5})
    assert purposes(record) == ["reached"]


def test_a_goal_that_the_object_cannot_show_is_declared_out_of_reach():
    tag = next(tag for tag in range(12) if tag not in CUBES[2])
    record = served(GoalPolicy(Goal.of_slots(ASSUMPTIONS.alphabet, {"front": tag})))
    assert purposes(record)[-1] == "unreachable"


def one_way_memory():
    """The first cube, of which the robot knows four flips, and whatever else it has not tried."""
    graph = AspectTransitionGraph("flipped", ASSUMPTIONS)
    orientation, shown = 0, []
    for _ in range(4):
        shown.append(ASSUMPTIONS.alphabet.index(shown_pattern(CUBES[0], orientation)))
        orientation = SUCCESSORS[orientation][0]
    graph.learn([*shown, shown[0]], [0, 0, 0, 0])
    return RobotMemory(ASSUMPTIONS, [graph])


def hidden_orientation():
    """An orientation that flips of the upright cube do not lead to."""
    flipped, orientation = set(), 0
    for _ in range(4):
        flipped.add(orientation)
        orientation = SUCCESSORS[orientation][0]
    return next(each for each in range(len(ORIENTATIONS)) if each not in flipped)


@pytest.mark.parametrize(("unreachable", "endings"), [("declare", {"unreachable"}), ("explore", {"reached"})])
def test_a_goal_without_a_known_path_is_declared_or_explored_for(unreachable, endings):
    """Settled at once, since the prior leaves no doubt: this is about the way alone."""
    wanted = Goal(ASSUMPTIONS.alphabet, shown_pattern(CUBES[0], hidden_orientation()))
    policy = GoalPolicy(wanted, unreachable=unreachable, entropy_threshold=5.0)
    record = served(policy, one_way_memory(), start={"object": 0, "orientation": 0}, n_actions=200)
    assert record.steps[-1].purpose in endings
    assert ("explore" in purposes(record)) == (unreachable == "explore")
    assert "recognise" not in purposes(record)


def test_when_belief_falls_apart_it_recognises_again():
    """The cube is exchanged behind the robot's back, on its way to a goal."""
    policy, rng = GoalPolicy(goal_of(2, 9)), np.random.default_rng(0)
    inference = begin_trial("bayes-filter", MEMORY, ModelParameters(0.01, 0.01))

    def look(cube, orientation):
        inference.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, shown_pattern(CUBES[cube], orientation)))
        return policy.choose(inference, rng)

    orientation, choice = 0, look(2, 0)
    while choice.purpose == "recognise":
        inference.act(choice.action)
        orientation = SUCCESSORS[orientation][choice.action]
        choice = look(2, orientation)
    assert choice.purpose == "approach"
    purposes = []
    for _ in range(2):
        inference.act(choice.action)
        orientation = SUCCESSORS[orientation][choice.action]
        choice = look(4, orientation)
        purposes.append(choice.purpose)
    assert "recognise" in purposes


def test_a_look_that_may_be_wrong_is_not_trusted_to_show_the_goal():
    """One look in ten shows anything; a single one of an unknown object is more probably right than the goal sure."""
    inference = begin_trial("bayes-filter", MEMORY, ModelParameters(1e-8, 0.1))
    inference.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, goal_of(2, 9).symbols))
    assert 0.5 < inference.shown_patterns()[goal_of(2, 9).patterns].sum() < 0.95
    assert not GoalPolicy(goal_of(2, 9)).is_reached(inference)


def test_bad_options_are_refused():
    with pytest.raises(UnknownNameError, match=r"planner.*attempts, surprise, value-iteration"):
        GoalPolicy(goal_of(0, 0), "fastest")
    with pytest.raises(UnknownNameError, match="'give up'"):
        GoalPolicy(goal_of(0, 0), unreachable="give up")
    with pytest.raises(InvalidInputError, match="entropy_threshold: 0; expected"):
        GoalPolicy(goal_of(0, 0), entropy_threshold=0)
    with pytest.raises(InvalidInputError, match=r"confidence: 1\.0; expected"):
        GoalPolicy(goal_of(0, 0), confidence=1.0)


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
