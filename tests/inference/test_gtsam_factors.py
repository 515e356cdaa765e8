from math import inf, nan

import gtsam
import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.inference import gtsam_factors as factors
from atg_fg.inference.gtsam_factors import HYPOTHETICAL_KEY, MAX_TIME, aspect_key, key_name, object_key

OBJECT, X0, X1 = object_key(), aspect_key(0), aspect_key(1)


@pytest.mark.parametrize("bad", [nan, inf, -inf, -1.0, -1e-300])
@pytest.mark.parametrize("place", [(0, 0), (1, 2)])
def test_a_value_that_gtsam_must_not_be_given_is_refused(bad: float, place: tuple[int, int]) -> None:
    table = np.ones((2, 3))
    table[place] = bad
    with pytest.raises(InvalidInputError, match=r"factor on \(O, X0\)"):
        factors.factor([OBJECT, X0], table)


@pytest.mark.parametrize("shape", [(), (2,), (2, 3, 4), (0, 3), (2, 0), (0, 0)])
def test_a_table_without_one_full_axis_a_variable_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InvalidInputError, match="shape"):
        factors.factor([OBJECT, X0], np.ones(shape))


@pytest.mark.parametrize("shape", [(2, 3), (1, 3), (2, 1), (1, 1), (5, 2)])
def test_a_factor_gives_back_the_table_it_was_made_from(shape: tuple[int, int]) -> None:
    table = np.random.default_rng(0).random(shape)
    factor = factors.factor([OBJECT, X0], table)
    np.testing.assert_array_equal(factors.table(factor, {OBJECT: shape[0], X0: shape[1]}), table)
    np.testing.assert_array_equal(factors.table(factor, {X0: shape[1], OBJECT: shape[0]}), table.T)
    assert factors.total(factor) == pytest.approx(table.sum(), rel=1e-14)


@pytest.mark.parametrize("order", [(OBJECT, X0), (X0, OBJECT)])
def test_axes_belong_to_their_keys_in_whatever_order_they_are_given(order: tuple[int, int]) -> None:
    table = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    factor = factors.factor(list(order), table if order == (OBJECT, X0) else table.T)
    assert factor(factors.assigned({OBJECT: 1, X0: 0})) == 4
    assert factor(factors.assigned({OBJECT: 0, X0: 2})) == 3


@pytest.mark.parametrize("n_states", [1, 2, 7])
def test_a_factor_on_one_variable_is_read_without_normalising_it(n_states: int) -> None:
    weights = np.arange(n_states) + 0.25
    np.testing.assert_allclose(factors.vector(factors.factor([X0], weights), n_states), weights, rtol=1e-15)


def test_a_factor_that_is_zero_everywhere_is_read_as_zeros() -> None:
    assert factors.vector(factors.factor([X0], np.zeros(3)), 3).tolist() == [0, 0, 0]


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (4, 1)])
def test_variables_with_one_state_multiply_and_sum_as_matrices_do(shape: tuple[int, int]) -> None:
    # GTSAM itself reads memory that is not its own here; repeat, for what it finds there varies.
    rng = np.random.default_rng(1)
    for _ in range(50):
        row, table = rng.random(shape[0]), rng.random(shape)
        product = factors.factor([X0], row) * factors.factor([X0, X1], table)
        summed = product.sum(factors.ordering([X0]))
        np.testing.assert_allclose(factors.vector(summed, shape[1]), row @ table, rtol=1e-14)


def test_the_added_state_of_a_one_state_variable_is_impossible() -> None:
    factor = factors.factor([X0], np.array([0.5]))
    assert factors.cardinality(1) == 2
    assert factors.cardinality(3) == 3
    assert factor(factors.assigned({X0: 0})) == 0.5
    assert factor(factors.assigned({X0: 1})) == 0


def test_keys_have_the_names_of_the_paper() -> None:
    assert [key_name(key) for key in (OBJECT, X0, X1, aspect_key(47), HYPOTHETICAL_KEY)] == [
        "O",
        "X0",
        "X1",
        "X47",
        "Z",
    ]


def test_keys_are_ordered_from_the_object_down_and_never_meet() -> None:
    assert OBJECT > X0 > X1 > aspect_key(MAX_TIME - 1) > HYPOTHETICAL_KEY > 0


@pytest.mark.parametrize("time", [-1, MAX_TIME])
def test_a_time_without_a_key_is_refused(time: int) -> None:
    with pytest.raises(InvalidInputError, match="time"):
        aspect_key(time)


def test_an_ordering_keeps_its_order() -> None:
    order = factors.ordering([X1, OBJECT, X0])
    assert isinstance(order, gtsam.Ordering)
    assert [order.at(place) for place in range(order.size())] == [X1, OBJECT, X0]
