"""What is believed of several objects that are all different, against enumeration of actual objects."""

import itertools
from fractions import Fraction
from math import comb, inf, log, prod

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError, TooLargeError
from atg_fg.inference.all_different import (
    MAX_TABLE,
    all_different_table,
    different_identities,
    identity_given_others,
    log_probability_all_different,
)

TOLERANCE = 1e-12


def belief(*probabilities: float, n_unseen: int) -> IdentityBelief:
    return IdentityBelief.of(np.array(probabilities), n_unseen)


def by_enumeration(beliefs: list[IdentityBelief]) -> tuple[list[list[float]], Fraction]:
    """Marginals and normaliser, from every way to give the objects different actual identities, as exact fractions.

    Actual object i < K is the i-th remembered one; those from K on are the unseen ones, each of which has 1/U of the
    probability of *unseen*.
    """
    n_objects, n_unseen = len(beliefs[0].objects), beliefs[0].n_unseen
    actual = [[Fraction(float(p)) for p in b.objects] + [Fraction(b.unseen) / n_unseen] * n_unseen for b in beliefs]
    marginals = [[Fraction(0)] * (n_objects + 1) for _ in beliefs]
    total = Fraction(0)
    for identities in itertools.permutations(range(n_objects + n_unseen), len(beliefs)):
        weight = prod((actual[k][i] for k, i in enumerate(identities)), start=Fraction(1))
        total += weight
        for k, i in enumerate(identities):
            marginals[k][min(i, n_objects)] += weight
    return [[float(p / total) if total else 0.0 for p in row] for row in marginals], total


@st.composite
def several_beliefs(draw: st.DrawFn) -> list[IdentityBelief]:
    n, n_objects, n_unseen = draw(st.integers(1, 4)), draw(st.integers(0, 3)), draw(st.integers(1, 4))
    weights = st.lists(
        st.sampled_from([0.0, 1e-300, 1e-12, 0.1, 0.5, 1.0]), min_size=n_objects + 1, max_size=n_objects + 1
    )
    rows = [np.array(draw(weights.filter(any))) for _ in range(n)]
    return [IdentityBelief.of(row / row.sum(), n_unseen) for row in rows]


def close(actual: object, expected: object) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=TOLERANCE)


def test_two_objects_by_hand() -> None:
    # (A, A) is out, (unseen, unseen) is weighted 1/2: what is left is A-u 0.6 · 0.5, u-A 0.4 · 0.5, u-u 0.4 · 0.5 / 2.
    beliefs = [belief(0.6, 0.4, n_unseen=2), belief(0.5, 0.5, n_unseen=2)]
    first, second = different_identities(beliefs)
    close(first.probabilities, [0.5, 0.5])
    close(second.probabilities, [1 / 3, 2 / 3])
    assert log_probability_all_different(beliefs) == pytest.approx(log(0.6), abs=1e-15)


def test_one_of_two_that_is_surely_a_leaves_the_other_for_b() -> None:
    sure, torn = belief(1.0, 0.0, 0.0, n_unseen=7), belief(0.5, 0.25, 0.25, n_unseen=7)
    close(identity_given_others(torn, [sure]).probabilities, [0, 0.5, 0.5])
    close(different_identities([sure, torn])[0].probabilities, [1, 0, 0])


def test_one_of_two_that_is_likely_a_makes_a_less_likely_for_the_other() -> None:
    likely, torn = belief(0.9, 0.05, 0.05, n_unseen=7), belief(0.5, 0.25, 0.25, n_unseen=7)
    told = identity_given_others(torn, [likely])
    assert told.objects[0] < 0.2 < 0.25 < told.objects[1]


def test_three_beliefs_in_three_objects_leave_the_permutations() -> None:
    # U = 1 and nobody is unseen: p(O_1 = A) is 0.5 · (0.5 · 0.5 + 0.3 · 0.2) of all six permutations.
    rows = [[0.5, 0.3, 0.2], [0.2, 0.5, 0.3], [0.3, 0.2, 0.5]]
    ways = {p: prod(rows[k][i] for k, i in enumerate(p)) for p in itertools.permutations(range(3))}
    beliefs = [belief(*row, 0.0, n_unseen=1) for row in rows]
    result = different_identities(beliefs)
    close(result[0].objects[0], (ways[0, 1, 2] + ways[0, 2, 1]) / sum(ways.values()))
    assert [b.unseen for b in result] == [0, 0, 0]


def test_as_many_objects_as_exist_leave_none_out() -> None:
    # Three actual objects, one of them unseen, and three cubes: exactly one is unseen.
    beliefs = [belief(0.2, 0.3, 0.5, n_unseen=1) for _ in range(3)]
    close(sum(b.unseen for b in different_identities(beliefs)), 1)
    close([b.probabilities for b in different_identities(beliefs)], np.full((3, 3), 1 / 3))


def test_the_prior_stays_uniform_over_actual_objects() -> None:
    # By symmetry each of n cubes is as likely as before to be any object.
    prior = belief(*[1 / 10] * 4, 6 / 10, n_unseen=6)
    for told in different_identities([prior] * 5):
        close(told.probabilities, prior.probabilities)


@given(several_beliefs())
def test_marginals_are_those_of_all_assignments_of_actual_objects(beliefs: list[IdentityBelief]) -> None:
    expected, total = by_enumeration(beliefs)
    if not total:
        assert log_probability_all_different(beliefs) == -inf
        with pytest.raises(ImpossibleEvidenceError):
            different_identities(beliefs)
        return
    close([told.probabilities for told in different_identities(beliefs)], expected)
    log_total = log(total.numerator) - log(total.denominator)
    assert log_probability_all_different(beliefs) == pytest.approx(log_total, rel=1e-13, abs=TOLERANCE)


@given(several_beliefs(), st.randoms(use_true_random=False))
def test_the_order_of_the_objects_does_not_matter(beliefs, random) -> None:
    order = random.sample(range(len(beliefs)), len(beliefs))
    if log_probability_all_different(beliefs) == -inf:
        return
    told = different_identities(beliefs)
    again = different_identities([beliefs[k] for k in order])
    close([b.probabilities for b in again], [told[k].probabilities for k in order])


@given(several_beliefs(), st.randoms(use_true_random=False))
def test_the_order_of_the_memory_does_not_matter(beliefs, random) -> None:
    if log_probability_all_different(beliefs) == -inf:
        return
    n_objects = len(beliefs[0].objects)
    order = random.sample(range(n_objects), n_objects)
    shuffled = [IdentityBelief(b.objects[order], b.unseen, b.n_unseen) for b in beliefs]
    for told, again in zip(different_identities(beliefs), different_identities(shuffled), strict=True):
        close(again.objects, told.objects[order])


@given(several_beliefs())
def test_every_marginal_sums_to_one_and_no_object_is_there_twice(beliefs: list[IdentityBelief]) -> None:
    if log_probability_all_different(beliefs) == -inf:
        return
    told = different_identities(beliefs)
    close([b.probabilities.sum() for b in told], 1)
    assert (sum(b.objects for b in told) <= 1 + TOLERANCE).all()
    assert sum(b.unseen for b in told) <= beliefs[0].n_unseen + TOLERANCE


@given(several_beliefs())
def test_one_object_alone_is_believed_in_as_before(beliefs: list[IdentityBelief]) -> None:
    close(different_identities(beliefs[:1])[0].probabilities, beliefs[0].probabilities)
    close(identity_given_others(beliefs[0], []).probabilities, beliefs[0].probabilities)
    assert log_probability_all_different(beliefs[:1]) == pytest.approx(0, abs=TOLERANCE)


def test_objects_that_all_look_the_same_are_told_apart_by_what_is_next_to_impossible() -> None:
    # Any assignment has a probability of 1e-600 or less, which no float holds.
    beliefs = [belief(1.0, 1e-300, 2e-300, n_unseen=1) for _ in range(3)]
    assert log_probability_all_different(beliefs) == pytest.approx(log(12) - 600 * log(10), rel=1e-14)
    for told in different_identities(beliefs):
        close(told.probabilities, [1 / 3, 1 / 3, 1 / 3])


def test_eight_objects_of_a_thousand_are_as_by_their_pairs() -> None:
    # Each is torn between two objects of its own and unseen, so that the factor changes the unseen alone.
    n, n_objects, n_unseen = 8, 1000, 9
    beliefs = []
    for k in range(n):
        probabilities = np.zeros(n_objects + 1)
        probabilities[[100 * k, 100 * k + 50, n_objects]] = 0.3, 0.2, 0.5
        beliefs.append(IdentityBelief.of(probabilities, n_unseen))
    shares = [prod((n_unseen - j) / n_unseen for j in range(m)) for m in range(n + 1)]
    others = [comb(n - 1, m) for m in range(n)]
    seen = 0.5 * sum(c * 0.5**7 * shares[m] for m, c in enumerate(others))
    unseen = 0.5 * sum(c * 0.5**7 * shares[m + 1] for m, c in enumerate(others))
    for k, told in enumerate(different_identities(beliefs)):
        close(told.unseen, unseen / (seen + unseen))
        close(told.objects[100 * k], 0.6 * seen / (seen + unseen))


@given(st.integers(1, 4), st.integers(0, 3), st.integers(1, 5))
def test_the_factor_is_the_share_of_different_choices_of_actual_objects(n: int, n_objects: int, n_unseen: int) -> None:
    expected = np.zeros([n_objects + 1] * n)
    for identities in itertools.permutations(range(n_objects + n_unseen), n):
        expected[tuple(min(i, n_objects) for i in identities)] += 1
    of_each = np.append(np.ones(n_objects), n_unseen)
    for axis in range(n):
        expected /= np.expand_dims(of_each, [other for other in range(n) if other != axis])
    close(all_different_table(n, n_objects, n_unseen), expected)


def test_a_factor_that_is_too_large_is_refused() -> None:
    with pytest.raises(TooLargeError, match=f"at most {MAX_TABLE}, so use .*different_identities"):
        all_different_table(3, 126, 10)
    assert all_different_table(3, 100, 10).shape == (101, 101, 101)


def test_more_objects_than_subsets_can_hold_are_refused() -> None:
    with pytest.raises(TooLargeError, match="sums"):
        different_identities([belief(0.5, 0.5, n_unseen=100)] * 60)


@pytest.mark.parametrize(
    "other",
    [
        belief(0.5, 0.25, 0.25, n_unseen=2),
        belief(0.5, 0.5, n_unseen=3),
        belief(0.5, 0.6, n_unseen=2),
        belief(-0.5, 1.5, n_unseen=2),
        belief(float("nan"), 0.5, n_unseen=2),
    ],
)
@pytest.mark.parametrize("question", [different_identities, log_probability_all_different])
def test_beliefs_of_different_memories_and_bad_ones_are_refused(other: IdentityBelief, question) -> None:
    with pytest.raises(InvalidInputError, match="belief"):
        question([belief(0.5, 0.5, n_unseen=2), other])


def test_no_unseen_objects_are_refused() -> None:
    with pytest.raises(InvalidInputError, match="expected at least 1"):
        different_identities([belief(0.5, 0.5, n_unseen=0)])


def test_more_objects_than_exist_are_impossible() -> None:
    with pytest.raises(ImpossibleEvidenceError, match="4 different objects"):
        different_identities([belief(0.25, 0.25, 0.5, n_unseen=1)] * 4)


def test_no_objects_have_no_beliefs() -> None:
    assert different_identities([]) == []
    assert log_probability_all_different([]) == 0
