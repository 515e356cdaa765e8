"""Where the aspects of a completed ATG are drawn: in rings, so that most of its many transitions are short.

Turning an object on and on by one action comes back to where it began: the aspects on such a way are a ring. The
rings stand on a circle, in the order and turned the way that makes the transitions between them short.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Final, TypeAlias

import networkx
import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.learning.completion import CompletedGraph

Node: TypeAlias = int | str
#: Room that an aspect takes up, in units of the picture.
SPACING: Final = 1.9
_GAP: Final = 1.0
#: A line that is less than this from the middle of an aspect touches it, and is as bad as one that is longer by this.
_CLEAR: Final = 0.85
_PENALTY: Final = 8.0
#: A larger ring is no help to the eye.
_MAX_RING: Final = 8
#: Up to so many rings all their orders are tried.
_MAX_ORDERED: Final = 7
_MAX_SWEEPS: Final = 20


def ring_layout(graph: CompletedGraph, actions: Sequence[str]) -> dict[Node, FloatArray]:
    """Return the place of each aspect, shape [2]; the middle of the picture is at the origin.

    Args:
        graph: A completed ATG.
        actions: Their names, in the order in which they are tried for making rings.
    """
    rings = max((_rings(graph, action) for action in actions), key=lambda found: _n_inside(graph, found))
    number = {node: ring for ring, members in enumerate(rings) for node in members}
    between = [(source, target) for source, target in graph.edges() if number[source] != number[target]]
    links = np.zeros((len(rings), len(rings)))
    for source, target in between:
        links[number[source], number[target]] += 1
    order = _order(links + links.T)
    middles = _middles([rings[ring] for ring in order])
    places: dict[Node, FloatArray] = {}
    for ring, middle in zip(order, middles, strict=True):
        places.update(_around(rings[ring], middle, 0.0))
    _turn_rings(places, [rings[ring] for ring in order], middles, between)
    return places


def _rings(graph: CompletedGraph, action: str) -> list[list[Node]]:
    """Return the ways that repeat one action, each in its order."""
    own: networkx.DiGraph[Node] = networkx.DiGraph()
    own.add_nodes_from(graph)
    own.add_edges_from((source, target) for source, target, data in graph.edges(data=True) if data["action"] == action)
    rings = []
    for component in networkx.weakly_connected_components(own):
        members = [node for node in graph if node in component]
        first = min(members, key=own.in_degree)
        walk = list(networkx.dfs_preorder_nodes(own, first))
        rings.append(walk + [node for node in members if node not in walk])
    return rings


def _n_inside(graph: CompletedGraph, rings: Sequence[Sequence[Node]]) -> int:
    """Return how many transitions stay in one of the rings that are small enough."""
    number = {node: ring for ring, members in enumerate(rings) for node in members if len(members) <= _MAX_RING}
    return sum(number.get(source, -1) == number.get(target, -2) for source, target in graph.edges())


def _order(links: FloatArray) -> list[int]:
    """Return the order of rings on the circle in which those with many transitions between them are near each other.

    Args:
        links: Transitions between each two rings, shape [R, R].
    """
    n_rings = len(links)
    apart = np.arange(n_rings)[:, None] - np.arange(n_rings)
    distances = np.abs(np.sin(np.pi * apart / max(n_rings, 1)))

    def length(order: Sequence[int]) -> float:
        return float((links[np.ix_(order, order)] * distances).sum())

    if n_rings <= _MAX_ORDERED:
        orders = ([0, *rest] for rest in itertools.permutations(range(1, n_rings)))
        return min(orders, key=lambda order: round(length(order), 9))
    best = list(range(n_rings))
    for _ in range(_MAX_SWEEPS):
        before = length(best)
        for one, other in itertools.combinations(range(n_rings), 2):
            swapped = best.copy()
            swapped[one], swapped[other] = best[other], best[one]
            if length(swapped) < length(best) - 1e-9:
                best = swapped
        if length(best) == before:
            break
    return best


def _radius(ring: Sequence[Node]) -> float:
    return 0.0 if len(ring) == 1 else SPACING / (2 * np.sin(np.pi / len(ring)))


def _middles(rings: Sequence[Sequence[Node]]) -> list[FloatArray]:
    """Return the middle of each ring, on a circle in which neighbours do not touch; of the only one, the origin."""
    if len(rings) == 1:
        return [np.zeros(2)]
    widths = [2 * (_radius(ring) + _GAP) for ring in rings]
    radius = max(widths) / (2 * np.sin(np.pi / len(rings)))
    angles = np.pi / 2 - 2 * np.pi * np.arange(len(rings)) / len(rings)
    return [radius * np.array([np.cos(angle), np.sin(angle)]) for angle in angles]


def _around(ring: Sequence[Node], middle: FloatArray, turn: float) -> dict[Node, FloatArray]:
    """Return the places of a ring's members, the first of them at the angle ``turn`` from the top, in radians."""
    angles = np.pi / 2 + turn - 2 * np.pi * np.arange(len(ring)) / len(ring)
    spots = middle + _radius(ring) * np.column_stack((np.cos(angles), np.sin(angles)))
    return dict(zip(ring, spots, strict=True))


def _turn_rings(
    places: dict[Node, FloatArray],
    rings: Sequence[Sequence[Node]],
    middles: Sequence[FloatArray],
    between: Sequence[tuple[Node, Node]],
) -> None:
    """Turn one ring after the other, in place, as long as that makes the transitions between rings plainer."""
    best = _clutter(places, between)
    for _ in range(_MAX_SWEEPS):
        before = best
        for ring, middle in zip(rings, middles, strict=True):
            # Half steps too: a ring of four may stand on its corner or on its side.
            for step in range(2 * len(ring)):
                turned = {**places, **_around(ring, middle, np.pi * step / len(ring))}
                clutter = _clutter(turned, between)
                if clutter < best - 1e-6:
                    best = clutter
                    places.update(turned)
        if best == before:
            return


def _clutter(places: dict[Node, FloatArray], edges: Sequence[tuple[Node, Node]]) -> float:
    """Return the length of all edges together, and more for each aspect that one of them passes behind."""
    if not edges:
        return 0.0
    spots = np.array(list(places.values()))
    starts, ends = (np.array([places[edge[end]] for edge in edges]) for end in (0, 1))
    spans = ends - starts
    squares = (spans**2).sum(axis=1)
    offsets = spots[None] - starts[:, None]
    along = np.clip((offsets * spans[:, None]).sum(axis=2) / squares[:, None], 0.0, 1.0)
    nearest = np.sqrt(((offsets - along[..., None] * spans[:, None]) ** 2).sum(axis=2))
    # Its own ends are as near as can be, the same for all ways to turn.
    behind = np.maximum(_CLEAR - nearest, 0.0).sum() / _CLEAR
    return float(np.sqrt(squares).sum() + _PENALTY * behind)
