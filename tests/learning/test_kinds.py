"""Sets of kinds against sums over every assignment of trials to kinds."""

import itertools
import math

import numpy as np
import pytest

from atg_fg.learning.candidate import Candidate
from atg_fg.learning.kinds import choose_kinds, kind_table, log_evidence_of, share_kinds
from atg_fg.learning.likelihood import plain_log_evidence
from atg_fg.learning.rates import Rates
from atg_fg.learning.raw_trials import RawTrial
from tests.learning.worlds import ARCUBES, CUBE, PRISM, cubes, prisms, random_objects, trial_of


def exactly(table):
    """Return ln ∫ Π_t Σ_k π_k L_tk dπ, uniform before, by the sum over all assignments of the trials to kinds."""
    n, n_kinds = table.shape
    total = -np.inf
    for of in itertools.product(range(n_kinds), repeat=n):
        counts = np.bincount(of, minlength=n_kinds)
        polya = math.lgamma(n_kinds) - math.lgamma(n_kinds + n) + sum(math.lgamma(1 + int(c)) for c in counts)
        total = np.logaddexp(total, polya + sum(table[t, k] for t, k in enumerate(of)))
    return total


@pytest.mark.parametrize("seed", range(5))
def test_the_evidence_is_a_bound_from_below(seed):
    table = np.random.default_rng(seed).normal(scale=2, size=(5, 3))
    assert log_evidence_of(table, 0.0) <= exactly(table) + 1e-9


def test_the_evidence_is_exact_where_each_trial_is_clearly_of_one_kind():
    table = np.full((6, 3), -200.0)
    table[[0, 1, 2, 3, 4, 5], [0, 1, 1, 2, 2, 2]] = [-3.0, -2.0, -5.0, -1.0, -4.0, -2.0]
    assert log_evidence_of(table, -7.0) == pytest.approx(exactly(table) - 7.0)


def test_shares_are_those_that_the_rows_say():
    table = np.full((10, 2), -300.0)
    table[:7, 1] = table[7:, 0] = -1.0
    of = share_kinds(table)
    assert of.shares == pytest.approx([4 / 12, 8 / 12])
    assert of.responsibilities.argmax(axis=1).tolist() == [1] * 7 + [0] * 3


def scored(structures, objects, seed=0, n_actions=10):
    rng = np.random.default_rng(seed)
    trials = [trial_of(each, n_actions, rng) for each in objects]
    pool = [Candidate(structure, ARCUBES.alphabet) for structure in structures]
    for each in pool:
        each.rescore(trials, range(len(trials)), Rates())
    return pool, np.array([plain_log_evidence(trial, ARCUBES) for trial in trials]), trials


def test_two_kinds_are_better_than_either_alone():
    pool, plain, trials = scored([CUBE, PRISM], [*cubes(6), *prisms(6)])
    chosen, evidence = choose_kinds(pool, plain, trials)
    assert chosen == [0, 1]
    for alone in pool:
        assert evidence > choose_kinds([alone], plain, trials)[1] + 50
    of = share_kinds(kind_table(pool, plain, trials)).responsibilities
    assert of.argmax(axis=1).tolist() == [1] * 6 + [2] * 6


def test_a_kind_that_nothing_follows_is_not_chosen():
    pool, plain, trials = scored([PRISM, CUBE], cubes(6))
    assert choose_kinds(pool, plain, trials)[0] == [1]
    pool, plain, trials = scored([PRISM, CUBE], random_objects(6, np.random.default_rng(1)))
    assert choose_kinds(pool, plain, trials)[0] == []


def test_a_trial_that_errs_too_much_for_a_kind_is_none_of_it():
    pool, plain, trials = scored([CUBE], cubes(1))
    assert kind_table(pool, plain, trials)[0, 1] > plain[0]
    spoiled = list(trials[0].detections)
    for look in (2, 4, 6, 8):  # the slots of a look exchanged: what a planted fault in the camera would show
        spoiled[look] = spoiled[look][::-1]
    wrong = [RawTrial(tuple(spoiled), trials[0].actions)]
    pool[0].rescore(wrong, [0], Rates())
    assert kind_table(pool, plain, wrong)[0, 1] <= plain[0] - 10
