"""The filter of plain ATGs against the engine that says the same."""

import numpy as np
import pytest

from atg_fg.core.log_math import log_of
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.inference.history import History
from atg_fg.inference.recognition_model import RecognitionModel
from atg_fg.learning.plain_filter import PlainFilter
from tests.models import random_case


@pytest.mark.parametrize("seed", range(30))
def test_each_hypothesis_is_filtered_as_by_the_bayes_filter(seed):
    case = random_case(np.random.default_rng(seed))
    engine = begin_trial("bayes-filter", case.memory, case.parameters)
    model = RecognitionModel(case.memory, case.parameters)
    own, history = PlainFilter(model, log_of(model.prior)), History()
    for time, look in enumerate(case.looks):
        evidence, _ = look.evidence(case.assumptions.alphabet).scaled()
        joint = log_of(model.prior) + own.log_evidence + log_of((own.aspects * own.model.likelihood(evidence)).sum(1))
        if not np.isfinite(joint).any():
            return  # an impossible look, which the engine refuses
        engine.observe(evidence)
        history.evidence.append(evidence)
        own.observe(evidence, history.step(time))
        joint = np.exp(log_of(model.prior) + own.log_evidence)
        np.testing.assert_allclose(joint / joint.sum(), np.exp(engine._belief.log_identity), atol=1e-9)
        np.testing.assert_allclose(joint[:, None] * own.aspects / joint.sum(), engine.aspect_belief, atol=1e-9)
        owners, shown = own.shown_patterns()
        np.testing.assert_allclose((joint / joint.sum())[owners] @ shown, engine.shown_patterns(), atol=1e-5)
        owners, predicted = own.predicted_patterns()
        table = np.zeros((model.n_actions, engine.model.n_patterns))
        table += np.einsum("i,aiz->az", (joint / joint.sum())[owners], predicted)
        looks = [Evidence(each) for each in np.eye(engine.model.n_patterns)]
        shows = np.array([engine.model.likelihood(look) for look in looks])
        moved = [
            np.einsum("hx,hxy->hy", engine.aspect_belief, engine.model.transition(action))
            for action in range(model.n_actions)
        ]
        expected = np.einsum("ahy,zhy->az", moved, shows)
        np.testing.assert_allclose(table, expected, atol=1e-5)
        if time < len(case.actions):
            engine.act(case.actions[time])
            history.actions.append(case.actions[time])
            own.act(case.actions[time])


def test_a_copy_goes_on_alone():
    case = random_case(np.random.default_rng(3))
    model = RecognitionModel(case.memory, case.parameters)
    own = PlainFilter(model, log_of(model.prior))
    own.observe(case.nothing.evidence(case.assumptions.alphabet))
    before = own.aspects.copy()
    other = own.copy()
    other.act(0)
    other.observe_pattern(np.array(case.assumptions.alphabet.patterns[0]))
    assert (own.aspects == before).all()
    assert (own.log_evidence == 0).all()
    assert not (other.log_evidence == 0).all()
