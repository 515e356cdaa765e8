"""What a planner needs of a belief: which objects there may be before the robot, and where it may be in what it knows.

An engine with another model than plain ATGs overrides ``Inference.belief_components`` and
``Inference.shown_patterns``; the planners need not know.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.inference.known_transitions import TransitionGraph, transitions_of_hypothesis
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel

#: Objects less probable than this do not sway a plan.
LEAST_PROBABILITY: Final = 1e-3


class BeliefComponent(NamedTuple):
    """One thing that the object may be, and what is known of it.

    Attributes:
        hypothesis: State of O.
        probability: p(hypothesis | z_0:t, a_1:t), or a part of it where there is more than one way to be that object.
        graph: The transitions that are known of it.
        belief: p(aspect | hypothesis, z_0:t, a_1:t) of nodes; the rest, up to one, is on no node of the graph.
    """

    hypothesis: int
    probability: float
    graph: TransitionGraph
    belief: Mapping[int, float]


def components_of(model: RecognitionModel, belief: FloatArray) -> list[BeliefComponent]:
    """Return the component of each hypothesis that is not improbable.

    Args:
        model: The tables in force.
        belief: p(O, X_t | z_0:t, a_1:t), shape [H, W].
    """
    probabilities = belief.sum(axis=1)
    components = []
    for hypothesis in np.flatnonzero(probabilities >= LEAST_PROBABILITY).tolist():
        graph = transitions_of_hypothesis(model, hypothesis)
        given = belief[hypothesis] / probabilities[hypothesis]
        aspects = {aspect: float(given[aspect]) for aspect in graph}
        components.append(BeliefComponent(hypothesis, float(probabilities[hypothesis]), graph, aspects))
    return components


def shown_patterns_of(model: RecognitionModel, belief: FloatArray, evidence: Evidence) -> FloatArray:
    """Return the probability that the object shows each pattern now, shape [|𝒵|].

    Args:
        model: The tables in force.
        belief: p(O, X_t | z_0:t, a_1:t), after the look, shape [H, W].
        evidence: Of the look.
    """
    known = model.pattern_of >= 0
    shown = np.bincount(model.pattern_of[known], belief[known], model.n_patterns).astype(np.float64)
    # An aspect in the collection node shows a pattern that the object is not known to show; the evidence weighs these.
    noise = model.parameters.observation_noise
    agrees = (1.0 - noise) * evidence.likelihood + noise * evidence.likelihood.mean()
    unknown = model.lacks @ agrees
    share = np.divide(belief[:, COLLECTION], unknown, out=np.zeros_like(unknown), where=unknown > 0)
    shown += agrees * (share @ model.lacks)
    return shown
