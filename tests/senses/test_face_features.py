"""Features of crops: those of a user's own, and what is refused."""

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.face_features import face_features, rectified

MODULE = """
import numpy as np

class Tensor:
    def __array__(self, dtype=None, copy=None):
        raise TypeError("on another device")

def mean(crop): return crop.mean(axis=(0, 1))
def whole(crop): return [1, 2]
def fails(crop): raise RuntimeError("out of\\nmemory")
def ends(crop): raise SystemExit(3)
def takes_nothing(): return [1.0]
def none(crop): return None
def texts(crop): return ["a"]
def unsure(crop): return [1.0, float("nan")]
def grid(crop): return np.zeros((2, 2))
def empty(crop): return []
def tensor(crop): return Tensor()
number = 5
"""
CROP = np.full((48, 48, 3), 7, dtype=np.uint8)


@pytest.fixture(autouse=True)
def own(tmp_path, monkeypatch):
    (tmp_path / "own_features.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))


def test_a_function_of_a_users_own_makes_features():
    assert face_features("own_features:mean")(CROP).tolist() == [7.0, 7.0, 7.0]
    assert face_features("own_features:whole")(CROP).dtype == np.float64


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "fails",
            r"features 'own_features:fails': a crop of shape \(48, 48, 3\): RuntimeError: out of memory; expected",
        ),
        ("ends", "SystemExit: 3; expected numbers of it"),
        ("takes_nothing", "TypeError: takes_nothing.* expected numbers of it"),
        ("tensor", "TypeError: on another device; expected numbers of it"),
        ("none", "features 'own_features:none': .*None.*; expected numbers along one axis"),
        ("texts", "expected numbers along one axis"),
        ("unsure", "features 'own_features:unsure': 1 not finite; expected finite numbers"),
        ("grid", r"shape \(2, 2\); expected numbers along one axis"),
        ("empty", "no numbers; expected at least one"),
    ],
)
def test_a_function_that_fails_or_returns_something_else_is_one_line(name, message):
    features = face_features(f"own_features:{name}")
    with pytest.raises(InvalidInputError, match=message) as refused:
        features(CROP)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", ["own_features:number", "own_features", "", None, 5, "colours"])
def test_what_is_no_function_is_refused_with_all_that_there_is(name):
    with pytest.raises(InvalidInputError, match=r"expected 'colours-and-gradients', 'grid-and-gradients' or module:"):
        face_features(name)


SQUARE = np.array([[0, 0], [9, 0], [9, 9], [0, 9]], dtype=np.float64)


@pytest.mark.parametrize(
    ("frame", "corners", "size", "message"),
    [
        (None, SQUARE, 8, "frame: .*; expected RGB bytes"),
        (CROP[..., 0], SQUARE, 8, r"frame: shape \(48, 48\) of uint8; expected RGB bytes"),
        (CROP / 255.0, SQUARE, 8, "of float64; expected RGB bytes"),
        (CROP, SQUARE[:3], 8, r"corners: shape \(3, 2\); expected four corners"),
        (CROP, SQUARE * np.nan, 8, "corners: 8 not finite"),
        (CROP, SQUARE, 0, "size: 0; expected a whole number of at least 1"),
    ],
)
def test_a_frame_or_corners_that_are_none_are_refused(frame, corners, size, message):
    with pytest.raises(InvalidInputError, match=message):
        rectified(frame, corners, size)
