"""Rates from counts of events."""

import numpy as np
import pytest

from atg_fg.learning.rates import Rates, Tally, estimate_rates

#: Nothing was counted.
NOTHING = Tally(*[0.0] * 8)


def test_each_rate_is_the_posterior_mean_of_its_own_events_and_occasions():
    tally = Tally(
        slips=7.0, n_actions=105.0, again=3.0, n_failed_before=5.0, wrong=2.0, n_looks=300.0, repeats=1.0, reveals=50.0
    )
    rates = estimate_rates(tally, np.array([1.0, 0.5, 0.0]), NOTHING)
    expected = 5 / 200, 2.5 / 500, 1.5 / 100, 2.5 / 5
    assert (rates.slip, rates.wrong, rates.repeat, rates.share) == pytest.approx(expected)
    assert rates.slips == (rates.slip, rates.slip)
    assert estimate_rates(NOTHING, np.zeros(0), NOTHING) == Rates() == Rates(0.01, 0.0025, 0.01, 0.5, None)


@pytest.mark.parametrize(
    ("again", "n_failed_before", "expected"),
    # ln B(1 + k, 1 + n − k) against k ln 0.01 + (n − k) ln 0.99: it has to be 4 nats more.
    [(0, 9, None), (1, 1, None), (1.1, 1.1, 2.1 / 3.1), (1, 3, None), (2, 3, 3 / 5), (2, 10, None), (3, 10, 4 / 12)],
)
def test_slips_come_together_if_any_rate_is_clearly_better_than_that_of_all(again, n_failed_before, expected):
    alone = NOTHING._replace(again=again, n_failed_before=n_failed_before)
    rates = estimate_rates(NOTHING, np.zeros(0), alone)
    assert rates.slip_again == (expected and pytest.approx(expected))
    assert rates.slips == (0.01, rates.slip_again or 0.01)
