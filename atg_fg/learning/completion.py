"""What a structure says of an object that it does not know from observation: poses never seen, and what they show."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.inference.known_transitions import TransitionGraph
from atg_fg.learning.believed_structure import BelievedStructure
from atg_fg.learning.rates import Rates
from atg_fg.learning.register_contents import symbol_probabilities
from atg_fg.learning.shared_structure import Poses
from atg_fg.learning.structured_memory import StructuredMemory

if TYPE_CHECKING:
    import networkx

#: Nodes are the observed aspects by index, and "pose-3" for a pose that shows none of them.
CompletedGraph: TypeAlias = "networkx.MultiDiGraph[int | str]"
#: What is known of a node or an edge of a completed ATG.
OBSERVED: Final = "observed"
PREDICTED: Final = "predicted"
UNKNOWN: Final = "unknown"


def pose_graph(poses: Poses, contents: FloatArray, rates: Rates, alphabet: PatternAlphabet) -> TransitionGraph:
    """Return the transitions between all poses of an object, for planning; its nodes are the poses.

    A pose has the ``pattern`` that it most probably shows, with its ``probability``, or ``None`` if no pattern is more
    probable than all others together.

    Args:
        poses: Of the structure.
        contents: Of the object's registers as far as they are known, shape [P, S].
        rates: Slips and repeated symbols.
        alphabet: The patterns.
    """
    import networkx  # it takes a tenth of a second

    probability, patterns = most_probable_patterns(poses, contents, rates, alphabet)
    graph: TransitionGraph = networkx.MultiDiGraph()
    for pose, (pattern, certainty) in enumerate(zip(patterns.tolist(), probability.tolist(), strict=True)):
        graph.add_node(pose, pattern=pattern if certainty > 0.5 else None, probability=certainty)
    for pose, successors in enumerate(poses.successors.tolist()):
        for action, successor in enumerate(successors):
            graph.add_edge(pose, successor, key=action, action=action, probability=1.0 - rates.slip)
    return graph


def most_probable_patterns(
    poses: Poses, contents: FloatArray, rates: Rates, alphabet: PatternAlphabet
) -> tuple[FloatArray, FloatArray]:
    """Return the probability and the index of the pattern that each pose most probably shows, both of shape [G]."""
    shown = symbol_probabilities(contents, rates.repeat)[poses.registers[:, : len(alphabet.slots)]]
    joint = np.ones((len(shown), len(alphabet)))
    for slot, symbols in enumerate(alphabet.symbols.T):
        joint *= shown[:, slot, symbols]
    joint /= np.maximum(joint.sum(axis=1, keepdims=True), np.finfo(float).tiny)
    best = joint.argmax(axis=1)
    return joint[np.arange(len(joint)), best], best


def completed_atg(
    memory: StructuredMemory, name: str, believed: Sequence[BelievedStructure] | None = None
) -> CompletedGraph:
    """Return the ATG of a remembered object with what the structure that it most probably follows predicts.

    A pose that most probably shows the pattern of an observed aspect is that aspect; of the others each is a node.
    Attributes of a node:

    * ``status``: ``observed``; ``predicted`` where a pattern not yet observed is more probable than all others
      together; ``unknown`` for a pose whose pattern is not known yet.
    * ``pattern``: A symbol a slot, ``None`` if it is not known.
    * ``symbols``: The same, but ``None`` only in those slots whose symbol is not known.
    * ``probability``: 1 if observed, else p(the object follows the structure) · p(pattern | it does); for an unknown
      pose the first factor alone, that there is such an aspect.
    * ``poses``: Those that the node stands for; none for an observed aspect that the structure does not explain.

    Attributes of an edge: ``action``, by name, ``observed``, ``count``, which is 0 if predicted, and ``probability``: 1
    if observed, else p(the object follows the structure) · (1 − slip). A transition that was observed is not predicted
    once more. The graph's attributes are its ``name``, ``follows``, the probability that the object follows the
    structure, and the number of its ``poses``; both are 0 if no structure is believed in.

    Args:
        memory: With the structures that it believes in.
        name: Of an ATG in it.
        believed: What ``memory.learner.believed(memory.names)`` says, if it is at hand.

    Raises:
        UnknownNameError: There is no such ATG.
    """
    graph, position = memory[name], memory.names.index(name)
    completed = _observed(graph)
    options = memory.learner.believed(memory.names) if believed is None else believed
    if options:
        best = max(options, key=lambda each: each.weight * each.followers[position])
        follows = float(best.weight * best.followers[position])
        poses = best.structure.poses()
        completed.graph.update(follows=follows, poses=len(poses.registers))
        if follows > 0:
            rates = memory.learner.rates
            nodes = _add_poses(completed, graph, poses, best.contents[position], rates)
            _add_predicted_edges(completed, graph, poses, nodes, follows * (1.0 - rates.slip))
    return completed


def _observed(graph: AspectTransitionGraph) -> CompletedGraph:
    """Return what was observed of an object, marked as such."""
    import networkx  # it takes a tenth of a second

    completed: CompletedGraph = networkx.MultiDiGraph(name=graph.name, follows=0.0, poses=0)
    for aspect, pattern in enumerate(graph.aspects):
        completed.add_node(aspect, status=OBSERVED, pattern=pattern, symbols=pattern, probability=1.0, poses=())
    for (source, action, target), count in sorted(graph.counts.items()):
        name = graph.assumptions.actions[action]
        completed.add_edge(source, target, key=name, action=name, observed=True, count=count, probability=1.0)
    return completed


def _add_poses(
    completed: CompletedGraph, graph: AspectTransitionGraph, poses: Poses, contents: FloatArray, rates: Rates
) -> list[int | str]:
    """Add a node for each pose that is no observed aspect; return the node of each pose."""
    alphabet, follows = graph.assumptions.alphabet, completed.graph["follows"]
    probability, patterns = most_probable_patterns(poses, contents, rates, alphabet)
    shown = symbol_probabilities(contents, rates.repeat)[poses.registers[:, : len(alphabet.slots)]]
    nodes: list[int | str] = []
    for pose, (certainty, pattern) in enumerate(zip(probability.tolist(), patterns.tolist(), strict=True)):
        is_known = certainty > 0.5
        aspect = graph.aspect_showing(pattern) if is_known else None
        if aspect is not None:
            completed.nodes[aspect]["poses"] += (pose,)
            nodes.append(aspect)
            continue
        of_slots = zip(shown[pose].argmax(axis=1).tolist(), shown[pose].max(axis=1).tolist(), strict=True)
        symbols = tuple(symbol if best > 0.5 else None for symbol, best in of_slots)
        attributes: dict[str, Any] = {
            "status": PREDICTED if is_known else UNKNOWN,
            "pattern": alphabet.patterns[pattern] if is_known else None,
            "symbols": alphabet.patterns[pattern] if is_known else symbols,
            "probability": follows * certainty if is_known else follows,
            "poses": (pose,),
        }
        completed.add_node(f"pose-{pose}", **attributes)
        nodes.append(f"pose-{pose}")
    return nodes


def _add_predicted_edges(
    completed: CompletedGraph,
    graph: AspectTransitionGraph,
    poses: Poses,
    nodes: Sequence[int | str],
    probability: float,
) -> None:
    """Add the transitions between poses that were not observed; poses that show the same share the probability."""
    n_poses = Counter(nodes)
    predicted: defaultdict[tuple[int | str, int | str, str], float] = defaultdict(float)
    for pose, successors in enumerate(poses.successors.tolist()):
        for action, successor in enumerate(successors):
            edge = (nodes[pose], nodes[successor], graph.assumptions.actions[action])
            predicted[edge] += probability / n_poses[nodes[pose]]
    for (source, target, name), certainty in predicted.items():
        if not completed.has_edge(source, target, key=name):
            completed.add_edge(source, target, key=name, action=name, observed=False, count=0, probability=certainty)


def statuses(completed: CompletedGraph) -> dict[str, int]:
    """Return how many aspects of a completed ATG are observed, predicted and unknown."""
    counts: Counter[str] = Counter(data["status"] for _, data in completed.nodes(data=True))
    return {status: counts[status] for status in (OBSERVED, PREDICTED, UNKNOWN)}
