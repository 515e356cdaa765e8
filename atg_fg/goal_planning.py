"""Paths to a goal over what is known of one object: reachable aspects, shortest paths, and what is not yet tried.

Every function takes a *transition graph*: a networkx multigraph with an aspect's ``pattern`` (index, or ``None`` if not
known) on each node and, on each edge, keyed by its ``action``, the ``probability`` that the action leads there.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Mapping
from typing import Final, NamedTuple, TypeAlias

import networkx
import numpy as np

from atg_fg.errors import InvalidInputError, unknown_name
from atg_fg.goals import Goal
from atg_fg.graph import AspectTransitionGraph, Edge
from atg_fg.model import COLLECTION, RecognitionModel
from atg_fg.patterns import FloatArray

TransitionGraph: TypeAlias = "networkx.MultiDiGraph[int]"

#: Among paths of the same probability the one with fewer actions is better; this is too little to change any other.
_TIE_BREAK: Final = 1e-9
#: Node that stands for whatever an action leads to that was never tried.
_UNTRIED: Final = -1

#: What an edge costs, by its probability: the number of attempts to expect, or how improbable a path of them is.
COSTS: Final[dict[str, Callable[[float], float]]] = {
    "attempts": lambda probability: 1.0 / probability,
    "surprise": lambda probability: -math.log(probability) + _TIE_BREAK,
}


class GoalPath(NamedTuple):
    """A path over known transitions.

    Attributes:
        aspects: From the first to the last.
        actions: Index of the action between each two.
        cost: Sum of the costs of its edges.
        probability: That all its actions lead where they should.
    """

    aspects: tuple[int, ...]
    actions: tuple[int, ...]
    cost: float
    probability: float


def transition_graph(
    patterns: Mapping[int, int], counts: Mapping[Edge, float], concentration: float, n_aspects: int
) -> TransitionGraph:
    """Return the known transitions with their probabilities p(y | x, a) = (c + α/|G|) / (Σ c + α).

    Args:
        patterns: Index of the pattern that each known aspect shows.
        counts: c(x, a, y).
        concentration: α.
        n_aspects: |G|.
    """
    graph: TransitionGraph = networkx.MultiDiGraph()
    for aspect, pattern in patterns.items():
        graph.add_node(aspect, pattern=pattern)
    totals: dict[tuple[int, int], float] = {}
    for (source, action, _), count in counts.items():
        totals[source, action] = totals.get((source, action), 0.0) + count
    for (source, action, target), count in sorted(counts.items()):
        probability = (count + concentration / n_aspects) / (totals[source, action] + concentration)
        graph.add_edge(source, target, key=action, action=action, probability=probability)
    return graph


def transitions_of_graph(graph: AspectTransitionGraph, concentration: float = 0.0) -> TransitionGraph:
    """Return the known transitions of an ATG; its nodes are the ATG's aspects."""
    patterns = dict(enumerate(graph.pattern_indices))
    return transition_graph(patterns, graph.counts, concentration, graph.assumptions.n_aspects)


def transitions_of_hypothesis(model: RecognitionModel, hypothesis: int) -> TransitionGraph:
    """Return the known transitions of a hypothesis with the tables in force; its nodes are the model's states."""
    states = np.flatnonzero(model.pattern_of[hypothesis] >= 0)
    patterns = {int(state): int(model.pattern_of[hypothesis, state]) for state in states if state != COLLECTION}
    edges = model.edges
    counts: dict[Edge, float] = {}
    for entry in np.flatnonzero(edges.hypothesis == hypothesis):
        edge = (int(edges.source[entry]), int(edges.action[entry]), int(edges.target[entry]))
        counts[edge] = counts.get(edge, 0.0) + float(edges.weight[entry])
    return transition_graph(patterns, counts, model.parameters.transition_concentration, model.n_aspects)


def goal_aspects(graph: TransitionGraph, goal: Goal) -> list[int]:
    """Return the known aspects that show the goal."""
    patterns = ((aspect, graph.nodes[aspect]["pattern"]) for aspect in graph)
    return [aspect for aspect, pattern in patterns if pattern is not None and goal.patterns[pattern]]


def reachable_aspects(graph: TransitionGraph, source: int) -> set[int]:
    """Return the aspects that known transitions can lead to from ``source``, itself included."""
    return set(_cheapest_paths(graph, source, "attempts"))


def shortest_path(graph: TransitionGraph, source: int, goal: Goal, cost: str = "attempts") -> GoalPath | None:
    """Return the path of least cost from an aspect to one that shows the goal, ``None`` if no known path leads there.

    Args:
        graph: Of known transitions.
        source: The aspect to begin at.
        goal: What the last aspect is to show.
        cost: Name in ``COSTS``.

    Raises:
        InvalidInputError: There is no such aspect, or no such cost.
    """
    paths = _cheapest_paths(graph, source, cost)
    reached = [paths[aspect] for aspect in goal_aspects(graph, goal) if aspect in paths]
    return min(reached, key=lambda path: path.cost) if reached else None


def nearest_aspect(graph: TransitionGraph, source: int, goal: Goal, cost: str = "attempts") -> GoalPath:
    """Return the path to the reachable aspect that is most like the goal; of several, the one of least cost."""

    def rank(path: GoalPath) -> tuple[int, float, tuple[int, ...]]:
        pattern = graph.nodes[path.aspects[-1]]["pattern"]
        return -goal.likeness(pattern) if pattern is not None else 0, path.cost, path.aspects

    return min(_cheapest_paths(graph, source, cost).values(), key=rank)


def action_costs(graph: TransitionGraph, targets: Collection[int], n_actions: int, cost: str) -> dict[int, FloatArray]:
    """Return, for each aspect, what it costs to get to one of ``targets`` by each first action, shape [A].

    That is the cost of the action's edge and of the shortest path from where it leads; ∞ where no known path leads on.
    """
    costs = {aspect: np.full(n_actions, np.inf) for aspect in graph}
    if not targets:
        return costs
    backwards = _cheapest_edges(graph, cost).reverse(copy=False)
    remaining = networkx.multi_source_dijkstra_path_length(backwards, set(targets), weight="cost")
    for source, target, edge in graph.edges(data=True):
        total = COSTS[cost](edge["probability"]) + remaining.get(target, np.inf)
        costs[source][edge["action"]] = min(costs[source][edge["action"]], total)
    return costs


def exploration_costs(graph: TransitionGraph, n_actions: int, cost: str) -> dict[int, FloatArray]:
    """Return, for each aspect, what it costs to try something new by each first action, shape [A].

    New is an action that was never tried from an aspect; it counts as one that succeeds. So is an aspect whose pattern
    is not known.
    """
    extended = graph.copy()
    for aspect in graph:
        tried = {action for _, _, action in graph.out_edges(aspect, keys=True)}
        for action in set(range(n_actions)) - tried:
            extended.add_edge(aspect, _UNTRIED, key=action, action=action, probability=1.0)
    targets = [aspect for aspect in graph if graph.nodes[aspect]["pattern"] is None]
    targets += [_UNTRIED] if _UNTRIED in extended else []
    costs = action_costs(extended, targets, n_actions, cost)
    costs.pop(_UNTRIED, None)
    return costs


def _cheapest_edges(graph: TransitionGraph, cost: str) -> networkx.DiGraph[int]:
    """Return the graph with only the action of least cost between each two aspects, and its ``cost`` on the edge."""
    if cost not in COSTS:
        raise unknown_name("cost of a path", cost, COSTS)
    cheapest: networkx.DiGraph[int] = networkx.DiGraph()
    cheapest.add_nodes_from(graph)
    for source, target, edge in graph.edges(data=True):
        price = COSTS[cost](edge["probability"])
        if not cheapest.has_edge(source, target) or price < cheapest.edges[source, target]["cost"]:
            cheapest.add_edge(source, target, cost=price, **edge)
    return cheapest


def _cheapest_paths(graph: TransitionGraph, source: int, cost: str) -> dict[int, GoalPath]:
    """Return the path of least cost from an aspect to each that can be reached, itself included."""
    if source not in graph:
        raise InvalidInputError(f"aspect: {source!r}; expected one of {sorted(graph)}")
    best = _cheapest_edges(graph, cost)
    ways = networkx.single_source_dijkstra_path(best, source, weight="cost")
    return {aspect: _path(best, way) for aspect, way in ways.items()}


def _path(best: networkx.DiGraph[int], aspects: list[int]) -> GoalPath:
    edges = [best.edges[edge] for edge in itertools.pairwise(aspects)]
    return GoalPath(
        tuple(aspects),
        tuple(edge["action"] for edge in edges),
        math.fsum(edge["cost"] for edge in edges),
        math.prod(edge["probability"] for edge in edges),
    )
