"""Calibrated spaces: what they make of within- and between-class scatter, and what they refuse."""

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.feature_space import DECIMALS, FeatureSpace


def looks_at_things(n_things, n_looks, seed=0):
    """Things that differ in two of four features; looks that scatter in all of them, each on a scale of its own."""
    rng = np.random.default_rng(seed)
    things = rng.normal(size=(n_things, 1, 4)) * [6.0, 3.0, 0.0, 0.0]
    return (things + rng.normal(size=(n_things, n_looks, 4))) * [1.0, 1.3, 0.8, 1.1] + 7.0


def test_looks_scatter_alike_and_only_directions_in_which_things_differ_are_kept():
    space = FeatureSpace.calibrated("four", looks_at_things(400, 6), 4)
    other = np.array([[space.encode(look) for look in thing] for thing in looks_at_things(200, 6, seed=1)])
    residuals = (other - other.mean(axis=1, keepdims=True)).reshape(-1, space.n_dimensions)
    within = residuals.T @ residuals / (200 * 5)
    assert within[:2, :2] == pytest.approx(np.eye(2), abs=0.12)
    assert space.between[:2] == pytest.approx([36, 9], rel=0.15)
    assert (space.between[2:] < 0.1).all()


def test_readings_are_rounded_so_that_a_record_of_them_is_whole():
    space = FeatureSpace.calibrated("four", looks_at_things(40, 3), 2)
    reading = space.encode([7.123456789, 71.0, 0.7, 35.0])
    assert reading.tolist() == [round(value, DECIMALS) for value in reading.tolist()]


@pytest.mark.parametrize(
    ("features", "message"),
    [
        ([1.0, 2.0, 3.0], r"features: shape \(3,\); expected 4 numbers, as of 'four'"),
        ([1.0, 2.0, 3.0, float("nan")], "features: 1 not finite; expected finite numbers"),
        (["a", "b", "c", "d"], "features: .* expected 4 numbers"),
    ],
)
def test_features_that_do_not_fit_are_refused(features, message):
    space = FeatureSpace.calibrated("four", looks_at_things(40, 3), 2)
    with pytest.raises(InvalidInputError, match=message):
        space.encode(features)


@pytest.mark.parametrize(
    ("looks", "message"),
    [
        (np.zeros((1, 3, 2)), "at least two looks at each of two things"),
        (np.full((3, 3, 2), np.nan), "expected finite ones"),
        (np.zeros((3, 3, 2)), "looks that differ"),
        (np.arange(3.0)[:, None, None] + np.zeros((3, 4, 2)), "looks that differ"),
    ],
)
def test_looks_that_say_nothing_calibrate_nothing(looks, message):
    with pytest.raises(InvalidInputError, match=message):
        FeatureSpace.calibrated("none", looks, 2)
