"""The transitions that are known of one object, as a graph to plan on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from atg_fg.core.aspect_graph import AspectTransitionGraph, Edge
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel

if TYPE_CHECKING:
    import networkx

TransitionGraph: TypeAlias = "networkx.MultiDiGraph[int]"


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
    import networkx  # it takes a tenth of a second

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
