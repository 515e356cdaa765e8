"""The tables of a memory that are kept from trial to trial, and brought up to date by what it has learned since."""

from __future__ import annotations

import threading
import weakref
from copy import deepcopy
from typing import Any, Final, NamedTuple

import numpy as np

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.table_kernels import Tables, spread_rows, write_row, write_rows

#: Room that each row has for the aspects and edges that a trial finds, before rows have to be moved.
ROOM: Final = 12
#: Rows that there is more room for, at most.
_MOST_MORE: Final = 1000

#: Types of states and of patterns.
Types = tuple[type[np.unsignedinteger[Any]], type[np.unsignedinteger[Any]]]

#: α of which tables are kept: that of an engine, and that of plain ATGs whose actions are uncertain beside it.
_CONCENTRATIONS: Final = 2

#: Trials whose arrays are kept: one that has ended, and the one before it, as the next begins before it is gone.
_SPARE: Final = 2


class TrialArrays(NamedTuple):
    """What a trial works on.

    Attributes:
        tables: What its hypotheses know.
        aspects: Room for p(X_t | O), shape [H, W], with any content.
    """

    tables: Tables
    aspects: FloatArray


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
        self._types = types_for(memory.assumptions)
        self._concentration = concentration
        self._lock = threading.RLock()
        self._tables: Tables
        self._n_edges = 0
        self._revisions: list[int] = []
        self._spare: list[TrialArrays] = []
        self._readers: weakref.WeakSet[Any] = weakref.WeakSet()
        self._make(list(memory))

    @property
    def current(self) -> Tables:
        """The tables as they were last brought up to date; not to be written to, and to be copied if they are kept."""
        return _part(self._tables, len(self._revisions) + 1, self._n_edges)

    def lend(self, memory: RobotMemory, trial: object, *, extends: bool) -> TrialArrays:
        """Return the tables of the memory as it is now.

        Args:
            memory: As it is now.
            trial: Who gets them; when it is gone, the next trial gets the same arrays.
            extends: Whether it extends them, ``ROOM`` times to begin with, and so needs a copy.
        """
        with self._lock:
            self._bring_up_to_date(list(memory))
            n_rows = len(memory) + 1
            lent = self._spare.pop() if self._spare else self._like_kept()
            weakref.finalize(trial, self._take_back, lent).atexit = False
            if not extends:
                self._readers.add(trial)
                return TrialArrays(self.current, lent.aspects[:n_rows])
            tables = _part(lent.tables, n_rows, self._n_edges + ROOM)
            for own, array in zip(tables, self._tables, strict=True):
                own[...] = array[: len(own)]
            tables.begins[-1] = self._n_edges
            return TrialArrays(tables, lent.aspects[:n_rows])

    def _like_kept(self) -> TrialArrays:
        n_rows, width = shape = self._tables.pattern.shape
        tables = empty_tables(n_rows, len(self._tables.counted), width, self._n_actions, self._types)
        return TrialArrays(tables, np.zeros(shape))

    def _take_back(self, lent: TrialArrays) -> None:
        """Keep the arrays of a trial that is gone for the next: new memory costs more than copying into old."""
        with self._lock:
            fits = all(own.shape == kept.shape for own, kept in zip(lent.tables, self._tables, strict=True))
            if fits and len(self._spare) < _SPARE:
                self._spare.append(lent)

    def _bring_up_to_date(self, graphs: list[AspectTransitionGraph]) -> None:
        revisions = [graph.revision for graph in graphs]
        if revisions == self._revisions:
            return
        before = [*self._revisions, *[-1] * (len(graphs) - len(self._revisions))]
        changed = [number for number, (new, old) in enumerate(zip(revisions, before, strict=False)) if new != old]
        if len(graphs) < len(self._revisions) or not self._fits([graphs[number] for number in changed], len(graphs)):
            self._make(graphs)
            return
        if len(self._readers):  # they go on with the tables as they were
            self._tables = deepcopy(self._tables)
            self._readers.clear()
        for number in changed:
            self._write(number, graphs[number])
        self._revisions = revisions

    def _fits(self, changed: list[AspectTransitionGraph], n_graphs: int) -> bool:
        """Return whether rows can be written, and a trial can extend them."""
        width = self._tables.pattern.shape[1]
        return (
            n_graphs < len(self._tables.n_known)
            and self._n_edges + sum(graph.n_counted + ROOM for graph in changed) + ROOM <= len(self._tables.counted)
            and all(min(graph.n_known + ROOM, self._n_aspects) < width for graph in changed)
        )

    def _write(self, number: int, graph: AspectTransitionGraph) -> None:
        """Write the row of an object; its edges go behind all others."""
        patterns = np.array(graph.pattern_indices, dtype=np.int64)
        write_row(tuple(self._tables), number, self._n_edges, patterns, graph.count_table, self._concentration)
        self._n_edges += graph.n_counted + ROOM

    def _make(self, graphs: list[AspectTransitionGraph]) -> None:
        """Make all tables anew, with half as many rows again as there are, but for large memories."""
        n_rows = len(graphs) + 1
        n_edges = sum(graph.n_counted for graph in graphs) + ROOM * n_rows
        more = min(16 + n_rows // 2, _MOST_MORE)
        width = 1 + min(max((graph.n_known for graph in graphs), default=0) + 2 * ROOM, self._n_aspects)
        self._tables = empty_tables(n_rows + more, n_edges + 2 * ROOM * more, width, self._n_actions, self._types)
        self._n_edges = 0
        self._spare.clear()
        self._readers.clear()
        for number, graph in enumerate(graphs):
            self._write(number, graph)
        self._revisions = [graph.revision for graph in graphs]


def _part(tables: Tables, n_rows: int, n_edges: int) -> Tables:
    """Return the first rows and edges of tables, as views."""
    return Tables._make([*(each[:n_rows] for each in tables[:3]), *(each[:n_edges] for each in tables[3:])])


def types_for(assumptions: Assumptions) -> Types:
    """Return the types of the arrays: small ones where they suffice, else large ones; each is compiled by itself."""
    is_small = max(assumptions.n_aspects, len(assumptions.actions)) < 2**8 and len(assumptions.alphabet) < 2**16
    return (np.uint8, np.uint16) if is_small else (np.uint32, np.uint32)


def empty_tables(n_rows: int, n_edges: int, width: int, n_actions: int, types: Types) -> Tables:
    """Return tables of hypotheses that know nothing; the types are those of states and of patterns."""
    of_states, of_patterns = types
    return Tables(
        np.zeros(n_rows, of_states),
        np.zeros((n_rows, width), of_patterns),
        np.zeros((n_rows, n_actions + 1), np.int64),
        np.zeros((n_edges, 2), of_states),
        np.zeros(n_edges),
        np.zeros(n_edges),
    )


def with_more_room(tables: Tables, room: int, n_aspects: int) -> Tables:
    """Return the same tables with room for so many more aspects, of |G| at most, and edges in each row."""
    width = 1 + min(int(tables.n_known.max()) + room, n_aspects)
    n_rows, before = tables.pattern.shape
    n_edges = int((tables.begins[:, -1] - tables.begins[:, 0]).sum()) + n_rows * room
    types = (tables.n_known.dtype.type, tables.pattern.dtype.type)
    more = empty_tables(n_rows, n_edges, max(width, before), tables.begins.shape[1] - 1, types)
    spread_rows(tuple(tables), tuple(more), room)
    return more._replace(n_known=tables.n_known)


#: Tables by memory, which is known by its ``id`` while it lives: memories compare by content.
_kept: Final[dict[int, dict[float, MemoryTables]]] = {}


def tables_of(
    assumptions: Assumptions, rows: tuple[IntArray, IntArray, IntArray, IntArray], room: int, concentration: float
) -> Tables:
    """Return tables of some hypotheses that are not kept, each with room for so many more aspects and edges.

    Args:
        assumptions: |G|, actions and alphabet.
        rows: Number of aspects of each [H], their patterns, number of transitions of each [H], and these [E, 4], one
            hypothesis after the other, as ``write_rows`` takes them.
        room: Of each.
        concentration: α.
    """
    n_known, _, _, counts = rows
    n_edges, width = len(counts) + room * len(n_known), int(n_known.max(initial=0)) + room
    shape = len(n_known), n_edges, 1 + min(width, assumptions.n_aspects), len(assumptions.actions)
    tables = empty_tables(*shape, types_for(assumptions))
    write_rows(tuple(tables), *rows, room, concentration)
    return tables


def arrays_for_trial(memory: RobotMemory, concentration: float, trial: object, *, extends: bool) -> TrialArrays:
    """Return the tables of a memory for a trial; those of the last trial are brought up to date for it.

    Args:
        memory: As it is now.
        concentration: α.
        trial: Who works on them.
        extends: Whether it extends them.
    """
    if id(memory) not in _kept:
        _kept[id(memory)] = {}
        weakref.finalize(memory, _kept.pop, id(memory), None)
    kept = _kept[id(memory)]
    if concentration not in kept:
        if len(kept) == _CONCENTRATIONS:
            kept.pop(next(iter(kept)))
        kept[concentration] = MemoryTables(memory, concentration)
    return kept[concentration].lend(memory, trial, extends=extends)
