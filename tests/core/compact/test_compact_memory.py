"""A memory kept as arrays is the same memory."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.compact.compact_memory import CompactMemory
from atg_fg.core.compact.pattern_index import PatternIndex
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from benchmarks.large_memory import synthetic_memory
from tests.models import Case, cases

ARCUBES = arcube_assumptions()
TRIALS = st.lists(
    st.tuples(
        st.lists(st.one_of(st.none(), st.integers(0, 131)), min_size=4, max_size=4),
        st.lists(st.integers(0, 2), min_size=3, max_size=3),
        st.integers(0, 5),
    ),
    max_size=12,
)


@given(case=cases())
def test_every_atg_comes_out_as_it_went_in(case: Case) -> None:
    assert list(CompactMemory.of(case.memory)) == list(case.memory)


@given(trials=TRIALS)
def test_it_learns_what_any_memory_learns_and_keeps_its_index_up(trials: list) -> None:
    plain, compact = RobotMemory(ARCUBES), CompactMemory(ARCUBES)
    for patterns, actions, choice in trials:
        matched = plain.names[choice] if choice < len(plain) else None
        if matched is None and patterns == [None] * 4:
            continue  # refused
        assert plain.learn(patterns, actions, matched) == compact.learn(patterns, actions, matched)
    assert list(compact) == list(plain)
    assert (compact.names, len(compact), compact.n_unseen) == (plain.names, len(plain), plain.n_unseen)
    again = CompactMemory.of(plain)
    for pattern in range(132):
        for ours, theirs in zip(compact.index.showing(pattern), again.index.showing(pattern), strict=True):
            assert sorted(ours) == sorted(theirs)
        shown = [(i, g.aspect_showing(pattern)) for i, g in enumerate(plain) if g.aspect_showing(pattern) is not None]
        assert sorted(zip(*again.index.showing(pattern), strict=True)) == shown
    for size, members, showing in zip(
        compact.size_classes.sizes, compact.size_classes.members, compact.size_classes.showing, strict=True
    ):
        alike = [graph for graph in plain if graph.n_known == size]
        assert members == len(alike)
        counted = np.bincount([p for graph in alike for p in graph.pattern_indices], minlength=132)
        np.testing.assert_array_equal(showing, counted)


def test_a_copy_learns_without_touching_the_first() -> None:
    memory = synthetic_memory(30, seed=0)
    names, before = memory.names, list(memory)
    twin = memory.copy()
    twin.learn([0, 1, 2], [0, 1], names[4])
    twin.learn([0, 1, 2], [0, 1], None)
    assert list(memory) == before
    assert (len(memory), len(twin)) == (30, 31)
    assert len(memory.index) + 3 <= len(twin.index) <= len(memory.index) + 6


def test_a_hundred_small_trials_leave_less_unused_than_used() -> None:
    memory = synthetic_memory(20, seed=0)
    for number in range(100):
        memory.learn([number, number + 1], [0], memory.names[number % 20])
    fresh = CompactMemory.of(RobotMemory(memory.assumptions, memory))
    assert list(fresh) == list(memory)
    assert memory.nbytes < 3 * fresh.nbytes


def test_a_transition_takes_at_most_25_bytes() -> None:
    memory = synthetic_memory(10_000, seed=0)
    assert memory.nbytes <= 25 * len(memory.arrays().source)


def test_large_counts_widen_the_column() -> None:
    graph = AspectTransitionGraph("A", ARCUBES)
    graph.add_aspect((0, 1))
    graph.add_transition(0, 0, 0, 2**53)
    memory = CompactMemory(ARCUBES)
    memory.learn([0, 1], [0], None)
    memory.add(graph)
    assert memory["A"] == graph


def test_what_is_wrong_is_refused() -> None:
    memory = CompactMemory(ARCUBES, [AspectTransitionGraph("A", ARCUBES)])
    with pytest.raises(InvalidInputError, match="'A' is repeated"):
        memory.add(AspectTransitionGraph("A", ARCUBES))
    with pytest.raises(InvalidInputError, match="'A' is repeated"):
        CompactMemory(ARCUBES, [AspectTransitionGraph("A", ARCUBES)] * 2)
    for make in (memory.add, lambda graph: CompactMemory(ARCUBES, [graph])):
        with pytest.raises(InvalidInputError, match="other assumptions"):
            make(AspectTransitionGraph("B", arcube_assumptions(7)))
    with pytest.raises(UnknownNameError, match="'B'"):
        memory["B"]
    with pytest.raises(InvalidInputError, match="no record of merges"):
        memory.merge("A", "B")
    with pytest.raises(InvalidInputError, match="no record of merges"):
        memory.unmerge("A")


def test_the_index_finds_what_was_added_before_and_after_it_is_sorted_anew() -> None:
    empty = np.zeros(0, dtype=np.int64)
    index = PatternIndex(5, empty, empty, empty, 400)
    for number in range(300):
        index.add(number % 5, number, number)
    assert len(index) == 300
    np.testing.assert_array_equal(np.sort(index.showing(3)[0]), np.arange(3, 300, 5))
    np.testing.assert_array_equal(index.showing_any(np.array([0, 3])), np.sort(np.r_[0:300:5, 3:300:5]))
    assert len(index.showing_any(empty)) == 0
