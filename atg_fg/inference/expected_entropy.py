"""Expected entropy of identity (eq. 3) from the joint of object and next pattern.

For one object and one action p(O = i, z | a) takes few values: one for all patterns that the object does not know,
one for those it knows but to which no counted edge leads, and another for each target of an edge. So about one
logarithm a known edge is enough where the sum over all objects and patterns has |A|·H·|𝒵| of them.

Where an action reveals something of the object as a whole, such as its weight, the entropy is that of identity given
the next pattern and the reading r, which are independent given O:

    E[H(O | z, r)] = Σ_z ∫ p(z, r) ln p(z, r) dr − Σ_i Σ_z J ln J − Σ_i p(i) ∫ p(r | i) ln p(r | i) dr + p(unseen) ln U
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.log_math import x_log_x
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.object_tables import Readings
from atg_fg.inference.recognition_model import RecognitionModel


class NextPatternJoint(NamedTuple):
    """J = p(O = i, z_{t+1} | a, z_0:t) for a single pattern z of each kind; more axes are more beliefs.

    Attributes:
        unknown: For a pattern the object does not know, shape [..., A, H].
        unreached: For a pattern it knows and to which no counted edge leads, shape [..., A, H].
        reached: For the pattern of each of the model's targets, shape [..., R].
    """

    unknown: FloatArray
    unreached: FloatArray
    reached: FloatArray

    @classmethod
    def of(cls, model: RecognitionModel, total: FloatArray, kept: FloatArray, arrived: FloatArray) -> NextPatternJoint:
        """Return J from what becomes of the belief.

        Args:
            model: The tables in force.
            total: p(O), shape [..., 1, H].
            kept: The part that the transition rows leave to their base, shape [..., A, H].
            arrived: The part that counted edges carry to each target, shape [..., R].
        """
        observed = 1.0 - model.parameters.observation_noise
        noise = model.parameters.observation_noise / model.n_patterns * total
        unreached = kept * (observed / model.n_aspects) + noise
        return cls(
            unknown=kept * model.base_collection_rate + noise,
            unreached=unreached,
            reached=_of_targets(model, unreached) + observed * arrived,
        )


def expected_entropies(model: RecognitionModel, joint: NextPatternJoint, unseen: float | FloatArray) -> FloatArray:
    """Return Σ_z p(z|a) H(O|z) = Σ_z p ln p − Σ_i Σ_z J ln J + p(unseen) ln U for J = p(O = i, z | a), shape [..., A].

    Args:
        model: The tables in force.
        joint: J.
        unseen: p(unseen | z_0:t), a number or of shape [..., 1].
    """
    predictive = _predictive(model, joint)
    unreached, reached, unknown = x_log_x(joint.unreached), x_log_x(joint.reached), x_log_x(joint.unknown)
    joint_terms = (
        np.vecdot(unreached, model.n_unreached)
        + unknown @ model.n_lacking
        + _sums(reached, model.targets.action, model.n_actions)
    )
    entropies: FloatArray = x_log_x(predictive).sum(axis=-1) - joint_terms + unseen * np.log(model.n_unseen)
    if model.objects.senses and joint.unknown.ndim == 2:
        # Of the patterns that nobody knows one stands for all.
        is_known = model.knows.any(axis=0)
        columns = np.append(np.flatnonzero(is_known), np.flatnonzero(~is_known)[:1])
        times = np.where(is_known[columns], 1.0, np.count_nonzero(~is_known))
        everyone = np.arange(model.n_hypotheses)
        table = pattern_table(model, joint, everyone)[:, :, columns]
        entropies = counting_readings(model, entropies, table, times, everyone)
    return np.maximum(entropies, 0.0)


def counting_readings(
    model: RecognitionModel, entropies: FloatArray, table: FloatArray, times: FloatArray, hypotheses: IntArray
) -> FloatArray:
    """Return expected entropies, shape [A], of which those of actions that reveal readings of the object count on them.

    The sum over readings is off by less than 1e-6 nats (``ObjectTables.readings``).

    Args:
        model: The tables in force.
        entropies: Without readings, shape [A].
        table: J = p(O = i, z | a) of a single pattern of each kind, shape [A, I, L]; *unseen* last.
        times: How many patterns there are of each kind, shape [L].
        hypotheses: That J is of, shape [I].
    """
    result = entropies.copy()
    of_senses: dict[tuple[int, ...], Readings] = {}
    objects = model.objects.restricted(hypotheses)
    for action, name in enumerate(model.memory.assumptions.actions):
        numbers = objects.revealed_by(name)
        if not numbers:
            continue
        joint = table[action]
        identity = joint @ times
        readings = of_senses.setdefault(numbers, objects.readings(numbers, identity))
        likely = identity > 0
        predictive = readings.densities[:, likely] @ joint[likely]
        both = float(readings.weights @ (x_log_x(predictive) @ times))
        given = float((x_log_x(joint) @ times).sum() + identity @ readings.neg_entropies)
        result[action] = both - given + float(identity[-1]) * math.log(model.n_unseen)
    floor: FloatArray = np.maximum(result, 0.0)
    return floor


def _predictive(model: RecognitionModel, joint: NextPatternJoint) -> FloatArray:
    """Return p(z | a), shape [..., A, |𝒵|]: as if all objects knew none, and what it is more where they know it."""
    unknown, unreached, reached = joint
    predictive = unknown.sum(axis=-1)[..., None] + (unreached - unknown) @ model.knows
    excess = _sums(reached - _of_targets(model, unreached), model.targets.pattern, model.n_actions * model.n_patterns)
    predictive += excess.reshape(predictive.shape)
    # Subtracting may leave a rounding error below zero.
    nowhere_negative: FloatArray = np.maximum(predictive, 0.0)
    return nowhere_negative


def _of_targets(model: RecognitionModel, values: FloatArray) -> FloatArray:
    """Return those of ``values`` [..., A, H] that are of the action and hypothesis of each target, [..., R]."""
    flat = values.reshape(*values.shape[:-2], -1)
    return flat.take(model.targets.row, axis=-1)


def _sums(weights: FloatArray, cells: IntArray, n_cells: int) -> FloatArray:
    """Return the sum of all ``weights`` [..., R] whose cell, ``cells`` [R], is the same, shape [..., n_cells]."""
    n_rows = math.prod(weights.shape[:-1])
    if n_rows != 1:
        cells = (n_cells * np.arange(n_rows)[:, None] + cells).ravel()
    summed = np.bincount(cells, weights=weights.ravel(), minlength=n_rows * n_cells)
    return summed.astype(np.float64, copy=False).reshape(*weights.shape[:-1], n_cells)


def arrivals(model: RecognitionModel, mass: FloatArray) -> FloatArray:
    """Return the part of ``mass`` [H, W] that counted edges carry to each of the model's targets, shape [R]."""
    carried = mass.ravel()[model.edge_source] * model.edge_probability
    return _sums(carried, model.edge_target, len(model.targets.row))


def next_pattern_joint(model: RecognitionModel, mass: FloatArray) -> NextPatternJoint:
    """Return p(O = i, z | a) of each action.

    Args:
        model: The tables in force.
        mass: p(O, X_t | z_0:t), or an approximation of it, shape [H, W].
    """
    kept = np.vecdot(mass, model.prior_weight)
    return NextPatternJoint.of(model, mass @ np.ones(model.n_states), kept, arrivals(model, mass))


def pattern_table(model: RecognitionModel, joint: NextPatternJoint, hypotheses: IntArray) -> FloatArray:
    """Return J = p(O = i, z | a) of every pattern, shape [A, I, |𝒵|], for the I ``hypotheses`` in question."""
    table: FloatArray = (
        joint.unknown[:, hypotheses, None] * model.lacks[hypotheses]
        + joint.unreached[:, hypotheses, None] * model.knows[hypotheses]
    )
    place = np.full(model.n_hypotheses, -1)
    place[hypotheses] = np.arange(len(hypotheses))
    action, hypothesis, state = model.targets[:3]
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
    return expected_entropies(model, next_pattern_joint(model, mass), float(mass[-1].sum()))


#: Costs or expected entropies closer than this are a tie.
TIE_TOLERANCE: Final = 1e-9


def best_actions(costs: FloatArray) -> list[int]:
    """Return all actions whose cost, such as the expected entropy, is the least, up to ``TIE_TOLERANCE``."""
    values = costs.tolist()
    least = min(values) + TIE_TOLERANCE
    return [action for action, value in enumerate(values) if value <= least]
