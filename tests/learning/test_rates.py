"""Rates from counts of events."""

import numpy as np
import pytest

from atg_fg.learning.rates import Rates, Tally, estimate_rates


def test_each_rate_is_the_posterior_mean_of_its_own_events_and_occasions():
    tally = Tally(slips=4.0, n_actions=100.0, wrong=2.0, n_looks=300.0, repeats=1.0, reveals=50.0)
    rates = estimate_rates(tally, np.array([1.0, 0.5, 0.0]))
    expected = 5 / 200, 2.5 / 500, 1.5 / 100, 2.5 / 5
    assert (rates.slip, rates.wrong, rates.repeat, rates.share) == pytest.approx(expected)
    nothing = estimate_rates(Tally(*[0.0] * 6), np.zeros(0))
    assert (nothing.slip, nothing.wrong, nothing.repeat, nothing.share) == pytest.approx((0.01, 0.0025, 0.01, 0.5))
    assert nothing == Rates()
