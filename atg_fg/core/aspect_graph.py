"""The Aspect Transition Graph of one object (section 2 of the paper)."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from atg_fg.core.assumptions import MAX_NUMBER, Assumptions
from atg_fg.core.checks import instance, plain_text, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import Moments, check_measured
from atg_fg.core.open_alphabets import Relabelling
from atg_fg.core.patterns import IntArray, Measured, Pattern
from atg_fg.core.table import Cell, Table, shortened

if TYPE_CHECKING:
    import networkx

#: Node of the networkx view that stands for all unobserved aspects.
COLLECTION_NODE = "collection"
#: (source aspect, action, target aspect), all by index.
Edge: TypeAlias = tuple[int, int, int]

_revisions: Final = itertools.count()


class AspectTransitionGraph:
    """What is known of one object: aspects with their patterns, and counted transitions between them.

    All aspects not yet observed are one *collection node* of size |G| − n.

    Attributes:
        name: The object's name, unique in a memory.
        assumptions: What is taken for granted of every object.
        revision: A number that changes with the graph; graphs of one revision, as a graph and its copy, know the same.
    """

    def __init__(self, name: str, assumptions: Assumptions) -> None:
        self.name = plain_text(name, "name of an ATG")
        self.assumptions = instance(assumptions, "assumptions", Assumptions)
        self._aspect_of: dict[int, int] = {}
        self._counts: dict[Edge, int] = {}
        self._count_table: IntArray | None = None
        self._measured: dict[str, Moments] = {}
        self.revision = next(_revisions)

    @property
    def measured(self) -> dict[str, Moments]:
        """What is kept of all readings of the object, by the name of the sense that they are of."""
        return dict(self._measured)

    def measure(self, measured: Measured) -> None:
        """Add readings of the object as a whole.

        Raises:
            InvalidInputError: There is no such sense, or a reading is none of it.
        """
        senses = {sense.name: sense for sense in self.assumptions.object_senses}
        for name, reading in measured:
            check_measured(tuple(senses.values()), {name: reading}, f"{self.name}: measured")
            self.add_moments(name, senses[name].moments_of([reading]))

    def add_moments(self, name: str, moments: Moments) -> None:
        """Add what is kept of some readings of a sense; no readings make no entry."""
        if moments.count:
            self._measured[name] = self._measured.get(name, Moments()).plus(moments)
            self.revision = next(_revisions)

    @property
    def n_known(self) -> int:
        """n, the number of known aspects."""
        return len(self._aspect_of)

    @property
    def n_unobserved(self) -> int:
        """M = |G| − n, the size of the collection node; 0 once every aspect is known."""
        return self.assumptions.n_aspects - self.n_known

    @property
    def aspects(self) -> tuple[Pattern, ...]:
        """The pattern of each known aspect, in the order they were observed."""
        return tuple(self.assumptions.alphabet.patterns[index] for index in self._aspect_of)

    @property
    def pattern_indices(self) -> tuple[int, ...]:
        """The index in the alphabet of each known aspect's pattern."""
        return tuple(self._aspect_of)

    @property
    def counts(self) -> dict[Edge, int]:
        """c(x, a, y): how often each transition was observed."""
        return dict(self._counts)

    @property
    def n_counted(self) -> int:
        """How many different transitions were observed."""
        return len(self._counts)

    @property
    def count_table(self) -> IntArray:
        """(source, action, target, count) of each observed transition, shape [E, 4]; not to be written to."""
        if self._count_table is None:
            # Every trial asks every graph for it, but teaches one of them.
            rows = [(*edge, count) for edge, count in self._counts.items()]
            self._count_table = np.array(rows, dtype=np.int64).reshape(-1, 4)
            self._count_table.flags.writeable = False
        return self._count_table

    def aspect_showing(self, pattern: int) -> int | None:
        """Return the known aspect that shows the pattern of this index, or ``None``."""
        return self._aspect_of.get(pattern)

    def add_aspect(self, pattern: Sequence[int]) -> int:
        """Add a newly observed aspect and return its index.

        Raises:
            InvalidInputError: The pattern is malformed or known already, or all |G| aspects are known.
        """
        index = self.assumptions.alphabet.index(pattern)
        if index in self._aspect_of:
            raise InvalidInputError(f"{self.name}: pattern {list(pattern)!r} is repeated; expected unique patterns")
        if self.n_unobserved == 0:
            raise InvalidInputError(
                f"{self.name}: {self.n_known + 1} aspects; expected at most n_aspects = {self.assumptions.n_aspects}"
            )
        return self._add_aspect(index)

    def _add_aspect(self, pattern: int) -> int:
        self._aspect_of[pattern] = self.n_known
        self.revision = next(_revisions)
        return self.n_known - 1

    def add_transition(self, source: int, action: int, target: int, count: int = 1) -> None:
        """Count ``count`` more observations of a transition between known aspects.

        Raises:
            InvalidInputError: An aspect or action that is not there, a count below one, or a sum above 2^53.
        """
        for role, aspect in (("source", source), ("target", target)):
            if not self.n_known:
                raise InvalidInputError(
                    f"{self.name}: {role} aspect {aspect!r}; expected no transition, since no aspect is known"
                )
            whole_number(aspect, f"{self.name}: {role} aspect", 0, self.n_known - 1)
        self._check_action(action)
        whole_number(count, f"{self.name}: count", 1, MAX_NUMBER)
        self._add_transition((int(source), int(action), int(target)), int(count))

    def _add_transition(self, edge: Edge, count: int = 1) -> None:
        total = self._counts.get(edge, 0) + count
        if total > MAX_NUMBER:  # not exact as a floating-point number, and refused by whoever reads a file with it
            raise InvalidInputError(f"{self.name}: count {total}; expected a sum of at most 2^53")
        self._counts[edge] = total
        self._count_table = None
        self.revision = next(_revisions)

    def _check_action(self, action: int) -> None:
        whole_number(action, f"{self.name}: action", 0, len(self.assumptions.actions) - 1)

    def learn(self, patterns: Sequence[int | None], actions: Sequence[int | None]) -> None:
        """Extend the graph by what a trial showed.

        A node for each newly seen complete pattern, and one more count for each transition between two
        successive complete patterns; a full graph takes no further aspects.

        Args:
            patterns: Index of the pattern seen at each time, ``None`` where it was not complete, length t + 1.
            actions: Index of the action between each two, ``None`` where it is not sure, length t.
        """
        if len(patterns) != len(actions) + 1:
            raise InvalidInputError(
                f"{self.name}: {len(patterns)} observations, {len(actions)} actions; expected one observation more"
            )
        most = len(self.assumptions.alphabet) - 1
        for pattern in patterns:
            if pattern is not None:
                whole_number(pattern, f"{self.name}: pattern", 0, most)
        for action in actions:
            if action is not None:
                self._check_action(action)
        aspects = [self._aspect_for(pattern) for pattern in patterns]
        for source, action, target in zip(aspects, actions, aspects[1:], strict=False):
            if source is not None and action is not None and target is not None:
                self._add_transition((source, int(action), target))

    def relabelled(self, assumptions: Assumptions, labels: Relabelling) -> AspectTransitionGraph:
        """Return the same graph under assumptions with another alphabet."""
        graph = AspectTransitionGraph(self.name, assumptions)
        graph._aspect_of = {int(labels.indices[pattern]): aspect for pattern, aspect in self._aspect_of.items()}
        graph._counts, graph._measured = dict(self._counts), dict(self._measured)
        return graph

    def absorb(self, other: AspectTransitionGraph) -> None:
        """Add the aspects, counts and readings of another graph.

        A full graph takes no further aspects, nor what leads to them.

        Raises:
            InvalidInputError: It was made under other assumptions.
        """
        if other.assumptions != self.assumptions:
            raise InvalidInputError(f"{self.name}: {other.name!r} was made under other assumptions")
        aspects = [self._aspect_for(pattern) for pattern in other.pattern_indices]
        for (source, action, target), count in other.counts.items():
            start, end = aspects[source], aspects[target]
            if start is not None and end is not None:
                self.add_transition(start, action, end, count)
        for name, moments in other.measured.items():
            self.add_moments(name, moments)

    def _aspect_for(self, pattern: int | None) -> int | None:
        if pattern is None:
            return None
        if pattern not in self._aspect_of and self.n_unobserved > 0:
            return self._add_aspect(int(pattern))
        return self._aspect_of.get(pattern)

    def unknown_transitions(self) -> Iterable[tuple[int, int]]:
        """Yield each (known aspect, action) never tried: the dotted edges of Figure 1."""
        tried = {(source, action) for source, action, _ in self._counts}
        for aspect in range(self.n_known):
            for action in range(len(self.assumptions.actions)):
                if (aspect, action) not in tried:
                    yield aspect, action

    def to_networkx(self) -> networkx.MultiDiGraph[int | str]:
        """Return the graph for networkx.

        Nodes are the known aspects, by index, with attribute ``pattern``, and ``COLLECTION_NODE`` with
        attribute ``size`` while aspects are unobserved. Edges carry ``action``, ``count`` and ``observed``;
        an unknown transition is drawn to the collection node with count 0.
        """
        import networkx  # it takes a tenth of a second

        graph: networkx.MultiDiGraph[int | str] = networkx.MultiDiGraph(name=self.name)
        for aspect, pattern in enumerate(self.aspects):
            graph.add_node(aspect, pattern=pattern)
        for (source, action, target), count in sorted(self._counts.items()):
            name = self.assumptions.actions[action]
            graph.add_edge(source, target, key=name, action=name, count=count, observed=True)
        if self.n_unobserved:
            graph.add_node(COLLECTION_NODE, size=self.n_unobserved)
            for aspect, action in self.unknown_transitions():
                name = self.assumptions.actions[action]
                graph.add_edge(aspect, COLLECTION_NODE, key=name, action=name, count=0, observed=False)
        return graph

    def copy(self) -> AspectTransitionGraph:
        """Return a graph that can be extended without touching this one."""
        twin = AspectTransitionGraph(self.name, self.assumptions)
        twin._aspect_of = dict(self._aspect_of)
        twin._counts, twin._count_table = dict(self._counts), self._count_table
        twin._measured = dict(self._measured)
        twin.revision = self.revision
        return twin

    def __copy__(self) -> AspectTransitionGraph:
        return self.copy()

    def __setstate__(self, state: dict[str, Any]) -> None:
        # It may come from another process, which counts by itself.
        vars(self).update(state, revision=next(_revisions))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, AspectTransitionGraph):
            return NotImplemented
        return (self.name, self.assumptions, self.aspects, self._counts, self._measured) == (
            other.name,
            other.assumptions,
            other.aspects,
            other._counts,
            other._measured,
        )

    def table(self) -> Table:
        """Return the known aspects, and where each action was seen to lead."""
        assumptions, aspects = self.assumptions, self.aspects
        ways: dict[tuple[int, int], list[str]] = {}
        for (source, action, target), count in sorted(self._counts.items()):
            times = "" if count == 1 else f" ×{count}"
            ways.setdefault((source, action), []).append(f"{assumptions.alphabet.text(aspects[target])}{times}")
        rows: list[tuple[Cell, ...]] = [
            (
                assumptions.alphabet.text(pattern),
                *("; ".join(ways.get((aspect, action), ["·"])) for action in range(len(assumptions.actions))),
            )
            for aspect, pattern in enumerate(aspects)
        ]
        title = f"{self.name}: {self.n_known} of {assumptions.n_aspects} aspects, {len(self._counts)} observed edges"
        headings = (f"aspect ({', '.join(assumptions.alphabet.slots)})", *assumptions.actions)
        note = f"· not yet tried; collection node: {self.n_unobserved} unobserved{self._felt()}"
        return Table(title, headings if rows else (), shortened(rows, _ASPECTS, "aspects"), note)

    def _felt(self) -> str:
        """Return what the object has by its readings, as words; empty without."""
        words = ""
        for sense in self.assumptions.object_senses:
            moments = self._measured.get(sense.name)
            if moments is not None:
                value, _ = sense.estimate(moments, sense.variance([moments]))
                words += f"; {sense.name} {value:.3g} {sense.unit}".rstrip() + f" ({moments.count} readings)"
        return words

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    def __repr__(self) -> str:
        return (
            f"AspectTransitionGraph({self.name!r}, {self.n_known} of {self.assumptions.n_aspects} aspects, "
            f"{len(self._counts)} observed edges)"
        )


#: Rows that are shown of a long table.
_ASPECTS: Final = 24
