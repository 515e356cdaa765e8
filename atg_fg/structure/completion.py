"""What a structure says of an object that it does not know from observation: poses never seen, and what they show."""

from __future__ import annotations

import networkx
import numpy as np

from atg_fg.goal_planning import TransitionGraph
from atg_fg.patterns import FloatArray, PatternAlphabet
from atg_fg.structure.contents import symbol_probabilities
from atg_fg.structure.rates import Rates
from atg_fg.structure.shared_structure import Poses


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
