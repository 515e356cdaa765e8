"""What is refused, and in which words."""

import math

import numpy as np
import pytest

from atg_fg.core.checks import brief, distinct_names, finite_array, floats, number, one_of, plain_text, whole_number
from atg_fg.core.errors import InvalidInputError


@pytest.mark.parametrize("value", [3, np.int64(3), np.uint8(3)])
def test_a_whole_number_comes_back_as_an_int(value):
    assert whole_number(value, "here", 3, 3) == 3
    assert type(whole_number(value, "here")) is int


@pytest.mark.parametrize("value", [True, np.True_, 1.0, "1", None, [1], 2, 6, -1, 10**400])
def test_what_is_no_whole_number_in_these_bounds_is_refused_by_place_and_value(value):
    with pytest.raises(InvalidInputError, match=r"^here: .*; expected a whole number from 3 to 5$"):
        whole_number(value, "here", 3, 5)


@pytest.mark.parametrize("value", [0, 0.25, 1, np.float32(0.5), -1e-9, 1 + 1e-9])
def test_a_number_comes_back_as_a_float_and_rounding_is_forgiven(value):
    assert number(value, "here", 0.0, 1.0, slack=1e-6) == float(value)
    assert type(number(value, "here", 0.0, 1.0, slack=1e-6)) is float


@pytest.mark.parametrize("value", [True, math.nan, math.inf, -0.1, 1.1, "0.5", None, 10**400])
def test_what_is_no_number_in_these_bounds_is_refused(value):
    with pytest.raises(InvalidInputError, match=r"^here: .*; expected a finite number from 0 to 1$"):
        number(value, "here", 0.0, 1.0)


def test_a_bound_may_be_left_out_of_what_is_allowed():
    assert number(0.999, "here", 0.0, below=1.0) == 0.999
    with pytest.raises(InvalidInputError, match="expected a finite number from 0 to below 1"):
        number(1.0, "here", 0.0, below=1.0)


@pytest.mark.parametrize("value", ["c", [], {}, None, 1, True])
def test_what_is_none_of_the_names_is_refused_whatever_it_is(value):
    with pytest.raises(InvalidInputError, match="expected one of: a, b"):
        one_of(value, "here", {"a": 1, "b": 2})
    assert one_of("a", "here", ("a", "b")) == "a"


@pytest.mark.parametrize("value", ["", None, 3, "half \ud800"])
def test_what_is_no_text_is_refused(value):
    with pytest.raises(InvalidInputError, match="expected a text"):
        plain_text(value, "here")


@pytest.mark.parametrize("value", ["ab", [], ["a", "a"], ["a", 1], None, 3])
def test_names_are_different_texts_in_a_sequence(value):
    with pytest.raises(InvalidInputError, match="expected at least one name, all different"):
        distinct_names(value, "here")
    assert distinct_names(["a", "b"], "here") == ("a", "b")


def test_a_value_is_told_in_brief_however_large_it_is():
    endless = []
    for _ in range(100_000):
        endless = [endless]
    for value in (10**5000, "x" * 1000, endless, ["\ud800"] * 50):
        assert len(brief(value).encode()) <= 60


@pytest.mark.parametrize(
    "value", [[1, 2], (1.0, 2.0), np.array([1, 2], dtype=np.int8), np.array([1.0, 2.0], dtype=np.float16)]
)
def test_numbers_come_back_as_an_array_of_floats(value):
    for found in (floats(value, "here", "numbers"), finite_array(value, "here", (2,), "two numbers")):
        assert found.dtype == np.float64
        assert found.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (None, "here: None; expected two numbers"),
        ("ab", "here: 'ab'; expected two numbers"),
        (["1", "2"], r"here: \['1', '2'\]; expected two numbers"),
        ([[1, 2], [3]], r"here: \[\[1, 2\], \[3\]\]; expected two numbers"),
        ([1j, 2], "expected two numbers"),
        ([1, None], r"here: \[1, None\]; expected two numbers"),
        (1.0, r"here: shape \(\); expected two numbers"),
        ([1, 2, 3], r"here: shape \(3,\); expected two numbers"),
        ([[1, 2]], r"here: shape \(1, 2\); expected two numbers"),
        ([math.nan, -math.inf], "here: 2 not finite; expected finite numbers"),
        ([1.0, -1e101], r"here: 1e\+101; expected finite numbers to 1e\+100"),
    ],
)
def test_what_is_no_array_of_finite_numbers_of_a_shape_is_refused(value, message):
    with pytest.raises(InvalidInputError, match=message):
        finite_array(value, "here", (2,), "two numbers")


def test_any_length_may_do():
    assert finite_array(np.ones((3, 2)), "here", (None, 2), "pairs").shape == (3, 2)
