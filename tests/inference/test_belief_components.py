import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.experiments.exploration import complete_memory, learned_memory
from atg_fg.policies import RandomPolicy
from atg_fg.worlds.arcube import make_arcubes, shown_pattern
from tests.small import EXACT_ENGINES, each_of

ASSUMPTIONS = arcube_assumptions()
CUBES = make_arcubes(3, seed=0)


@pytest.fixture(scope="module")
def partial():
    """A memory of the cubes of which not all is known."""
    return learned_memory(ASSUMPTIONS, CUBES, RandomPolicy(), 6, np.random.default_rng(0))


def looked(memory, parameters, *detections, engine="bayes-filter"):
    """An engine after looks with the first action between them."""
    inference = begin_trial(engine, memory, parameters)
    for number, detection in enumerate(detections):
        if number:
            inference.act(0)
        inference.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, detection))
    return inference


def test_where_all_is_known_the_robot_is_at_the_aspect_it_sees():
    inference = looked(complete_memory(arcube_assumptions(3), CUBES), ModelParameters(), shown_pattern(CUBES[1], 7))
    (component,) = (each for each in inference.belief_components() if each.hypothesis == 1)
    assert component.belief[1 + 7] == pytest.approx(1.0, abs=1e-6)
    assert component.graph.number_of_edges() == 72


def test_probabilities_are_those_of_the_belief_over_identity(partial):
    inference = looked(partial, ModelParameters(0.1, 0.1), (3, None))
    probabilities = inference.identity().probabilities
    for component in inference.belief_components():
        assert component.probability == pytest.approx(probabilities[component.hypothesis], abs=1e-12)
        assert sum(component.belief.values()) <= 1 + 1e-12


@pytest.mark.parametrize("learn", [True, False])
@pytest.mark.parametrize("detections", [[(3, None)], [(3, 4)], [(3, 4), (None, None)]])
def test_shown_patterns_are_a_distribution(partial, learn, detections):
    shown = looked(partial, ModelParameters(0.1, 0.2, learn), *detections).shown_patterns()
    assert shown.min() >= 0
    assert shown.sum() == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("learn", [True, False])
def test_a_complete_look_without_noise_is_what_is_shown(partial, learn):
    shown = looked(partial, ModelParameters(0.1, 0.0, learn), (3, 4)).shown_patterns()
    assert shown[ASSUMPTIONS.alphabet.index((3, 4))] == pytest.approx(1.0, abs=1e-12)


def test_shown_patterns_of_an_unknown_object_by_hand():
    """Nothing is remembered: the truth is the pattern seen with 1 − δ + δ/|𝒵|, any other with δ/|𝒵|."""
    shown = looked(RobotMemory(ASSUMPTIONS), ModelParameters(0.1, 0.2, learn_in_trial=False), (3, 4)).shown_patterns()
    assert shown[ASSUMPTIONS.alphabet.index((3, 4))] == pytest.approx(0.8 + 0.2 / 132, abs=1e-12)
    assert shown[ASSUMPTIONS.alphabet.index((4, 3))] == pytest.approx(0.2 / 132, abs=1e-12)


@each_of(name for name in EXACT_ENGINES if name != "enumeration")
def test_exact_engines_agree(partial, engine):
    parameters = ModelParameters(0.1, 0.2)
    ours, theirs = (looked(partial, parameters, (3, 4), (4, None), engine=each) for each in (engine, "bayes-filter"))
    assert np.abs(ours.shown_patterns() - theirs.shown_patterns()).max() < 1e-12
    for first, second in zip(ours.belief_components(), theirs.belief_components(), strict=True):
        assert first.probability == pytest.approx(second.probability, abs=1e-12)
        assert dict(first.belief) == pytest.approx(dict(second.belief), abs=1e-12)


def test_asked_before_the_look_it_refuses(partial):
    with pytest.raises(InvalidInputError, match="asked before the look"):
        begin_trial("bayes-filter", partial, ModelParameters()).shown_patterns()
