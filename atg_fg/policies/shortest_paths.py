"""Paths to a goal over what is known of one object: reachable aspects, shortest paths, and what is not yet tried.

Every function takes a *transition graph*: a networkx multigraph with an aspect's ``pattern`` (index, or ``None`` if not
known) on each node and, on each edge, keyed by its ``action``, the ``probability`` that the action leads there.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.goals import Goal
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.known_transitions import TransitionGraph

if TYPE_CHECKING:
    import networkx

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
    import networkx  # it takes a tenth of a second

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
    import networkx  # it takes a tenth of a second

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
    import networkx  # it takes a tenth of a second

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
