import numpy as np
import pytest

from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import run_trial
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.policies import EntropyPolicy, LookaheadPolicy
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube_world import ARcubeWorld
from tests.learning.test_structured_memory import add
from tests.learning.worlds import ARCUBES, cubes, trial_of


@pytest.fixture(scope="module")
def memory():
    """Six cubes seen in ten actions each: the structure is found."""
    rng = np.random.default_rng(1)
    result = StructuredMemory(ARCUBES)
    for cube in cubes(6):
        add(result, trial_of(cube, 10, rng))
    assert result.learner.believed(result.names)
    return result


def looked(memory, *detections):
    inference = begin_trial("learned-structure", memory, preset("learned"))
    for number, detection in enumerate(detections):
        if number:
            inference.act(0)
        inference.observe(Evidence.of_detection(ARCUBES.alphabet, detection))
    return inference


@pytest.fixture
def inference(memory):
    return looked(memory, (3, 7), (7, None))


def test_one_action_ahead_is_expected_entropy(inference):
    tree = inference.belief_tree()
    assert np.array_equal(tree.expected_entropies(), inference.expected_entropies())
    for action in range(3):
        looks = tree.after(action)
        assert looks.probabilities.sum() == pytest.approx(1.0, abs=1e-12)
        expected = looks.probabilities @ looks.entropies
        # Objects that hardly matter are left out of both, in two ways.
        assert expected == pytest.approx(tree.expected_entropies()[action], abs=1e-4)


def test_an_imagined_look_leaves_the_belief_that_the_real_one_does(memory):
    """But for what a real look teaches the plain ATGs, which here are all but ruled out."""
    inference = looked(memory, (3, 7))
    look = int(inference.belief_tree().after(1).probabilities.argmax())
    tree = inference.belief_tree().after(1).belief(look)
    inference.act(1)
    inference.observe(Evidence.of_detection(ARCUBES.alphabet, ARCUBES.alphabet.patterns[look]))
    assert tree.identity == pytest.approx(inference.identity().probabilities, abs=1e-3)


def test_imagining_changes_nothing(inference):
    before = inference.identity().probabilities
    looks = inference.belief_tree().after(2)
    looks.expected_entropies(np.argsort(looks.probabilities)[-3:])
    assert np.array_equal(inference.identity().probabilities, before)


def test_information_can_only_lower_expected_entropy(inference):
    bounds = LookaheadPolicy(2, least_weight=1e-2).bounds(inference)
    assert (bounds.high <= inference.expected_entropies() + 1e-9).all()
    assert (bounds.low <= bounds.high + 1e-12).all()


def test_a_trial_looks_ahead(memory):
    world, rng = ARcubeWorld(), np.random.default_rng(0)
    policy = LookaheadPolicy(2, least_weight=1e-1)
    inference = begin_trial("learned-structure", memory, preset("learned"))
    assert len(run_trial(world, inference, policy, 2, rng).actions) == 2
    assert EntropyPolicy().choose(inference, rng).action in range(3)
