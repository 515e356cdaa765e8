"""What follows kinds of objects in a trial, beside engines that know that kind alone."""

import itertools

import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError
from atg_fg.core.log_math import log_of
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.engines.followed import FollowedPlain, FollowedStructure
from atg_fg.inference.history import History
from atg_fg.inference.recognition_model import RecognitionModel
from atg_fg.learning.believed_structure import BelievedStructure
from atg_fg.learning.rates import Rates
from tests.learning.worlds import RING, RING_WORLD, objects_of
from tests.models import random_case


@pytest.mark.parametrize("seed", range(12))
def test_plain_atgs_with_uncertain_actions_learn_within_the_trial_as_in_the_bayes_filter(seed):
    case, history = random_case(np.random.default_rng(seed)), History()
    engine = begin_trial("bayes-filter", case.memory, case.parameters)
    model = RecognitionModel(case.memory, case.parameters)
    followed = FollowedPlain(model, log_of(model.prior), history)
    for time, look in enumerate(case.looks):
        if time:
            engine.act(case.actions[time - 1])
            history.actions.append(case.actions[time - 1])
            followed.filter.act(case.actions[time - 1])
        try:
            engine.observe(look.evidence(case.assumptions.alphabet))
        except ImpossibleEvidenceError:
            return
        history.evidence.append(engine.history.evidence[-1])
        followed.observe(history.evidence[-1])
        belief = np.exp(followed.log_joint - np.logaddexp.reduce(followed.log_joint))
        identity = engine.identity()
        np.testing.assert_allclose(belief, np.append(identity.objects, identity.unseen), atol=1e-9)
        for hypothesis in np.flatnonzero(belief > 1e-6).tolist():
            np.testing.assert_allclose(
                followed.smoothed_aspects(hypothesis)[-1], engine.smoothed_aspects(hypothesis)[-1], atol=1e-9
            )


LOOKS = [
    (((0, 1), (1, 2), (0, 2)), (0, 1)),
    (((0, 1), (0, 1), (None, 2)), (0, 0)),
    (((0, 1), (2, 0), (None, None)), (0, 1)),
    (((0, 1), (3, 4), (1, 0)), (1, 1)),
]


@pytest.mark.parametrize(("looks", "actions"), LOOKS)
def test_smoothed_patterns_of_a_structure_are_sums_over_all_that_may_have_happened(looks, actions):
    """An action turns the ring or slips, and a look is of what the pose shows or of a pattern drawn uniformly."""
    rates, alphabet = Rates(slip=0.2, slip_again=0.7, wrong=0.15, repeat=1e-12), RING_WORLD.alphabet
    memory, contents = RobotMemory(RING_WORLD), np.eye(5)[[[0, 1, 2]]]
    believed = BelievedStructure(RING, 1.0, np.ones(1), contents, 0.5)
    followed = FollowedStructure(believed, np.log([0.5, 0.5]), rates, memory)
    engine = begin_trial("bayes-filter", memory, ModelParameters())
    for action, look in zip((None, *actions), looks, strict=True):
        if action is not None:
            engine.act(action)
            followed.filter.act(action)
        evidence = Evidence.of_detection(alphabet, look)
        engine.observe(evidence)
        followed.observe(evidence)

    poses, n = RING.poses(), len(alphabet)
    (ring,) = objects_of(RING, [[0, 1, 2]])
    shown = [alphabet.symbols.tolist().index(list(pattern)) for pattern in ring.patterns]
    likelihoods = [Evidence.of_detection(alphabet, look).likelihood for look in looks]
    expected = np.zeros((3, n))
    for start, *slips in itertools.product(range(len(shown)), (False, True), (False, True)):
        path, weight, failed = [start], 1.0, set()
        for action, slipped in zip(actions, slips, strict=True):
            path.append(path[-1] if slipped else poses.successors[path[-1], action])
            slip = 0.7 if action in failed else 0.2
            weight *= slip if slipped else 1.0 - slip
            failed = failed | {action} if slipped else failed - {action}
        for time, likelihood in enumerate(likelihoods):
            right, wrong = 0.85 * likelihood[shown[path[time]]], 0.15 * sum(likelihood[drawn] / n for drawn in range(n))
            weight *= right + wrong
        for time, pose in enumerate(path):
            expected[time, shown[pose]] += weight
    expected /= expected.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(followed.smoothed_patterns(0, engine), expected, atol=1e-9)
