"""Sets of kinds against sums over every assignment of trials to kinds."""

import itertools
import math

import numpy as np
import pytest

from atg_fg.learning.candidate import Candidate
from atg_fg.learning.kinds import MAX_KINDS, N_PLAIN, PLAIN_BEFORE, choose_kinds, kind_table, share_kinds, tally_events
from atg_fg.learning.plain_evidence import USUAL, PlainEvidence
from atg_fg.learning.rates import AGAIN, FAILED, SLIP, WRONG, Rates
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure
from tests.learning.worlds import ARCUBES, CUBE, PRISM, cubes, prisms, random_objects, trial_of

RATES = Rates()


def exactly(table):
    """Return ln ∫ Π_t Σ_k π_k L_tk dπ, by the sum over all assignments of the trials to kinds."""
    n, n_kinds = table.shape
    before = [*PLAIN_BEFORE, *[1.0] * (n_kinds - N_PLAIN)]
    total = -np.inf
    for of in itertools.product(range(n_kinds), repeat=n):
        counts = np.bincount(of, minlength=n_kinds).tolist()
        polya = math.lgamma(sum(before)) - math.lgamma(sum(before) + n)
        polya += sum(math.lgamma(b + c) - math.lgamma(b) for b, c in zip(before, counts, strict=True))
        total = np.logaddexp(total, polya + sum(table[t, k] for t, k in enumerate(of)))
    return total


@pytest.mark.parametrize("seed", range(5))
def test_the_evidence_is_a_bound_from_below(seed):
    table = np.random.default_rng(seed).normal(scale=2, size=(5, 4))
    assert share_kinds(table).log_evidence <= exactly(table) + 1e-9


def test_the_evidence_is_exact_where_each_trial_is_clearly_of_one_kind():
    table = np.full((6, 4), -200.0)
    table[[0, 1, 2, 3, 4, 5], [0, 2, 2, 3, 3, 3]] = [-3.0, -2.0, -5.0, -1.0, -4.0, -2.0]
    assert share_kinds(table).log_evidence == pytest.approx(exactly(table))


def test_shares_are_those_that_the_rows_say():
    table = np.full((10, 3), -300.0)
    table[:7, 2] = table[7:, 0] = -1.0
    of = share_kinds(table)
    assert of.shares == pytest.approx([4 / 12.05, 0.05 / 12.05, 8 / 12.05])
    assert of.responsibilities.argmax(axis=1).tolist() == [2] * 7 + [0] * 3


def scored(structures, objects, seed=0, n_actions=10):
    rng = np.random.default_rng(seed)
    trials = [trial_of(each, n_actions, rng) for each in objects]
    pool = [Candidate(structure, ARCUBES) for structure in structures]
    for each in pool:
        each.catch_up(trials, range(len(trials)), RATES)
    plain = PlainEvidence(ARCUBES)
    plain.catch_up(trials, list(map(str, range(len(trials)))))
    return pool, plain.of_kinds(USUAL), trials


def test_two_kinds_are_better_than_either_alone():
    pool, plain, _ = scored([CUBE, PRISM], [*cubes(6), *prisms(6)])
    best = choose_kinds(pool, plain, RATES)[0]
    assert best.structures == (0, 1)
    for alone in pool:
        assert best.log_evidence > choose_kinds([alone], plain, RATES)[0].log_evidence + 50
    assert best.trials.responsibilities.argmax(axis=1).tolist() == [N_PLAIN] * 6 + [N_PLAIN + 1] * 6


def test_a_kind_that_nothing_follows_is_not_chosen():
    pool, plain, _ = scored([PRISM, CUBE], cubes(6))
    assert choose_kinds(pool, plain, RATES)[0].structures == (1,)
    pool, plain, _ = scored([PRISM, CUBE], random_objects(6, np.random.default_rng(1)))
    assert choose_kinds(pool, plain, RATES)[0].structures == ()


def test_a_trial_that_errs_too_much_for_a_kind_is_none_of_it():
    pool, plain, trials = scored([CUBE], cubes(1))
    assert kind_table(pool, plain, RATES)[0, N_PLAIN] > plain[0].max()
    spoiled = list(trials[0].detections)
    for look in (2, 4, 6, 8):  # the slots of a look exchanged: what a planted fault in the camera would show
        spoiled[look] = spoiled[look][::-1]
    wrong = [RawTrial(tuple(spoiled), trials[0].actions)]
    pool[0].forget()
    pool[0].catch_up(wrong, [0], RATES)
    assert kind_table(pool, plain, RATES)[0, N_PLAIN] <= plain[0].max() - 10


def test_a_structure_that_errs_a_little_in_each_trial_is_no_kind():
    pool, plain, _ = scored([CUBE], cubes(8))
    assert choose_kinds(pool, plain, RATES)[0].structures == (0,)
    pool[0].events[:, WRONG] = 1.0  # few enough for each trial, and too many for all
    assert choose_kinds(pool, plain, RATES)[0].structures == ()


def test_sets_that_explain_nearly_as_much_are_believed_in_too():
    pool, plain, _ = scored([CUBE], cubes(2), n_actions=3)
    gain = choose_kinds(pool, plain, RATES)[0].log_evidence - share_kinds(plain).log_evidence
    pool[0].log_evidence[:, 0] -= max(gain - 2.0, 0.0) if gain > 0 else 0.0
    sets = choose_kinds(pool, plain, RATES)
    assert {each.structures for each in sets} == {(0,), ()}
    assert sets[0].log_evidence >= sets[1].log_evidence > sets[0].log_evidence - 7


def pool_of(tables, structures, wrong=None):
    """Structures that explain trials of eleven looks as they are told to, none of them in another way."""
    pool = [Candidate(structure, ARCUBES) for structure in structures]
    for number, (each, log_evidence) in enumerate(zip(pool, tables, strict=True)):
        each.log_evidence, each.events = np.tile(log_evidence, (3, 1)), np.zeros((len(log_evidence), FAILED))
        each.n_looks = np.full(len(log_evidence), 11)
        if wrong is not None:
            each.events[:, WRONG] = wrong[number]
    return pool


def wide(*n_registers):
    """Structures of so many registers, which are ever less probable beforehand."""
    return [SharedStructure(2, (tuple(range(n)),)) for n in n_registers]


@pytest.mark.parametrize("seed", [0, 2, 3, 34, 266])
def test_the_best_set_of_kinds_is_the_best_of_all_sets(seed):
    rng = np.random.default_rng(seed)
    structures, n = wide(2, 3, 4, 5, 6, 7), 12
    plain = np.column_stack((rng.normal(-30, 3, n), np.full(n, -40.0)))
    explained, wrong = rng.random((6, n)) < 0.45, np.where(rng.random((6, n)) < 0.15, 1.0, 0.0)
    pool = pool_of(np.where(explained, rng.normal(-20, 4, (6, n)), -70.0), structures, wrong)
    table, evidence = kind_table(pool, plain, RATES), {}
    for chosen in itertools.chain.from_iterable(
        itertools.combinations(range(6), size) for size in range(MAX_KINDS + 1)
    ):
        shares = share_kinds(table[:, [0, 1, *(N_PLAIN + number for number in chosen)]])
        of = shares.responsibilities[:, N_PLAIN:].T
        if all(
            each.max() > 0.5 and each @ wrong[number] <= 2 + 0.02 * 11 * each.sum()
            for number, each in zip(chosen, of, strict=True)
        ):
            evidence[chosen] = shares.log_evidence + sum(structures[number].log_prior for number in chosen)
    best = choose_kinds(pool, plain, RATES)[0]
    assert best.log_evidence == pytest.approx(evidence[best.structures])
    assert best.structures == max(evidence, key=evidence.__getitem__)


def test_of_structures_that_explain_nearly_as_much_the_best_are_believed_in():
    """Each takes the place of the best one; beside it none gains what it costs beforehand."""
    behind = (3.0, 0.0, 2.0, 1.0, 4.0)
    pool = pool_of([[-20.0 - each, *[-20.0] * 5] for each in behind], wide(6) * 5)
    sets = choose_kinds(pool, np.full((6, 2), -60.0), RATES)
    assert [each.structures for each in sets] == [(1,), (3,), (2,)]
    assert [sets[0].log_evidence - each.log_evidence for each in sets] == pytest.approx([0.0, 1.0, 2.0])


@pytest.mark.parametrize(
    ("rates", "wrong", "slips", "is_one"),
    [
        (RATES, 1.8, 0.7, True),
        (RATES, 1.9, 0, False),
        (RATES, 0, 2.5, True),
        (RATES, 1, 1.7, False),
        (Rates(slip=1e-4, wrong=1e-4), 1.8, 0.7, True),
        (Rates(slip=0.06, wrong=0.0125), 2.1, 2.3, True),
        (Rates(slip=0.06, wrong=0.0125), 2.2, 0, False),
        (Rates(slip=0.06, wrong=0.0125), 0, 4.4, True),
        (Rates(slip=0.06, wrong=0.0125), 1, 3.5, False),
    ],
)
def test_wrong_looks_and_slips_beyond_a_limit_are_none_of_a_kind(rates, wrong, slips, is_one):
    """Of eleven looks 1.83 wrong ones and 2.6 of either, and three times what rates foretell beyond those beforehand.

    Of one wrong look and five slips more in a hundred that is 0.33 and 1.83. Slips after slips do not count.
    """
    (kind,), plain = pool_of([[-20.0]], wide(3)), np.array([[-25.0, -30.0]])
    kind.events[0, [WRONG, SLIP, AGAIN]] = wrong, slips + 4, 4
    assert kind_table([kind], plain, rates)[0, N_PLAIN] == (-20.0 if is_one else -35.0)


def test_events_are_those_of_the_set_and_of_its_commonest_structure_if_it_were_alone():
    """Three trials follow the first structure, the fourth the second, or the first less probably."""
    pool = pool_of([[-20.0, -20.0, -20.0, -40.0], [-90.0, -90.0, -90.0, -20.0]], wide(3, 4))
    for candidate, slips in zip(pool, (1.0, 2.0), strict=True):
        candidate.events[:, SLIP] = slips
    plain = np.full((4, 2), -60.0)
    best = next(each for each in choose_kinds(pool, plain, RATES) if each.structures == (0, 1))
    together, alone = tally_events(best, pool, plain, RATES)
    assert (together.slips, together.n_actions) == pytest.approx((3 + 2, 40), abs=1e-6)
    assert (alone.slips, alone.n_actions) == pytest.approx((4, 40), abs=1e-6)


def test_what_few_trials_of_many_take_for_wrong_is_not_excused_by_the_others():
    """Four of sixty trials follow the second structure, with 2.8 wrong looks of the 44; of these 2.88 may be wrong."""
    first = np.repeat([-20.0, -90.0], [56, 4])
    plain = np.full((60, 2), -60.0)
    for wrong, chosen in ((0.7, (0, 1)), (0.75, (0,))):
        pool = pool_of([first, -110.0 - first], wide(3, 4), [0.0, wrong])
        assert choose_kinds(pool, plain, RATES)[0].structures == chosen
