"""What hypotheses know, as compiled loops hold it: rows of aspects and of transitions, written, counted and weighed.

This module loads Numba.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within

#: Of few bytes; which type it is depends on the sizes.
SmallIntArray = NDArray[Any]


class Tables(NamedTuple):
    """What H hypotheses know, in rows with room for more.

    Attributes:
        n_known: Aspects known, shape [H].
        pattern: Pattern of each state from 1 on, shape [H, W].
        begins: Where the edges of each hypothesis and action begin, and where the last end, shape [H, A + 1].
        edges: Target and source of each counted transition, ascending for each hypothesis and action, shape [E, 2].
        counted: How often it was counted, shape [E].
        probability: What it adds to its row, count / (c + α), shape [E].
    """

    n_known: SmallIntArray
    pattern: SmallIntArray
    begins: IntArray
    edges: SmallIntArray
    counted: FloatArray
    probability: FloatArray


@compiled
def write_row(
    tables: tuple[Any, ...], hypothesis: int, first: int, patterns: IntArray, counts: IntArray, concentration: float
) -> None:
    """Write what a hypothesis knows.

    Args:
        tables: ``Tables``, changed in place.
        hypothesis: Row to write.
        first: Where its edges begin.
        patterns: Of its aspects, shape [n].
        counts: Source, action, target and count of each transition, shape [E', 4]; aspects begin with 0.
        concentration: α.
    """
    n_known, pattern, begins, edges, counted, probability = tables
    n_known[hypothesis] = len(patterns)
    for number in range(len(patterns)):
        pattern[hypothesis, number + 1] = patterns[number]
    begins[hypothesis] = first
    for row in range(len(counts)):
        source, target = counts[row, 0] + 1, counts[row, 2] + 1
        count(edges, counted, probability, begins, hypothesis, source, counts[row, 1], target, float(counts[row, 3]))
    _weigh_own(edges, counted, probability, begins, hypothesis, concentration)


@compiled
def write_rows(
    tables: tuple[Any, ...],
    n_patterns: IntArray,
    patterns: IntArray,
    n_counts: IntArray,
    counts: IntArray,
    room: int,
    concentration: float,
) -> None:
    """Write what all hypotheses know, as ``write_row`` does, with room for so many more edges of each.

    Args:
        tables: ``Tables``, changed in place.
        n_patterns: Aspects of each, shape [H].
        patterns: Of these, one hypothesis after the other.
        n_counts: Transitions of each, shape [H].
        counts: Of these, one hypothesis after the other, shape [E', 4].
        room: Of each.
        concentration: α.
    """
    aspect, row, first = 0, 0, 0
    for hypothesis in range(len(n_patterns)):
        last_aspect, last_row = aspect + n_patterns[hypothesis], row + n_counts[hypothesis]
        write_row(tables, hypothesis, first, patterns[aspect:last_aspect], counts[row:last_row], concentration)
        aspect, row, first = last_aspect, last_row, first + n_counts[hypothesis] + room


@compiled
def spread_rows(tables: tuple[Any, ...], more: tuple[Any, ...], room: int) -> None:
    """Write what hypotheses know into other tables, with room for so many more edges of each.

    Args:
        tables: ``Tables`` to read.
        more: ``Tables`` to write, all but ``n_known``, of at least as many states.
        room: Of each.
    """
    _, pattern, begins, edges, counted, probability = tables
    _, to_pattern, to_begins, to_edges, to_counted, to_probability = more
    n_actions, first = begins.shape[1] - 1, 0
    for hypothesis in range(len(begins)):
        for state in range(pattern.shape[1]):
            to_pattern[hypothesis, state] = pattern[hypothesis, state]
        shift = first - begins[hypothesis, 0]
        for edge in range(begins[hypothesis, 0], begins[hypothesis, n_actions]):
            to_edges[edge + shift, 0], to_edges[edge + shift, 1] = edges[edge, 0], edges[edge, 1]
            to_counted[edge + shift], to_probability[edge + shift] = counted[edge], probability[edge]
        for action in range(n_actions + 1):
            to_begins[hypothesis, action] = begins[hypothesis, action] + shift
        first = to_begins[hypothesis, n_actions] + room


@compiled_within
def weigh_all(tables: tuple[Any, ...], concentration: float) -> None:
    """Set the probabilities of the edges in all rows of all hypotheses, from their counts."""
    _, _, begins, edges, counted, probability = tables
    for hypothesis in range(len(begins)):
        _weigh_own(edges, counted, probability, begins, hypothesis, concentration)


@compiled_within
def _weigh_own(
    edges: SmallIntArray,
    counted: FloatArray,
    probability: FloatArray,
    begins: IntArray,
    hypothesis: int,
    concentration: float,
) -> None:
    for action in range(begins.shape[1] - 1):
        for edge in range(begins[hypothesis, action], begins[hypothesis, action + 1]):
            weigh(edges, counted, probability, begins, hypothesis, edges[edge, 1], action, concentration)


@compiled_within
def weigh(
    edges: SmallIntArray,
    counted: FloatArray,
    probability: FloatArray,
    begins: IntArray,
    hypothesis: int,
    source: int,
    action: int,
    concentration: float,
) -> None:
    """Set the probabilities of the edges in a transition row, from their counts."""
    total = concentration
    for edge in range(begins[hypothesis, action], begins[hypothesis, action + 1]):
        if edges[edge, 1] == source:
            total += counted[edge]
    for edge in range(begins[hypothesis, action], begins[hypothesis, action + 1]):
        if edges[edge, 1] == source:
            probability[edge] = counted[edge] / total


@compiled_within
def count(
    edges: SmallIntArray,
    counted: FloatArray,
    probability: FloatArray,
    begins: IntArray,
    hypothesis: int,
    source: int,
    action: int,
    target: int,
    number: float,
) -> None:
    """Count a transition so many times more; there is room for one more edge."""
    first, place = begins[hypothesis, action], begins[hypothesis, action + 1]
    while place > first and (
        edges[place - 1, 0] > target or (edges[place - 1, 0] == target and edges[place - 1, 1] > source)
    ):
        place -= 1
    if place > first and edges[place - 1, 0] == target and edges[place - 1, 1] == source:
        counted[place - 1] += number
        return
    n_actions = begins.shape[1] - 1
    for edge in range(begins[hypothesis, n_actions], place, -1):
        edges[edge, 0], edges[edge, 1] = edges[edge - 1, 0], edges[edge - 1, 1]
        counted[edge], probability[edge] = counted[edge - 1], probability[edge - 1]
    edges[place, 0], edges[place, 1] = target, source
    counted[place] = number
    for later in range(action + 1, n_actions + 1):
        begins[hypothesis, later] += 1
