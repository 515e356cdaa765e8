"""What one structure makes of trials, by what is given of their objects."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from atg_fg.learning.candidate import Candidate
from atg_fg.learning.likelihood import BEFORE, FILED, NEW, score_trials
from atg_fg.learning.rates import Rates
from atg_fg.learning.raw_trials import RawTrial
from tests.learning.oracle import Structure
from tests.learning.worlds import RING, RING_WORLD, objects_of, trial_of


@pytest.mark.parametrize("parts", [[9], [1, 2, 9], [4, 5, 9]])
def test_each_trial_is_scored_by_itself_however_many_are_learned_from_at_once(parts):
    rng, owners, rates = np.random.default_rng(0), [0, 1, 0, 0, 1, 2, 0, 2, 1], Rates(slip=0.1, wrong=0.05)
    objects = objects_of(RING, [(0, 1, 2), (3, 4, 0), (2, 0, 4)])
    trials = [trial_of(objects[owner], 3, rng, slip=0.1, wrong=0.1, missing=0.2) for owner in owners]
    candidate = Candidate(RING, RING_WORLD)
    candidate.catch_up(trials, [0] * 9, rates)
    candidate.forget()  # all that was learned of other owners
    for n_trials in parts:
        candidate.catch_up(trials[:n_trials], owners[:n_trials], rates)
    contents = np.zeros((3, 3, 5))
    for number, (owner, trial) in enumerate(zip(owners, trials, strict=True)):
        fresh = score_trials(RING, [trial], rates, RING_WORLD.alphabet)
        filed = score_trials(RING, [trial], rates, RING_WORLD.alphabet, contents[[owner]])
        assert candidate.log_evidence[NEW, number] == pytest.approx(fresh.log_evidence[0])
        assert candidate.log_evidence[FILED, number] == pytest.approx(filed.log_evidence[0])
        assert candidate.events[number] == pytest.approx(fresh.events[0])
        contents[owner] = filed.contents[0]
    np.testing.assert_allclose(candidate.contents, contents, atol=1e-9)


def test_each_trial_is_of_the_object_that_it_is_filed_under_or_of_a_new_one():
    rng, owners, n_objects = np.random.default_rng(4), [0, 1, 0, 2, 1, 0], RING_WORLD.n_objects
    rings = objects_of(RING, [(0, 1, 2), (0, 3, 1), (4, 2, 3)])
    trials = [trial_of(rings[owner], 8, rng) for owner in owners]
    candidate = Candidate(RING, RING_WORLD)
    candidate.catch_up(trials, owners, Rates(slip=0.05, wrong=0.02, repeat=1e-9))
    exact = Structure(2, RING.sources, 5, Fraction(1, 20), Fraction(1, 50), Fraction(1, 20))
    pairs = [(trial.detections, trial.actions) for trial in trials]
    for number, (pair, owner) in enumerate(zip(pairs, owners, strict=True)):
        earlier = [pairs[other] for other in range(number) if owners[other] == owner]
        fresh, filed = float(exact.fresh(*pair)), float(exact.again(earlier, *pair))
        n_new = n_objects - len(set(owners[:number]))
        evidence = np.exp(candidate.log_evidence[:, number])
        assert evidence[[NEW, FILED]] == pytest.approx([fresh, filed], rel=0.02)
        assert evidence[BEFORE] == pytest.approx((n_new * fresh + filed * bool(earlier)) / n_objects, rel=0.02)


def test_where_all_objects_were_met_there_is_still_one_that_was_not():
    """A robot may be told of too few."""
    trials = [RawTrial(((0, 1),), ()), RawTrial(((2, 3),), ())]
    candidate = Candidate(RING, replace(RING_WORLD, n_objects=1))
    candidate.catch_up(trials, [0, 1], Rates())
    assert candidate.log_evidence[BEFORE, 1] == pytest.approx(candidate.log_evidence[NEW, 1] - np.log(2))


def test_events_and_occasions_count_as_far_as_a_trial_follows_the_structure():
    candidate = Candidate(RING, RING_WORLD)
    candidate.events = np.array([[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], [10.0, 20.0, 30.0, 40.0, 50.0, 60.0]])
    candidate.n_looks = np.array([5, 9])
    tally = candidate.tally(np.array([1.0, 0.5]))
    assert tally == (6.0, 4 + 4, 30.0, 36.0, 12.0, 5 + 4.5, 18.0, 24.0)
