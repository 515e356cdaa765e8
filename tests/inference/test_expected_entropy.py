import numpy as np

from atg_fg.inference.expected_entropy import best_actions


def test_actions_within_the_tolerance_of_the_least_are_equally_good():
    assert best_actions(np.array([1.0, 1.0 + 9e-10, 1.0 + 2e-9])) == [0, 1]
    assert best_actions(np.array([2.0, 1.0])) == [1]
