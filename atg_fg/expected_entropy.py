"""Expected entropy of identity (eq. 3) from the joint of object and next pattern.

For one object and one action p(O = i, z | a) takes few values: one for all patterns that the object does not know,
one for those it knows but to which no counted edge leads, and another for each target of an edge. So about one
logarithm a known edge is enough where the sum over all objects and patterns has |A|·H·|𝒵| of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from atg_fg.belief import x_log_x
from atg_fg.model import COLLECTION, RecognitionModel
from atg_fg.patterns import FloatArray, IntArray


class Targets(NamedTuple):
    """The distinct (action, hypothesis, state) that a counted edge leads to, all arrays of shape [R]."""

    action: IntArray
    hypothesis: IntArray
    state: IntArray


class NextPatternJoint(NamedTuple):
    """p(O = i, z_{t+1} | a, z_0:t) for a single pattern z of each kind; more axes are more beliefs.

    Attributes:
        unknown: For a pattern the object does not know, shape [..., A, H].
        unreached: For a pattern it knows and to which no counted edge leads, shape [..., A, H].
        targets: The states that counted edges lead to.
        reached: For the pattern of each target, shape [..., R].
    """

    unknown: FloatArray
    unreached: FloatArray
    targets: Targets
    reached: FloatArray


def expected_entropies(model: RecognitionModel, joint: NextPatternJoint, unseen: float | FloatArray) -> FloatArray:
    """Return Σ_z p(z|a) H(O|z) = Σ_z p ln p − Σ_i Σ_z J ln J + p(unseen) ln U for J = p(O = i, z | a), shape [..., A].

    Args:
        model: The tables in force.
        joint: J.
        unseen: p(unseen | z_0:t), a number or of shape [..., 1].
    """
    targets = joint.targets
    of_target = joint.unreached[..., targets.action, targets.hypothesis]
    cells = targets.action * model.n_patterns + model.pattern_of[targets.hypothesis, targets.state]
    shape = (*joint.unreached.shape[:-1], model.n_patterns)
    flat = (-1, model.n_hypotheses)
    predictive = joint.unknown.reshape(flat) @ model.unknown + joint.unreached.reshape(flat) @ model.known
    predictive = predictive.reshape(shape)
    predictive += sums(joint.reached - of_target, cells, shape[-2] * shape[-1]).reshape(shape)
    # Subtracting may leave a rounding error below zero.
    np.maximum(predictive, 0.0, out=predictive)

    unreached = x_log_x(joint.unreached)
    reached = x_log_x(joint.reached) - unreached[..., targets.action, targets.hypothesis]
    joint_terms = (
        unreached @ model.n_known
        + x_log_x(joint.unknown) @ (model.n_patterns - model.n_known)
        + sums(reached, targets.action, model.n_actions)
    )
    entropies: FloatArray = x_log_x(predictive).sum(axis=-1) - joint_terms + unseen * np.log(model.n_unseen)
    return np.maximum(entropies, 0.0)


def sums(weights: FloatArray, cells: IntArray, n_cells: int) -> FloatArray:
    """Return the sum of all ``weights`` [..., R] whose cell, ``cells`` [R], is the same, shape [..., n_cells]."""
    n_rows = int(np.prod(weights.shape[:-1]))
    everywhere = (n_cells * np.arange(n_rows)[:, None] + cells).ravel()
    summed = np.bincount(everywhere, weights=weights.ravel(), minlength=n_rows * n_cells)
    return summed.astype(np.float64).reshape(*weights.shape[:-1], n_cells)


def edge_arrivals(model: RecognitionModel, mass: FloatArray) -> FloatArray:
    """Return the part of ``mass`` [H, W] that counted edges carry to each state under each action, [A, H, W]."""
    edges = model.edges
    shape = (model.n_actions, model.n_hypotheses, model.n_states)
    carried = mass[edges.hypothesis, edges.source] * model.edge_probability
    arrivals = np.bincount(model.edge_cells, weights=carried, minlength=int(np.prod(shape)))
    return arrivals.astype(np.float64).reshape(shape)


def next_pattern_joint(model: RecognitionModel, mass: FloatArray) -> NextPatternJoint:
    """Return p(O = i, z | a) of each action.

    Args:
        model: The tables in force.
        mass: p(O, X_t | z_0:t), or an approximation of it, shape [H, W].
    """
    observed = 1.0 - model.parameters.observation_noise
    noise = model.parameters.observation_noise / model.n_patterns * mass.sum(axis=1)
    kept = np.einsum("hx,ahx->ah", mass, model.stay)
    unreached = kept * (observed / model.n_aspects) + noise
    arrivals = edge_arrivals(model, mass)
    reached = np.flatnonzero(arrivals)
    targets = Targets(*np.unravel_index(reached, arrivals.shape))
    return NextPatternJoint(
        unknown=kept * model.base[:, COLLECTION] * model.unknown_rate + noise,
        unreached=unreached,
        targets=targets,
        reached=unreached[targets.action, targets.hypothesis] + observed * arrivals.ravel()[reached],
    )


def pattern_table(model: RecognitionModel, joint: NextPatternJoint, hypotheses: IntArray) -> FloatArray:
    """Return J = p(O = i, z | a) of every pattern, shape [A, I, |𝒵|], for the I ``hypotheses`` in question."""
    table: FloatArray = (
        joint.unknown[:, hypotheses, None] * model.unknown[hypotheses]
        + joint.unreached[:, hypotheses, None] * model.known[hypotheses]
    )
    place = np.full(model.n_hypotheses, -1)
    place[hypotheses] = np.arange(len(hypotheses))
    action, hypothesis, state = joint.targets
    chosen = place[hypothesis] >= 0
    patterns = model.pattern_of[hypothesis, state][chosen]
    table[action[chosen], place[hypothesis[chosen]], patterns] = joint.reached[chosen]
    return table


def expected_entropies_of_table(table: FloatArray, unseen: float, n_unseen: int) -> FloatArray:
    """Return eq. 3 for each action in nats, shape [A], from J = p(O = i, z | a) of every pattern, shape [A, H, |𝒵|].

    Args:
        table: J; its last hypothesis is *unseen*.
        unseen: p(unseen | z_0:t).
        n_unseen: U.
    """
    terms = x_log_x(table.sum(axis=1)).sum(axis=1) - x_log_x(table).sum(axis=(1, 2))
    entropies: FloatArray = terms + unseen * np.log(n_unseen)
    return np.maximum(entropies, 0.0)


def expected_entropies_of(model: RecognitionModel, mass: FloatArray) -> FloatArray:
    """Return eq. 3 for each action in nats, shape [A], from a belief over object and present aspect.

    Args:
        model: The tables in force.
        mass: p(O, X_t | z_0:t), or an approximation of it that sums to one, shape [H, W].
    """
    return expected_entropies(model, next_pattern_joint(model, mass), float(mass.sum(axis=1)[-1]))
