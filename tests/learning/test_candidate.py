"""What one structure makes of trials, against scoring them one by one."""

import numpy as np
import pytest

from atg_fg.learning.candidate import Candidate
from atg_fg.learning.likelihood import score_trials
from atg_fg.learning.rates import Rates
from atg_fg.learning.raw_trials import RawTrial
from tests.learning.worlds import RING, RING_WORLD, objects_of, trial_of

RATES = Rates(slip=0.1, wrong=0.05)


@pytest.mark.parametrize("parts", [[9], [1, 2, 9], [4, 5, 9]])
def test_each_trial_is_scored_as_of_a_fresh_object_and_teaches_its_own_object_once(parts):
    rng, owners = np.random.default_rng(0), [0, 1, 0, 0, 1, 2, 0, 2, 1]
    objects = objects_of(RING, [(0, 1, 2), (3, 4, 0), (2, 0, 4)])
    trials = [trial_of(objects[owner], 3, rng, slip=0.1, wrong=0.1, missing=0.2) for owner in owners]
    candidate = Candidate(RING, RING_WORLD.alphabet)
    candidate.catch_up(trials, [0] * 9, RATES)
    candidate.forget()  # all that was learned of other owners
    for n_trials in parts:
        candidate.catch_up(trials[:n_trials], owners[:n_trials], RATES)
    contents = np.zeros((3, 3, 5))
    for number, (owner, trial) in enumerate(zip(owners, trials, strict=True)):
        fresh = score_trials(RING, [trial], RATES, RING_WORLD.alphabet)
        assert candidate.log_evidence[number] == pytest.approx(fresh.log_evidence[0])
        assert candidate.events[number] == pytest.approx(fresh.events[0])
        contents[owner] = score_trials(RING, [trial], RATES, RING_WORLD.alphabet, contents[[owner]]).contents[0]
    np.testing.assert_allclose(candidate.contents, contents, atol=1e-9)


def test_events_and_occasions_count_as_far_as_a_trial_follows_the_structure():
    candidate = Candidate(RING, RING_WORLD.alphabet)
    candidate.events = np.array([[1.0, 2.0, 3.0, 4.0], [10.0, 20.0, 30.0, 40.0]])
    trials = [RawTrial(((0, 1),) * (n + 1), (0,) * n) for n in (4, 8)]
    tally = candidate.tally(trials, np.array([1.0, 0.5]))
    assert tally == (6.0, 4 + 4, 12.0, 5 + 4.5, 18.0, 24.0)
