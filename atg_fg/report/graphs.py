"""The ATGs of a trial's hypotheses, placed for drawing: what was remembered, and what the trial adds."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Detection, Evidence
from atg_fg.report.content import PlacedGraph, Report
from atg_fg.report.kinds import told_kinds

#: ATGs that a gallery shows.
MOST_DRAWN = 200
#: What the graph of an object is called that no ATG is remembered of.
NEW_OBJECT = "a new object"
UNKNOWN_MEMORY = "what the trial has shown"


class TrialGraphs:
    """Collects the ATGs that the looks of one trial need.

    Args:
        memory: That the trial began with; ``None`` if it is not known.
        assumptions: Of the trial.
        seen: The detections of all its looks.
        actions: Names of its actions, one less at least.
    """

    def __init__(
        self, memory: RobotMemory | None, assumptions: Assumptions, seen: Sequence[Detection], actions: Sequence[str]
    ) -> None:
        self._memory = memory
        self._assumptions = assumptions
        self._patterns = [Evidence.of_detection(assumptions.alphabet, each).pattern for each in seen]
        self._actions = [assumptions.actions.index(action) for action in actions][: len(seen) - 1]
        self._graphs: dict[str | None, PlacedGraph] = {}

    def index_of(self, name: str | None) -> int:
        """Return the index of an object's ATG in ``graphs``; ``None`` stands for an object never met."""
        known = name if self._memory is not None and name in self._memory.names else None
        if known not in self._graphs:
            self._graphs[known] = self._placed(known)
        return list(self._graphs).index(known)

    @property
    def graphs(self) -> tuple[PlacedGraph, ...]:
        """The graphs asked for so far."""
        return tuple(self._graphs.values())

    def _placed(self, name: str | None) -> PlacedGraph:
        new = UNKNOWN_MEMORY if self._memory is None else NEW_OBJECT
        if name is None or self._memory is None:
            before, title = AspectTransitionGraph("new", self._assumptions), new
        else:
            before, title = self._memory[name], name
        after = before.copy()
        after.learn(self._patterns, self._actions)
        return _remembered(before, title, after)


def gallery(memory: RobotMemory, name: str) -> Report:
    """Return the page of the ATGs of a memory, the first ones of very many.

    Args:
        memory: The memory.
        name: Of its file.

    Raises:
        InvalidInputError: It is empty.
    """
    if not len(memory):
        raise InvalidInputError(f"{name}: no objects; expected at least one")
    drawn = tuple(_remembered(graph, graph.name, graph) for graph in itertools.islice(memory, MOST_DRAWN))
    drawn_alone = (f"The first {MOST_DRAWN} of {len(memory)} objects are drawn.",)
    notes = (*(() if len(memory) <= MOST_DRAWN else drawn_alone), *told_kinds(memory))
    title = f"{len(memory)} of {memory.assumptions.n_objects} objects"
    return Report(title, {"file": name}, notes, memory.assumptions, gallery=drawn)


def _remembered(before: AspectTransitionGraph, title: str, after: AspectTransitionGraph) -> PlacedGraph:
    """Return an ATG placed for drawing, with room for the aspects that it has ``after`` a trial."""
    edges = tuple((*edge, count) for edge, count in sorted(before.counts.items()))
    return PlacedGraph(title, before.n_known, after.aspects, _circle(after.n_known), edges)


def _circle(n_aspects: int) -> tuple[tuple[float, float], ...]:
    """Return the middle of each aspect: on a circle that is wide enough, from its top clockwise."""
    radius = max(2.6, 1.9 * n_aspects / (2 * math.pi)) if n_aspects > 1 else 1.8
    angles = [math.pi / 2 - 2 * math.pi * aspect / n_aspects for aspect in range(n_aspects)]
    return tuple((round(radius * math.cos(angle), 4), round(radius * math.sin(angle), 4)) for angle in angles)
