"""Rival classes of structure: weighed by what they foretell, and given up late."""

import numpy as np
import pytest

from atg_fg.learning.automaton_populations import RivalPopulations
from atg_fg.learning.populations import Conclusion, Population


class Foretells(Population):
    """Foretells each trial as well as it is told, and takes none for one of a new object."""

    def __init__(self, *log_predictive):
        super().__init__()
        self.log_predictive, self.chains = log_predictive, [object()]

    def advance(self, task, names, rng):
        nobody = np.zeros((1, len(names)), dtype=np.int64)
        together = np.zeros(len(names) - 1)
        log_predictive = self.log_predictive[len(names) - 1]
        return Conclusion(np.array([1.0, 0.0]), np.ones(1), together, nobody, np.ones(1), log_predictive)

    log_evidence = saved = restore = None


def after(n_trials, *rivals):
    """Return the chains that are left of rivals after some trials, and their last weights."""
    populations = RivalPopulations(*rivals)
    for n_known in range(n_trials):
        conclusion = populations.advance(None, np.array([*range(n_known), -1]), np.random.default_rng(0))
    owners = {id(chain): number for number, (rival, _) in enumerate(rivals) for chain in rival.chains}
    return [owners[id(chain)] for chain in populations.chains], conclusion.weights


def test_rivals_have_the_weight_of_their_prior_and_of_what_they_foretold():
    left, weights = after(3, (Foretells(-1.0, -2.0, -3.0), 0.0), (Foretells(-1.0, -1.0, -1.0), -4.0))
    assert left == [0, 1]
    odds = np.exp((-4.0 - 3.0) - (-6.0))
    assert weights == pytest.approx([1 / (1 + odds), odds / (1 + odds)])


@pytest.mark.parametrize(("n_trials", "left"), [(19, [0, 1]), (20, [0])])
def test_one_that_is_far_behind_is_given_up_but_not_among_the_first_trials(n_trials, left):
    assert after(n_trials, (Foretells(*[-1.0] * 20), 0.0), (Foretells(*[-3.0] * 20), 0.0))[0] == left


def test_one_that_learns_more_slowly_is_there_when_it_foretells_better():
    slow = Foretells(*[-3.0] * 10, *[-1.0] * 10, *[0.0] * 20)
    left, weights = after(40, (slow, 0.0), (Foretells(*[-1.0] * 40), 0.0))
    assert left == [0, 1]
    assert weights[0] == pytest.approx(0.5)
