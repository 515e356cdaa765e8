"""Edges as arrays, and the numbering of what they lead to."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.inference.counted_edges import Edges, distinct

EDGES = Edges(
    np.array([0, 1, 0]), np.array([0, 0, 1]), np.array([1, 2, 1]), np.array([2, 1, 1]), np.array([1.0, 2.0, 3.0])
)


@given(cells=st.lists(st.integers(0, 9)))
def test_equal_values_have_one_number_and_each_number_one_entry(cells: list[int]) -> None:
    values = np.array(cells, dtype=np.int64)
    numbers, one_of_each = distinct(values, 10)
    chosen = values[one_of_each]
    assert sorted(chosen) == sorted(set(cells))
    assert chosen[numbers].tolist() == cells


def test_edges_are_chosen_and_joined_entry_by_entry() -> None:
    assert EDGES.of_action(0).tolist() == [0, 2]
    joined = EDGES.chosen(EDGES.of_action(1)).followed_by(EDGES.chosen(EDGES.of_action(0)))
    assert [column.tolist() for column in joined] == [[1, 0, 0], [0, 0, 1], [2, 1, 1], [1, 2, 1], [2.0, 1.0, 3.0]]
