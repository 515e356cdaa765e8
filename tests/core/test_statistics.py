import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.statistics import mean, mean_interval, standard_error, student_95, wilson_interval


def test_the_interval_of_the_papers_success_rate_is_the_published_one():
    low, high = wilson_interval(396, 500)
    assert (round(low, 3), round(high, 3)) == (0.754, 0.825)


def test_no_trial_says_nothing():
    assert wilson_interval(0, 0) == (0.0, 1.0)


@given(st.integers(1, 10_000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_interval_holds_the_rate_and_stays_a_probability(counts):
    successes, trials = counts
    low, high = wilson_interval(successes, trials)
    assert 0 <= low <= successes / trials <= high <= 1


@pytest.mark.parametrize("counts", [(-1, 5), (6, 5)])
def test_impossible_counts_are_refused(counts):
    with pytest.raises(InvalidInputError, match="expected 0 ≤ successes ≤ trials"):
        wilson_interval(*counts)


def test_mean_and_its_standard_error_by_hand():
    assert mean([1.0, 2.0, 6.0]) == 3.0
    assert mean([]) is None
    assert math.isclose(standard_error([1.0, 2.0, 6.0]), math.sqrt((4 + 1 + 9) / 2 / 3))
    assert standard_error([1.0]) is None


def test_the_interval_of_a_mean_is_as_wide_as_its_standard_error_says():
    low, high = mean_interval([1.0, 2.0, 3.0])
    margin = student_95(2) / math.sqrt(3)
    assert (low, high) == pytest.approx((2 - margin, 2 + margin))
    assert mean_interval([1.0]) is None
    assert mean_interval([]) is None


def test_students_point_is_that_of_its_distribution():
    from scipy import stats

    for freedom in (1, 2, 3, 4, 9, 10, 999, 2400, 2401, 10**9):
        assert student_95(freedom) == pytest.approx(stats.t.ppf(0.975, freedom), abs=1e-9 if freedom <= 2400 else 1e-3)
