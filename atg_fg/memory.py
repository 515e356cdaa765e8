"""The robot memory ℳ: the ATGs of all objects judged novel so far (section 3 of the paper)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from atg_fg.assumptions import Assumptions
from atg_fg.errors import InvalidInputError, unknown_name
from atg_fg.graph import AspectTransitionGraph
from atg_fg.patterns import Detection


class RobotMemory:
    """ATGs by name, in the order they were made, under one set of assumptions.

    Args:
        assumptions: |O|, |G|, actions and alphabet.
        graphs: ATGs under the same assumptions, with unique names.

    Raises:
        InvalidInputError: A repeated name, or a graph made under other assumptions.
    """

    def __init__(self, assumptions: Assumptions, graphs: Iterable[AspectTransitionGraph] = ()) -> None:
        self.assumptions = assumptions
        self._graphs: dict[str, AspectTransitionGraph] = {}
        for graph in graphs:
            self.add(graph)

    def add(self, graph: AspectTransitionGraph) -> None:
        """Add the ATG of a novel object.

        Raises:
            InvalidInputError: The name is taken, or the assumptions differ.
        """
        if graph.name in self._graphs:
            raise InvalidInputError(f"memory: name {graph.name!r} is repeated; expected unique names")
        if graph.assumptions != self.assumptions:
            raise InvalidInputError(f"memory: {graph.name!r} was made under other assumptions than this memory")
        self._graphs[graph.name] = graph

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the remembered objects; object index i is the i-th of them."""
        return tuple(self._graphs)

    @property
    def n_unseen(self) -> int:
        """U = max(|O| − K, 1), the number of objects never met."""
        return max(self.assumptions.n_objects - len(self), 1)

    def learn(self, patterns: Sequence[int | None], actions: Sequence[int], matched: str | None) -> str:
        """Learn from a trial and return the name of the ATG it went to.

        Args:
            patterns: Index of the pattern seen at each time, ``None`` where it was not complete, length t + 1.
            actions: Index of the action between each two, length t.
            matched: Name of the ATG to extend, or ``None`` if the object was judged novel.
        """
        graph = AspectTransitionGraph(self._new_name(), self.assumptions) if matched is None else self[matched].copy()
        graph.learn(patterns, actions)
        self._graphs[graph.name] = graph
        return graph.name

    def learn_shared(self, name: str, detections: Sequence[Detection], actions: Sequence[int]) -> None:
        """Learn from a raw trial what all objects share: nothing, in a memory that takes each object by itself.

        Args:
            name: Name of the ATG that the trial went to.
            detections: The symbol in each slot at each look, ``None`` where nothing was seen, length t + 1.
            actions: Index of the action between each two, length t.
        """

    def _new_name(self) -> str:
        number = len(self)
        while f"object-{number:03d}" in self._graphs:
            number += 1
        return f"object-{number:03d}"

    def copy(self) -> RobotMemory:
        """Return a memory that can learn without touching this one."""
        return RobotMemory(self.assumptions, (graph.copy() for graph in self))

    def __getitem__(self, name: str) -> AspectTransitionGraph:
        try:
            return self._graphs[name]
        except KeyError:
            raise unknown_name("memory", name, self._graphs) from None

    def __len__(self) -> int:
        """K, the number of remembered objects."""
        return len(self._graphs)

    def __iter__(self) -> Iterator[AspectTransitionGraph]:
        return iter(self._graphs.values())

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RobotMemory):
            return NotImplemented
        return self.assumptions == other.assumptions and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"RobotMemory({len(self)} of {self.assumptions.n_objects} objects)"
