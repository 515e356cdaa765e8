import numpy as np
import pytest

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.policies.belief_features import BeliefFeatures
from tests.models import random_case
from tests.small import graph, one_slot, trial

ASSUMPTIONS = one_slot(4, 2, 3, ("push", "pull"))
PARAMETERS = ModelParameters(0.0, 0.0, learn_in_trial=False)


def memory():
    return RobotMemory(ASSUMPTIONS, [graph(ASSUMPTIONS, "cup", [(0,), (1,)]), graph(ASSUMPTIONS, "box", [(1,), (2,)])])


def test_its_entries_are_these():
    inference = trial("bayes-filter", memory(), PARAMETERS, 0)
    summary = BeliefFeatures(ASSUMPTIONS, top=3).of(inference)
    belief = inference.identity()
    # p(0 | cup) = 1/2, p(0 | box) = 0, p(0 | unseen) = 1/3 with weights 1, 1, 2: cup 3/7, unseen 4/7.
    assert belief.objects == pytest.approx([3 / 7, 0.0])
    # Neither action was ever tried, so that both are expected to take away as much.
    wanted = [3 / 7, 0, 0, 4 / 7, belief.entropy / np.log(4), 1, 1, 1, 1, 0, 0]
    np.testing.assert_allclose(summary, wanted, rtol=1e-6)
    assert summary.dtype == np.float32


def test_expected_entropies_may_be_left_out():
    inference = trial("bayes-filter", memory(), PARAMETERS, 0)
    whole, without = BeliefFeatures(ASSUMPTIONS), BeliefFeatures(ASSUMPTIONS, expected_entropies=False)
    np.testing.assert_array_equal(without.of(inference), np.delete(whole.of(inference), [8, 9]))
    assert (whole.length, without.length) == (13, 11)


def test_what_an_action_is_expected_to_take_away_is_told_as_a_share_of_the_most():
    """Pushing tells cup and box apart, since they are known to go to different aspects; pulling leaves both."""
    cup = graph(ASSUMPTIONS, "cup", [(0,), (1,)], (0, 0, 1, 1), (0, 1, 0, 1))
    box = graph(ASSUMPTIONS, "box", [(0,), (2,)], (0, 0, 1, 1), (0, 1, 0, 1))
    inference = trial("bayes-filter", RobotMemory(ASSUMPTIONS, [cup, box]), PARAMETERS, 0)
    gains = inference.identity().entropy - inference.expected_entropies()
    assert gains[0] > gains[1] > 0
    np.testing.assert_allclose(BeliefFeatures(ASSUMPTIONS).of(inference)[8:10], [1, gains[1] / gains[0]], rtol=1e-6)


def test_where_identity_is_certain_no_action_takes_anything_away():
    certain = IdentityBelief(np.array([1.0, 0.0]), 0.0, 2)
    inference = begin_trial("bayes-filter", memory(), PARAMETERS, certain)
    inference.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, [0]))
    assert BeliefFeatures(ASSUMPTIONS).of(inference)[6:10].tolist() == [0, 1, 0, 0]


def test_the_best_objects_come_first_however_many_there_are():
    inference = trial("bayes-filter", memory(), ModelParameters(0.1, 0.1), 0, 0, 1)
    best = np.sort(inference.identity().objects)[::-1]
    for top in (1, 2, 4):
        entries = BeliefFeatures(ASSUMPTIONS, top).of(inference)[:top]
        np.testing.assert_allclose(entries, [*best, 0, 0][:top], rtol=1e-6)


def test_the_number_of_looks_is_told():
    inference = trial("bayes-filter", memory(), ModelParameters(0.1, 0.1), 0, 0, 1, 0, 1)
    assert BeliefFeatures(ASSUMPTIONS).of(inference)[7] == pytest.approx(1 / 3)


def test_a_slot_that_saw_nothing_may_show_any_symbol():
    inference = begin_trial("bayes-filter", memory(), PARAMETERS)
    inference.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, [None]))
    np.testing.assert_allclose(BeliefFeatures(ASSUMPTIONS).of(inference)[-3:], 1 / 3)


def test_it_is_in_its_space_on_random_models():
    rng = np.random.default_rng(0)
    for _ in range(60):
        case = random_case(rng)
        inference = begin_trial("bayes-filter", case.memory, ModelParameters(0.1, 0.1, case.learn_in_trial))
        summary = BeliefFeatures(case.assumptions, top=2)
        for look, action in zip(case.looks, [*case.actions, None], strict=False):
            inference.observe(look.evidence(case.assumptions.alphabet))
            entries = summary.of(inference)
            assert summary.space.contains(entries)
            if action is not None:
                inference.act(action)


def test_it_is_of_trials_after_a_look_under_its_assumptions_alone():
    summary = BeliefFeatures(ASSUMPTIONS)
    with pytest.raises(InvalidInputError, match="asked before the look"):
        summary.of(begin_trial("bayes-filter", memory(), PARAMETERS))
    with pytest.raises(InvalidInputError, match="under other assumptions"):
        BeliefFeatures(one_slot(5, 2, 3)).of(trial("bayes-filter", memory(), PARAMETERS, 0))
    for top in (0, -1, 1.5, True):
        with pytest.raises(InvalidInputError, match=r"top: .*expected a whole number of at least 1"):
            BeliefFeatures(ASSUMPTIONS, top)
