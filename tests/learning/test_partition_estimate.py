"""One partition for many: against all partitions of a few trials."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.learning.partition_estimate import estimated_partition

N_TRIALS = 5


def wrong_pairs(samples, weights, partition):
    """The expected number of pairs that a partition makes wrong, by its definition."""
    total = 0.0
    for one, other in itertools.combinations(range(len(partition)), 2):
        together = sum(w for w, sample in zip(weights, samples, strict=True) if sample[one] == sample[other])
        total += 1.0 - together if partition[one] == partition[other] else together
    return total


def groups(partition):
    return {frozenset(np.flatnonzero(np.array(partition) == number).tolist()) for number in set(partition)}


partitions = st.lists(st.integers(0, N_TRIALS - 1), min_size=N_TRIALS, max_size=N_TRIALS)


@given(st.lists(st.tuples(partitions, st.integers(1, 9)), min_size=1, max_size=6), partitions)
def test_no_single_move_makes_fewer_pairs_wrong_and_never_more_are_wrong_than_before(drawn, before):
    samples = np.array([sample for sample, _ in drawn])
    weights = np.array([weight for _, weight in drawn]) / sum(weight for _, weight in drawn)
    found = estimated_partition(samples, weights, np.array(before)).tolist()
    loss = wrong_pairs(samples, weights, found)
    assert loss <= wrong_pairs(samples, weights, before) + 1e-9
    for trial, number in itertools.product(range(N_TRIALS), range(N_TRIALS)):
        moved = [*found[:trial], number, *found[trial + 1 :]]
        assert loss <= wrong_pairs(samples, weights, moved) + 1e-6


@given(partitions, partitions)
def test_where_all_samples_agree_theirs_is_the_partition(sample, before):
    # However their objects are numbered.
    samples = np.array([sample, [N_TRIALS - number for number in sample]])
    found = estimated_partition(samples, np.array([0.25, 0.75]), np.array(before)).tolist()
    assert groups(found) == groups(sample)


def test_numbers_stay_where_nothing_moves():
    samples = np.array([[0, 0, 1, 2], [3, 3, 3, 1]])
    before = np.array([2, 2, 0, 3])
    assert estimated_partition(samples, np.array([0.6, 0.4]), before).tolist() == before.tolist()


def test_a_sample_without_weight_says_nothing():
    samples = np.array([[0, 0, 1], [0, 1, 1]])
    found = estimated_partition(samples, np.array([1.0, 0.0]), np.array([0, 1, 1])).tolist()
    assert groups(found) == {frozenset({0, 1}), frozenset({2})}
