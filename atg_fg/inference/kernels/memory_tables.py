"""The tables of a memory that are kept from trial to trial, and brought up to date by what it has learned since."""

from __future__ import annotations

import threading
import weakref
from typing import Any, Final, NamedTuple

import numpy as np

from atg_fg.core.compact.columns import positions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.belief_kernels import Tables, weigh

#: Room that each row has for the aspects and edges that a trial finds, before rows have to be moved.
ROOM: Final = 12


#: Rows that there is more room for, at most.
_MOST_MORE: Final = 1000

#: Trials whose arrays are kept: one that has ended, and the one before it, as the next begins before it is gone.
_SPARE: Final = 2


class TrialArrays(NamedTuple):
    """What a trial works on.

    Attributes:
        tables: What its hypotheses know.
        aspects: Room for p(X_t | O), shape [H, W], with any content.
        next_aspects: The same for the next time.
    """

    tables: Tables
    aspects: FloatArray
    next_aspects: FloatArray


class MemoryTables:
    """The tables of a memory for one concentration α.

    Rows are the remembered objects, and after them *unseen*. They lie in arrays with room for more of them, and their
    edges in the order in which they were written; what a row leaves behind when it is written anew is not used again
    until there is no more room, and all tables are made anew.

    Args:
        memory: The memory.
        concentration: α.
    """

    def __init__(self, memory: RobotMemory, concentration: float) -> None:
        self._n_aspects = memory.assumptions.n_aspects
        self._n_actions = len(memory.assumptions.actions)
        largest = max(self._n_aspects, self._n_actions, len(memory.assumptions.alphabet))
        self._small = np.uint16 if largest <= np.iinfo(np.uint16).max else np.uint32
        self._concentration = concentration
        self._lock = threading.RLock()
        self._tables: Tables
        self._n_edges = 0
        self._counts: list[IntArray] = []
        self._n_known: list[int] = []
        self._spare: list[TrialArrays] = []
        self._make(memory)

    def copy_for(self, memory: RobotMemory, trial: object) -> TrialArrays:
        """Return the tables of the memory as it is now, for a trial to extend: ``ROOM`` times, to begin with.

        Args:
            memory: As it is now.
            trial: Who extends them; when it is gone, the next trial gets the same arrays.
        """
        with self._lock:
            self._bring_up_to_date(memory)
            kept, n_rows, n_edges = self._tables, len(memory) + 1, self._n_edges + ROOM
            lent = self._spare.pop() if self._spare else self._like_kept()
            weakref.finalize(trial, self._take_back, lent).atexit = False
            tables = Tables(
                lent.tables.n_known[:n_rows],
                lent.tables.pattern[:n_rows],
                lent.tables.edge_start[:n_rows],
                lent.tables.n_edges[:n_rows],
                lent.tables.edges[:n_edges],
                lent.tables.counted[:n_edges],
                lent.tables.probability[:n_edges],
                lent.tables.prior_weight[:n_rows],
            )
            for own, array in zip(tables, kept, strict=True):
                np.copyto(own, array[: len(own)])
            tables.edge_start[-1] = self._n_edges
            return TrialArrays(tables, lent.aspects[:n_rows], lent.next_aspects[:n_rows])

    def _like_kept(self) -> TrialArrays:
        n_rows, width = shape = self._tables.pattern.shape
        tables = _empty(n_rows, len(self._tables.counted), width, self._n_actions, self._small)
        return TrialArrays(tables, np.zeros(shape), np.zeros(shape))

    def _take_back(self, lent: TrialArrays) -> None:
        """Keep the arrays of a trial that is gone for the next: new memory costs more than copying into old."""
        with self._lock:
            fits = all(own.shape == kept.shape for own, kept in zip(lent.tables, self._tables, strict=True))
            if fits and len(self._spare) < _SPARE:
                self._spare.append(lent)

    def _bring_up_to_date(self, memory: RobotMemory) -> None:
        # A graph makes another count table whenever an edge is counted, and its aspects only grow.
        counts = [graph.count_table for graph in memory]
        n_known = [graph.n_known for graph in memory]
        n_before = len(self._counts)
        changed = [
            number
            for number, (new, old) in enumerate(zip(counts, self._counts, strict=False))
            if new is not old or n_known[number] != self._n_known[number]
        ]
        changed += range(n_before, len(counts))
        if not changed and len(counts) == n_before:
            return
        if len(counts) < n_before or not self._fits(changed, counts, n_known):
            self._make(memory)
            return
        graphs = list(memory)
        for number in changed:
            self._write(number, graphs[number].pattern_indices, counts[number])
        self._counts, self._n_known = counts, n_known
        weigh(self._tables, np.array(changed, dtype=np.int64), self._concentration)

    def _fits(self, changed: list[int], counts: list[IntArray], n_known: list[int]) -> bool:
        """Return whether rows can be written, and a trial can extend them."""
        width = self._tables.pattern.shape[1]
        return (
            len(counts) < len(self._tables.n_known)
            and self._n_edges + sum(len(counts[number]) + ROOM for number in changed) + ROOM
            <= len(self._tables.counted)
            and all(min(n_known[number] + ROOM, self._n_aspects) < width for number in changed)
        )

    def _write(self, number: int, patterns: tuple[int, ...], counts: IntArray) -> None:
        """Write the row of an object; its edges go behind all others."""
        tables = self._tables
        first, last = self._n_edges, self._n_edges + len(counts)
        tables.n_known[number] = len(patterns)
        tables.pattern[number, 1 : 1 + len(patterns)] = patterns
        tables.edge_start[number], tables.n_edges[number] = first, len(counts)
        # The collection node is state 0, and so the aspect of number 0 state 1.
        source, action, target, counted = counts.T
        order = np.lexsort((source, target, action))
        tables.edges[first:last] = np.stack((action, target + 1, source + 1), axis=1)[order]
        tables.counted[first:last] = counted[order]
        self._n_edges = last + ROOM

    def _make(self, memory: RobotMemory) -> None:
        """Make all tables anew, with half as many rows again as there are, but for large memories."""
        graphs = list(memory)
        self._counts = [graph.count_table for graph in graphs]
        self._n_known = [graph.n_known for graph in graphs]
        n_rows = len(graphs) + 1
        n_edges = sum(map(len, self._counts)) + ROOM * n_rows
        more = min(16 + n_rows // 2, _MOST_MORE)
        width = 1 + min(max(self._n_known, default=0) + 2 * ROOM, self._n_aspects)
        self._tables = _empty(n_rows + more, n_edges + 2 * ROOM * more, width, self._n_actions, self._small)
        self._n_edges = 0
        self._spare.clear()
        for number, (graph, counts) in enumerate(zip(graphs, self._counts, strict=True)):
            self._write(number, graph.pattern_indices, counts)
        weigh(self._tables, np.arange(len(graphs)), self._concentration)


def _empty(n_rows: int, n_edges: int, width: int, n_actions: int, small: type[np.integer[Any]]) -> Tables:
    """Return tables of hypotheses that know nothing."""
    return Tables(
        np.zeros(n_rows, small),
        np.zeros((n_rows, width), small),
        np.zeros(n_rows, np.int64),
        np.zeros(n_rows, small),
        np.zeros((n_edges, 3), small),
        np.zeros(n_edges),
        np.zeros(n_edges),
        np.ones((n_rows, n_actions, width)),
    )


def with_more_room(tables: Tables, room: int, n_aspects: int) -> Tables:
    """Return the same tables with room for so many more aspects, of |G| at most, and edges in each row."""
    n_edges = tables.n_edges.astype(np.int64)
    starts = np.cumsum(n_edges + room) - (n_edges + room)
    width = 1 + min(int(tables.n_known.max()) + room, n_aspects)
    n_rows, n_actions, before = tables.prior_weight.shape
    more = _empty(n_rows, int((n_edges + room).sum()), max(width, before), n_actions, tables.n_known.dtype.type)
    there, here = positions(starts, n_edges), positions(tables.edge_start, n_edges)
    for old, new in (
        (tables.edges, more.edges),
        (tables.counted, more.counted),
        (tables.probability, more.probability),
    ):
        new[there] = old[here]
    more.pattern[:, :before] = tables.pattern
    more.prior_weight[:, :, :before] = tables.prior_weight
    return more._replace(n_known=tables.n_known, edge_start=starts, n_edges=tables.n_edges)


#: Tables by memory, which is known by its ``id`` while it lives: memories compare by content.
_kept: Final[dict[int, dict[float, MemoryTables]]] = {}


def arrays_for_trial(memory: RobotMemory, concentration: float, trial: object) -> TrialArrays:
    """Return the tables of a memory for a trial to extend; those of the last trial are brought up to date for it.

    Args:
        memory: As it is now.
        concentration: α.
        trial: Who extends them.
    """
    if id(memory) not in _kept:
        _kept[id(memory)] = {}
        weakref.finalize(memory, _kept.pop, id(memory), None)
    kept = _kept[id(memory)]
    if concentration not in kept:
        kept.clear()  # of one α at a time
        kept[concentration] = MemoryTables(memory, concentration)
    return kept[concentration].copy_for(memory, trial)
