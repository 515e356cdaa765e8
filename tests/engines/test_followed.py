"""What follows kinds of objects in a trial, beside engines that know that kind alone."""

import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError
from atg_fg.core.log_math import log_of
from atg_fg.engines import begin_trial
from atg_fg.engines.followed import FollowedPlain
from atg_fg.inference.history import History
from atg_fg.inference.recognition_model import RecognitionModel
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
