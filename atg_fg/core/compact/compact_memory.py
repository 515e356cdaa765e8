"""A robot memory kept as arrays, for a hundred thousand ATGs and more."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.compact.columns import AnyIntArray, Column, least_type, positions
from atg_fg.core.compact.pattern_index import PatternIndex
from atg_fg.core.compact.size_classes import SizeClasses
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.memory import RobotMemory
from atg_fg.core.merging import Merge
from atg_fg.core.open_alphabets import Relabelling
from atg_fg.core.patterns import IntArray, Measured

_NO_MERGES: Final = "merge: a compact memory keeps no record of merges; expected a memory file in JSON"


class GraphArrays(NamedTuple):
    """ATGs one after the other: K of them with P aspects and E counted transitions in all.

    Attributes:
        n_known: n of each ATG, shape [K].
        patterns: Pattern of each aspect, shape [P].
        n_edges: Number of counted transitions of each ATG, shape [K].
        source: Aspect, counted within its ATG, that each transition leads from, shape [E].
        action: Its action, shape [E].
        target: Aspect that it leads to, shape [E].
        counts: How often it was seen, shape [E].
    """

    n_known: AnyIntArray
    patterns: AnyIntArray
    n_edges: AnyIntArray
    source: AnyIntArray
    action: AnyIntArray
    target: AnyIntArray
    counts: AnyIntArray


class CompactMemory(RobotMemory):
    """A robot memory whose ATGs are made when they are asked for, from arrays of small whole numbers.

    An ATG that grows is written anew at the end; the places left behind are freed when they are half of all. So adding
    or extending an ATG takes time proportional to its size, on average.

    Args:
        assumptions: |O|, |G|, actions and alphabet.
        graphs: ATGs under the same assumptions, with unique names.

    Raises:
        InvalidInputError: A repeated name, or a graph made under other assumptions.
    """

    def __init__(self, assumptions: Assumptions, graphs: Iterable[AspectTransitionGraph] = ()) -> None:
        super().__init__(assumptions)
        self._fill((), _arrays_of((), assumptions))
        for sense in assumptions.object_senses:
            raise InvalidInputError(f"compact memory: senses of the object, {sense.name!r}; expected none")
        graphs = list(graphs)
        for graph in graphs:
            if graph.assumptions != assumptions:
                raise InvalidInputError(f"memory: {graph.name!r} was made under other assumptions than this memory")
        names = [graph.name for graph in graphs]
        if len(set(names)) < len(names):
            repeated, _ = Counter(names).most_common(1)[0]
            raise InvalidInputError(f"memory: name {repeated!r} is repeated; expected unique names")
        self._fill(names, _arrays_of(graphs, assumptions))

    @classmethod
    def of(cls, memory: RobotMemory) -> CompactMemory:
        """Return the ATGs of any robot memory; one that is compact already is returned itself."""
        return memory if isinstance(memory, CompactMemory) else cls(memory.assumptions, memory)

    @classmethod
    def of_arrays(cls, assumptions: Assumptions, names: Sequence[str], arrays: GraphArrays) -> CompactMemory:
        """Return the memory of ATGs given as arrays that are known to be sound; they are not copied."""
        memory = cls(assumptions)
        memory._fill(names, arrays)
        return memory

    def _fill(self, names: Sequence[str], arrays: GraphArrays) -> None:
        """Make these ATGs all there are."""
        self._names = list(names)
        self._numbers: dict[str, int] | None = None
        self._columns = GraphColumns(self.assumptions, arrays)
        self._index: PatternIndex | None = None
        self._classes: SizeClasses | None = None

    def _number(self, name: str) -> int | None:
        if self._numbers is None:
            self._numbers = {each: number for number, each in enumerate(self._names)}
        return self._numbers.get(name)

    @property
    def index(self) -> PatternIndex:
        """Which objects show a pattern; made at first use, and kept up."""
        if self._index is None:
            arrays = self._columns.arrays()
            n_known = arrays.n_known.astype(np.int64)
            objects = np.repeat(np.arange(len(n_known)), n_known)
            aspects = positions(np.zeros(len(n_known), dtype=np.int64), n_known)
            assumptions = self.assumptions
            n_patterns, n_aspects = len(assumptions.alphabet), assumptions.n_aspects
            self._index = PatternIndex(n_patterns, arrays.patterns, objects, aspects, n_aspects)
        return self._index

    @property
    def size_classes(self) -> SizeClasses:
        """How many objects there are with n known aspects, and how many of these show a pattern; kept up."""
        if self._classes is None:
            arrays = self._columns.arrays()
            self._classes = SizeClasses(len(self.assumptions.alphabet), arrays.n_known, arrays.patterns)
        return self._classes

    @property
    def n_known(self) -> AnyIntArray:
        """N of each object, shape [K]."""
        return self._columns.n_known.values

    @property
    def nbytes(self) -> int:
        """Bytes that ATGs, index and class counts take; names not counted."""
        return self._columns.nbytes + self.index.nbytes + self.size_classes.nbytes

    def arrays(self, objects: IntArray | None = None) -> GraphArrays:
        """Return the ATGs of some objects, or of all, one after the other."""
        return self._columns.arrays(objects)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the remembered objects; object index i is the i-th of them."""
        return tuple(self._names)

    def add(self, graph: AspectTransitionGraph) -> None:
        """Add the ATG of a novel object.

        Raises:
            InvalidInputError: The name is taken, or the assumptions differ.
        """
        if self._number(graph.name) is not None:
            raise InvalidInputError(f"memory: name {graph.name!r} is repeated; expected unique names")
        if graph.assumptions != self.assumptions:
            raise InvalidInputError(f"memory: {graph.name!r} was made under other assumptions than this memory")
        number = len(self)
        index, classes = self.index, self.size_classes
        self._columns.append(_arrays_of([graph], self.assumptions))
        self._names.append(graph.name)
        assert self._numbers is not None
        self._numbers[graph.name] = number
        classes.add(graph.pattern_indices)
        for aspect, pattern in enumerate(graph.pattern_indices):
            index.add(pattern, number, aspect)

    def learn(
        self,
        patterns: Sequence[int | None],
        actions: Sequence[int | None],
        matched: str | None,
        name: str | None = None,
        measured: Sequence[Measured] = (),
    ) -> str:
        """Learn from a trial, as ``RobotMemory.learn`` does but for readings, which objects do not have here."""
        graph = AspectTransitionGraph(name or self._new_name(), self.assumptions) if matched is None else self[matched]
        known = graph.pattern_indices
        graph.learn(patterns, actions)
        if matched is None:
            self.add(graph)
            return graph.name
        number = self._number(matched)
        assert number is not None
        index, classes = self.index, self.size_classes
        self._columns.replace(number, _arrays_of([graph], self.assumptions))
        classes.remove(known)
        classes.add(graph.pattern_indices)
        for aspect, pattern in enumerate(graph.pattern_indices[len(known) :], start=len(known)):
            index.add(pattern, number, aspect)
        return graph.name

    def _new_name(self) -> str:
        number = len(self)
        while self._number(f"object-{number:03d}") is not None:
            number += 1
        return f"object-{number:03d}"

    def rename(self, old: str, new: str) -> None:
        """Refuse: names are in the order of the arrays.

        Raises:
            InvalidInputError: Always.
        """
        raise InvalidInputError(f"rename: {old!r} in a compact memory; expected JSON or a database")

    def merge(self, keep: str, drop: str) -> Merge:
        """Refuse: a compact memory keeps no record of merges.

        Raises:
            InvalidInputError: Always.
        """
        raise InvalidInputError(_NO_MERGES)

    def unmerge(self, name: str) -> None:
        """Refuse: a compact memory keeps no record of merges.

        Raises:
            InvalidInputError: Always.
        """
        raise InvalidInputError(_NO_MERGES)

    def _under(self, assumptions: Assumptions, labels: Relabelling) -> CompactMemory:
        return CompactMemory.of(super()._under(assumptions, labels))

    def become(self, other: RobotMemory) -> None:
        """Replace the assumptions and ATGs by those of another memory."""
        self.assumptions, arrays = other.assumptions, CompactMemory.of(other).arrays()
        self._fill(other.names, arrays)

    def copy(self) -> CompactMemory:
        """Return a memory that can learn without touching this one."""
        arrays = self.arrays()
        return CompactMemory.of_arrays(self.assumptions, self._names, GraphArrays(*(part.copy() for part in arrays)))

    def __getitem__(self, name: str) -> AspectTransitionGraph:
        """Return a copy of an ATG: ``learn`` is the way to change one."""
        number = self._number(name)
        if number is None:
            raise unknown_name("memory", name, self._names[:20])
        return self.graph(number)

    def graph(self, number: int) -> AspectTransitionGraph:
        """Return a copy of the ATG of the object with this index."""
        arrays = self.arrays(np.array([number]))
        graph = AspectTransitionGraph(self._names[number], self.assumptions)
        for pattern in arrays.patterns.tolist():
            graph.add_aspect(self.assumptions.alphabet.patterns[pattern])
        columns = (arrays.source, arrays.action, arrays.target, arrays.counts)
        for edge in zip(*(column.tolist() for column in columns), strict=True):
            graph.add_transition(*edge)
        return graph

    def __len__(self) -> int:
        """K, the number of remembered objects."""
        return len(self._names)

    def __iter__(self) -> Iterator[AspectTransitionGraph]:
        return (self.graph(number) for number in range(len(self)))


class GraphColumns:
    """The arrays of all ATGs, as columns that grow; each ATG has one piece of those of aspects and of transitions.

    Args:
        assumptions: They say how wide numbers have to be.
        arrays: The ATGs to begin with.
    """

    def __init__(self, assumptions: Assumptions, arrays: GraphArrays) -> None:
        self._types = _types_of(assumptions)
        self._fill(arrays)

    def _fill(self, arrays: GraphArrays) -> None:
        n_known, n_edges = arrays.n_known.astype(np.int64), arrays.n_edges.astype(np.int64)
        self.n_known, self._n_edges = Column(arrays.n_known), Column(arrays.n_edges)
        self._aspect_starts = Column(np.cumsum(n_known) - n_known)
        self._edge_starts = Column(np.cumsum(n_edges) - n_edges)
        self._patterns = Column(arrays.patterns)
        self._edges = [Column(part) for part in arrays[3:]]
        self._n_unused = 0

    @property
    def nbytes(self) -> int:
        """Bytes that all of it takes."""
        columns = [self.n_known, self._n_edges, self._aspect_starts, self._edge_starts, self._patterns, *self._edges]
        return sum(column.nbytes for column in columns)

    def arrays(self, objects: IntArray | None = None) -> GraphArrays:
        """Return the ATGs of some objects, or of all, one after the other."""
        if objects is None and not self._n_unused:
            edges = [column.values for column in self._edges]
            return GraphArrays(self.n_known.values, self._patterns.values, self._n_edges.values, *edges)
        chosen = np.arange(len(self.n_known)) if objects is None else objects
        n_known, n_edges = self.n_known.values[chosen], self._n_edges.values[chosen]
        aspects = positions(self._aspect_starts.values[chosen].astype(np.int64), n_known.astype(np.int64))
        edges_at = positions(self._edge_starts.values[chosen].astype(np.int64), n_edges.astype(np.int64))
        edges = [column.values[edges_at] for column in self._edges]
        return GraphArrays(n_known, self._patterns.values[aspects], n_edges, *edges)

    def append(self, arrays: GraphArrays) -> None:
        """Add one ATG."""
        self._aspect_starts.extend([len(self._patterns)])
        self._edge_starts.extend([len(self._edges[0])])
        self.n_known.extend(arrays.n_known)
        self._n_edges.extend(arrays.n_edges)
        self._write(arrays)

    def replace(self, number: int, arrays: GraphArrays) -> None:
        """Put another ATG in the place of one."""
        self._n_unused += int(self._n_edges.values[number]) + int(self.n_known.values[number])
        for column, length in ((self.n_known, arrays.n_known), (self._n_edges, arrays.n_edges)):
            column.set(number, int(length[0]))
        self._aspect_starts.set(number, len(self._patterns))
        self._edge_starts.set(number, len(self._edges[0]))
        self._write(arrays)
        if 2 * self._n_unused > len(self._patterns) + len(self._edges[0]):
            self._fill(self.arrays())

    def _write(self, arrays: GraphArrays) -> None:
        self._patterns.extend(arrays.patterns)
        for column, part in zip(self._edges, arrays[3:], strict=True):
            column.extend(part)


def _types_of(assumptions: Assumptions) -> tuple[type[np.integer[Any]], ...]:
    """Return the least types of n, patterns, edge numbers, sources, actions, targets and counts."""
    local = least_type(assumptions.n_aspects)
    actions = least_type(len(assumptions.actions))
    return local, least_type(len(assumptions.alphabet)), np.uint16, local, actions, local, np.uint16


def _arrays_of(graphs: Sequence[AspectTransitionGraph], assumptions: Assumptions) -> GraphArrays:
    """Return ATGs as arrays of the least types that hold them."""
    edges = [graph.counts for graph in graphs]
    rows = [(source, action, target, n) for counts in edges for (source, action, target), n in counts.items()]
    columns = np.array(rows, dtype=np.int64).reshape(-1, 4).T
    parts = (
        np.array([graph.n_known for graph in graphs], dtype=np.int64),
        np.array([pattern for graph in graphs for pattern in graph.pattern_indices], dtype=np.int64),
        np.array([len(counts) for counts in edges], dtype=np.int64),
        *columns,
    )
    return compacted(GraphArrays(*parts), assumptions)


def compacted(arrays: GraphArrays, assumptions: Assumptions) -> GraphArrays:
    """Return arrays in the least types that the assumptions allow; counts and lengths in one that holds them."""
    narrow = []
    for part, kind in zip(arrays, _types_of(assumptions), strict=True):
        fits = not len(part) or int(part.max()) <= np.iinfo(kind).max
        narrow.append(part.astype(kind if fits else np.int64, copy=False))
    return GraphArrays(*narrow)
