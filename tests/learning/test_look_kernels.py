"""Looks that are wrong in all slots at once, against enumeration: a ring of three registers, two in view."""

import itertools

import numpy as np
import pytest

from atg_fg.learning import kernels, look_kernels
from atg_fg.learning.kernels import Clusters, TrialArrays

SUCCESSORS = np.array([[1, 2, 0], [0, 2, 1], [0, 1, 2]])
REGISTERS = np.array([[0, 1], [1, 2], [2, 0]])
CONTENTS = list(itertools.product(range(3), repeat=3))
RATE, N_LOOKS = 0.3, 4
FLAGS = list(itertools.product((False, True), repeat=N_LOOKS))


def drawn(seed, n_trials=3):
    rng = np.random.default_rng(seed)
    right = 3.0 * rng.dirichlet(np.full(3, 0.4), size=(n_trials, N_LOOKS, 2))
    actions = rng.integers(2, size=(n_trials, N_LOOKS))
    return right, TrialArrays(right.copy(), actions, np.full(n_trials, N_LOOKS))


def clusters_of(owner, start):
    n = len(owner) + 2
    counts = np.bincount(owner, minlength=n)
    tables = np.full((n, 3, 3), 1 / 3)
    return Clusters(
        SUCCESSORS[None].copy(),
        REGISTERS,
        np.zeros(n, dtype=np.int64),
        tables,
        counts,
        np.array(owner),
        np.array(start),
        np.full(3, 1 / 3),
    )


def likelihood(right, actions, trial, contents, start, flags):
    """p(looks | contents, start, which are wrong), look by look."""
    state, result = start, 1.0
    for time in range(N_LOOKS):
        if not flags[time]:
            for slot in range(2):
                result *= right[trial, time, slot, contents[REGISTERS[state, slot]]]
        state = SUCCESSORS[actions[trial, time], state]
    return result


def prior_of(flags):
    return RATE ** sum(flags) * (1 - RATE) ** (N_LOOKS - sum(flags))


def evidence(right, actions, cluster):
    """p(looks of trials of one object, with their starts and flags), summed over all contents."""
    return sum(
        np.prod([likelihood(right, actions, trial, contents, start, flags) for trial, start, flags in cluster])
        for contents in CONTENTS
    ) / len(CONTENTS)


def test_judging_looks_one_by_one_estimates_all_judgements_together():
    right, trials = drawn(1, n_trials=1)
    path, rng = np.empty(N_LOOKS, np.int64), np.random.default_rng(2)
    kernels.walk(SUCCESSORS, trials.actions[0], N_LOOKS, 1, path)
    expected = sum(prior_of(flags) * evidence(right, trials.actions, [(0, 1, flags)]) for flags in FLAGS)
    estimates = []
    for _ in range(4000):
        table, wrong = np.full((3, 3), 1 / 3), np.zeros(N_LOOKS, dtype=np.bool_)
        estimates.append(look_kernels.judge_looks(right[0], N_LOOKS, path, REGISTERS, table, RATE, False, wrong, rng))
    estimates = np.exp(estimates)
    assert estimates.mean() == pytest.approx(expected, abs=4 * estimates.std() / np.sqrt(len(estimates)))


def test_a_judgement_that_is_kept_is_weighed_and_what_is_wrong_teaches_nothing():
    right, trials = drawn(3, n_trials=1)
    path, rng = np.empty(N_LOOKS, np.int64), np.random.default_rng(4)
    kernels.walk(SUCCESSORS, trials.actions[0], N_LOOKS, 0, path)
    wrong, table = np.array([False, True, True, True]), np.full((3, 3), 1 / 3)
    look_kernels.judge_looks(right[0], N_LOOKS, path, REGISTERS, table, RATE, True, wrong, rng)
    assert wrong.tolist() == [False, True, True, True]
    assert table[0] == pytest.approx(right[0, 0, 0] / right[0, 0, 0].sum())
    assert table[1] == pytest.approx(right[0, 0, 1] / right[0, 0, 1].sum())
    assert table[2] == pytest.approx(np.full(3, 1 / 3))


@pytest.mark.slow
def test_a_judged_move_leaves_the_distribution_of_object_start_and_judgements_as_it_is():
    right, trials = drawn(5)
    clusters = clusters_of([0, 0, 1], [0, 2, 1])
    wrong, log_new = np.zeros((3, N_LOOKS), dtype=np.bool_), np.full(6, 0.4)
    known = [(0, 0, FLAGS[0]), (1, 2, FLAGS[0])]
    expected = {}
    for start, flags in itertools.product(range(3), FLAGS):
        mine = (2, start, flags)
        together = evidence(right, trials.actions, [*known, mine]) / evidence(right, trials.actions, known)
        expected[0, start, flags] = prior_of(flags) * together
        expected[1, start, flags] = prior_of(flags) * np.exp(0.4) * evidence(right, trials.actions, [mine])
    total = sum(expected.values())
    kernels.learn_all_again(trials, clusters, -1, np.empty(N_LOOKS, np.int64))
    rng, n_rounds, found = np.random.default_rng(6), 40_000, dict.fromkeys(expected, 0)
    votes, each_slot = np.zeros(len(clusters.n_trials) + 1), TrialArrays(right, trials.actions, trials.lengths)
    for _ in range(n_rounds):
        look_kernels.judged_sweep(trials, right, each_slot, np.array([2]), clusters, log_new, RATE, wrong, rng, votes)
        place = (int(clusters.owner[2] != 0), int(clusters.start[2]), tuple(wrong[2].tolist()))
        found[place] += 1
    # Rounds depend on each other: the bound allows for some ten rounds of memory.
    for place, weight in expected.items():
        share = weight / total
        assert found[place] / n_rounds == pytest.approx(share, abs=4 * np.sqrt(10 * share / n_rounds) + 1e-3)
    of_known = sum(weight for place, weight in expected.items() if place[0] == 0) / total
    assert votes[0] / n_rounds == pytest.approx(of_known, abs=0.02)
