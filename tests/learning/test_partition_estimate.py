"""One partition for many: against all partitions of a few trials."""

import itertools
import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.learning.partition_estimate import estimated_partition

N_TRIALS = 5


def distance(samples, weights, partition):
    """The bound on the expected variation of information that is made least, by its definition."""
    total = 0.0
    for one in range(len(partition)):
        with_it = [other for other in range(len(partition)) if partition[other] == partition[one]]
        shares = sum(
            weight
            for other in with_it
            for weight, sample in zip(weights, samples, strict=True)
            if sample[one] == sample[other]
        )
        total += math.log(len(with_it)) - 2.0 * math.log(shares)
    return total


def groups(partition):
    return {frozenset(np.flatnonzero(np.array(partition) == number).tolist()) for number in set(partition)}


partitions = st.lists(st.integers(0, N_TRIALS - 1), min_size=N_TRIALS, max_size=N_TRIALS)


@given(st.lists(st.tuples(partitions, st.integers(1, 9)), min_size=1, max_size=6), partitions)
def test_no_single_move_comes_nearer_to_the_samples(drawn, before):
    samples = np.array([sample for sample, _ in drawn])
    weights = np.array([weight for _, weight in drawn]) / sum(weight for _, weight in drawn)
    found = estimated_partition(samples, weights, np.array(before)).tolist()
    loss = distance(samples, weights, found)
    for trial, number in itertools.product(range(N_TRIALS), range(N_TRIALS)):
        moved = [*found[:trial], number, *found[trial + 1 :]]
        assert loss <= distance(samples, weights, moved) + 1e-6


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


def test_a_trial_that_is_now_with_these_now_with_those_is_not_left_alone():
    # Three samples in five have the last trial with the first three, the others with the three between.
    samples = np.array([[0, 0, 0, 1, 1, 1, 0], [0, 0, 0, 1, 1, 1, 1]])
    for before in ([0, 0, 0, 1, 1, 1, 2], [0, 0, 0, 1, 1, 1, 1]):
        found = estimated_partition(samples, np.array([0.6, 0.4]), np.array(before)).tolist()
        assert groups(found) == {frozenset({0, 1, 2, 6}), frozenset({3, 4, 5})}


def test_a_trial_that_most_samples_have_alone_is_an_object():
    samples = np.array([[0, 0, 0, 1, 1, 1, 2], [0, 0, 0, 1, 1, 1, 1]])
    found = estimated_partition(samples, np.array([0.9, 0.1]), np.array([0, 0, 0, 1, 1, 1, 1])).tolist()
    assert groups(found) == {frozenset({0, 1, 2}), frozenset({3, 4, 5}), frozenset({6})}


def test_a_sample_without_weight_says_nothing():
    samples = np.array([[0, 0, 1], [0, 1, 1]])
    found = estimated_partition(samples, np.array([1.0, 0.0]), np.array([0, 1, 1])).tolist()
    assert groups(found) == {frozenset({0, 1}), frozenset({2})}
