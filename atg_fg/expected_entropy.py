"""Expected entropy of identity (eq. 3) from the joint of object and next pattern.

For one object and one action p(O = i, z | a) takes few values: one for all patterns that the object does not know,
one for those it knows but to which no counted edge leads, and another for each target of an edge. So about one
logarithm a known edge is enough where the sum over all objects and patterns has |A|·H·|𝒵| of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from atg_fg.belief import x_log_x
from atg_fg.model import RecognitionModel
from atg_fg.patterns import FloatArray, IntArray


class Targets(NamedTuple):
    """The distinct (action, hypothesis, state) that a counted edge leads to, all arrays of shape [R]."""

    action: IntArray
    hypothesis: IntArray
    state: IntArray


class NextPatternJoint(NamedTuple):
    """p(O = i, z_{t+1} | a, z_0:t) for a single pattern z of each kind.

    Attributes:
        unknown: For a pattern the object does not know, shape [A, H].
        unreached: For a pattern it knows and to which no counted edge leads, shape [A, H].
        targets: The states that counted edges lead to.
        reached: For the pattern of each target, shape [R].
    """

    unknown: FloatArray
    unreached: FloatArray
    targets: Targets
    reached: FloatArray


def expected_entropies(model: RecognitionModel, joint: NextPatternJoint, unseen: float) -> FloatArray:
    """Return Σ_z p(z|a) H(O|z) = Σ_z p ln p − Σ_i Σ_z J ln J + p(unseen) ln U for J = p(O = i, z | a), shape [A].

    Args:
        model: The tables in force.
        joint: J.
        unseen: p(unseen | z_0:t).
    """
    targets = joint.targets
    excess = joint.reached - joint.unreached[targets.action, targets.hypothesis]
    cells = targets.action * model.n_patterns + model.pattern_of[targets.hypothesis, targets.state]
    shape = (model.n_actions, model.n_patterns)
    predictive = joint.unknown @ model.unknown + joint.unreached @ model.known
    predictive += np.bincount(cells, weights=excess, minlength=shape[0] * shape[1]).reshape(shape)
    # Subtracting may leave a rounding error below zero.
    np.maximum(predictive, 0.0, out=predictive)

    unreached = x_log_x(joint.unreached)
    reached = x_log_x(joint.reached) - unreached[targets.action, targets.hypothesis]
    joint_terms = (
        unreached @ model.n_known
        + x_log_x(joint.unknown) @ (model.n_patterns - model.n_known)
        + np.bincount(targets.action, weights=reached, minlength=model.n_actions)
    )
    entropies: FloatArray = x_log_x(predictive).sum(axis=1) - joint_terms + unseen * np.log(model.n_unseen)
    return np.maximum(entropies, 0.0)
