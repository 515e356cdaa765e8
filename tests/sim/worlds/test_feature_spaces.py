"""Spaces of features that come with the package are those that the command writes."""

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.face_features import DEFAULT_FEATURES, VIEW_FEATURES
from sim.kept_features import KEPT
from sim.worlds import feature_spaces, picture_box_world
from sim.worlds.feature_spaces import feature_space


@pytest.mark.slow
def test_the_spaces_that_come_with_the_package_are_what_the_command_writes(tmp_path, monkeypatch):
    kept = [feature_space(*each) for each in KEPT]
    monkeypatch.setattr(feature_spaces, "_path", lambda name: tmp_path / f"{name}.npz")
    for each in KEPT:
        feature_spaces.write_space(*each)
    for each, ours in zip(KEPT, kept, strict=True):
        theirs = feature_space.__wrapped__(*each)
        assert np.allclose(ours.mean, theirs.mean, rtol=1e-6)
        assert np.allclose(ours.between, theirs.between, rtol=1e-6)
        # The sign of a direction is any.
        products = [space.projection @ space.projection.T for space in (ours, theirs)]
        assert np.allclose(*products, rtol=1e-6, atol=1e-6 * np.abs(products[0]).max())


@pytest.mark.parametrize(("name", "features", "looks"), KEPT)
def test_they_are_read_and_nothing_is_looked_at(name, features, looks):
    def look(make):
        raise AssertionError("looked")

    assert feature_space(name, features, look).features == features
    with pytest.raises(AssertionError, match="looked"):
        feature_space(name, VIEW_FEATURES if features == DEFAULT_FEATURES else DEFAULT_FEATURES, look)


def test_features_that_change_their_length_calibrate_nothing(monkeypatch):
    lengths = iter(range(1, 10_000))
    monkeypatch.setattr(picture_box_world, "_CALIBRATION_BOXES", 1)
    monkeypatch.setattr(feature_spaces, "face_features", lambda _: lambda crop: np.ones(next(lengths)))
    with pytest.raises(InvalidInputError, match=r"calibration of 'mine:f': .*; expected as many features of each look"):
        feature_space("picture-box", "mine:f", picture_box_world.calibration_looks)
