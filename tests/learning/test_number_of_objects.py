import itertools
import math

import numpy as np
import pytest

from atg_fg.learning.number_of_objects import log_new_weights, log_partition


def stirling(n, k):
    """Number of partitions of n trials into k objects."""
    owners = {
        tuple(sorted(map(tuple, [[t for t in range(n) if o[t] == i] for i in range(n)])))
        for o in itertools.product(range(n), repeat=n)
    }
    return sum(sum(1 for cluster in each if cluster) == k for each in owners)


@pytest.mark.parametrize("n_trials", [1, 2, 3, 4])
def test_partitions_of_trials_into_objects_are_a_distribution(n_trials):
    log_p = log_partition(6, n_trials, n_trials)
    total = sum(stirling(n_trials, k) * np.exp(log_p[k]) for k in range(1, n_trials + 1))
    assert total == pytest.approx(1.0, abs=1e-12)


def test_a_new_object_weighs_as_much_as_there_are_objects_left():
    assert np.exp(log_new_weights(100, 60, 50))[45] == pytest.approx(55, rel=0.1)


@pytest.mark.parametrize(("n_trials", "known"), [(20, 5), (30, 6), (48, 7)])
def test_while_not_all_have_been_met_a_new_one_weighs_as_much_as_there_are_left(n_trials, known):
    # That there are fewer than told is so improbable that it takes many trials to be believed.
    assert np.exp(log_new_weights(8, n_trials, 12))[known] == pytest.approx(8 - known, rel=0.1)


def test_being_told_of_too_many_objects_is_found_out():
    told = np.exp(log_new_weights(30, 48, 12))[8]
    assert told < 1.0  # all eight objects were met again and again; thirty would have shown more
    assert np.exp(log_new_weights(30, 9, 12))[8] > 10.0


def test_one_object_more_than_told_is_less_probable_with_every_trial():
    # p(9 objects) / p(8 objects), of trials that nine have each been met in and of as many that eight have.
    few, many = (np.exp(log_new_weights(8, n_trials, 12))[8] for n_trials in (20, 1000))
    assert few == pytest.approx(0.05 * 9 * (8 / 9) ** 20, rel=1e-9)
    assert many == pytest.approx(0.05 * 9 * (8 / 9) ** 1000, rel=1e-9)


def test_far_more_objects_than_told_are_not_impossible():
    assert np.isfinite(log_new_weights(8, 500, 500)).all()


def test_large_numbers_of_objects_cost_no_more():
    assert np.isfinite(log_partition(2**53, 5, 8)).all()


@pytest.mark.parametrize(("n_objects", "n_trials"), [(2_000, 60), (20_000, 30)])
def test_some_numbers_of_objects_stand_for_all_of_many(n_objects, n_trials):
    found = log_partition(n_objects, n_trials, 8)
    for known in (3, 8):
        each = [math.perm(m, known) / m**n_trials for m in range(known, n_objects + 1)]
        assert found[known] == pytest.approx(math.log(1e-4 / n_objects * sum(each) + 0.9999 * each[-1]), abs=0.03)
