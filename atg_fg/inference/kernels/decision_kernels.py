"""The decision of a Bayes filter over object and aspect: eq. 3 of all actions in one loop over the hypotheses.

``atg_fg.inference.expected_entropy`` says which values x the joint of object and next pattern takes. They are put into
blocks, whose x ln x are added up in a loop that the compiler turns into operations on several numbers at once. This
module loads Numba.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference.kernels.compilation import compiled, reordered

#: Smallest normal number, in place of zero under a logarithm: x ln x of what is below it is zero up to rounding.
_LEAST: Final = float(np.finfo(np.float64).tiny)

#: Values of an action in a block: they stay in the processor's nearest cache until their logarithms are taken.
_BLOCK: Final = 256

#: The bits of √½, and how many of a number's bits there are below its exponent.
_ROOT_OF_HALF: Final = int(np.array(np.sqrt(0.5)).view(np.int64))
_MANTISSA: Final = 52

_LN_2: Final = float(np.log(2.0))


@reordered
def logarithm(number: float) -> float:
    """Return ln of a normal number, with errors of a few units in the last place.

    It has no branches, and is no call of a library, so that a loop takes many at once. With number = 2^e m, m from √½
    to √2, it is e ln 2 + 2 (s + s³/3 + s⁵/5 + …), s = (m − 1) / (m + 1).
    """
    bits = np.float64(number).view(np.int64)
    exponent = (bits - _ROOT_OF_HALF) >> _MANTISSA
    mantissa = np.int64(bits - (exponent << _MANTISSA)).view(np.float64)
    root = (mantissa - 1.0) / (mantissa + 1.0)
    square = root * root
    series = 1.0 / 19.0
    series = series * square + 1.0 / 17.0
    series = series * square + 1.0 / 15.0
    series = series * square + 1.0 / 13.0
    series = series * square + 1.0 / 11.0
    series = series * square + 1.0 / 9.0
    series = series * square + 1.0 / 7.0
    series = series * square + 1.0 / 5.0
    series = series * square + 1.0 / 3.0
    series = series * square + 1.0
    return float(exponent * _LN_2 + 2.0 * root * series)


@reordered
def _sum_x_log_x(values: FloatArray, n_values: int) -> float:
    """Return Σ x ln x of the first values."""
    total = 0.0
    for number in range(n_values):
        value = max(values[number], _LEAST)
        total += value * logarithm(value)
    return total


@reordered
def _weighted_sum_x_log_x(values: FloatArray, weights: FloatArray, n_values: int) -> float:
    """Return Σ weight · x ln x of the first values."""
    total = 0.0
    for number in range(n_values):
        value = max(values[number], _LEAST)
        total += weights[number] * value * logarithm(value)
    return total


@compiled
def next_looks(
    tables: tuple[Any, ...],
    constants: tuple[Any, ...],
    aspects: FloatArray,
    weights: FloatArray,
    predictive: FloatArray,
    terms: FloatArray,
) -> None:
    """Fill in Σ_i J and Σ_i Σ_z J ln J for J = p(O = i, z | a), shapes [A, |𝒵|] and [A].

    Args:
        tables: ``Tables``.
        constants: ``Constants``.
        aspects: p(X_t | O, z_0:t), shape [H, W].
        weights: p(O | z_0:t), shape [H].
        predictive: Filled; rounding may leave some of it below zero.
        terms: Filled.
    """
    n_known, pattern, begins, edges, _, edge_probability = tables
    n_aspects, n_patterns, _, delta = constants
    n_actions, observed = len(terms), 1.0 - delta
    # Four at a time are added in one operation.
    padded = (n_actions + 3) // 4 * 4
    more, everywhere = np.zeros(padded), np.zeros(n_actions)
    added = np.zeros((n_patterns, padded))
    reached, n_reached = np.empty((n_actions, _BLOCK)), np.zeros(n_actions, np.int64)
    others, factors, n_others = np.empty((n_actions, _BLOCK)), np.empty((n_actions, _BLOCK)), 0
    terms[:] = 0.0
    for hypothesis in range(len(weights)):
        weight, n_own = weights[hypothesis], n_known[hypothesis]
        noise = delta / n_patterns * weight
        rate = 0.0
        if n_own < n_aspects:
            rate = (n_aspects - n_own) / n_aspects * (observed / (n_patterns - n_own))
        if n_others + 2 > _BLOCK:
            for action in range(n_actions):
                terms[action] += _weighted_sum_x_log_x(others[action], factors[action], n_others)
            n_others = 0
        for action in range(n_actions):
            edge, last = begins[hypothesis, action], begins[hypothesis, action + 1]
            term = n_reached[action]
            if term + last - edge > reached.shape[1]:
                for each in range(n_actions):
                    terms[each] += _sum_x_log_x(reached[each], n_reached[each])
                n_reached[:] = 0
                term = 0
                if last - edge > reached.shape[1]:
                    reached = np.empty((n_actions, 2 * (last - edge)))
            first, left = term, 1.0
            while edge < last:
                target = edges[edge, 0]
                arrived = aspects[hypothesis, edges[edge, 1]] * edge_probability[edge]
                edge += 1
                while edge < last and edges[edge, 0] == target:
                    arrived += aspects[hypothesis, edges[edge, 1]] * edge_probability[edge]
                    edge += 1
                left -= arrived
                arrived *= observed * weight
                added[pattern[hypothesis, target], action] += arrived
                reached[action, term] = arrived
                term += 1
            kept = max(left, 0.0) * weight
            unknown = kept * rate + noise
            unreached = kept * (observed / n_aspects) + noise
            for number in range(first, term):
                reached[action, number] += unreached
            n_reached[action] = term
            more[action] = unreached - unknown
            everywhere[action] += unknown
            others[action, n_others], factors[action, n_others] = unknown, n_patterns - n_own
            others[action, n_others + 1], factors[action, n_others + 1] = unreached, n_own - (term - first)
        n_others += 2
        for state in range(1, n_own + 1):
            known = pattern[hypothesis, state]
            for four in range(0, padded, 4):
                for action in range(four, four + 4):
                    added[known, action] += more[action]
    for action in range(n_actions):
        for each in range(n_patterns):
            predictive[action, each] = added[each, action] + everywhere[action]
        terms[action] += _sum_x_log_x(reached[action], n_reached[action])
        terms[action] += _weighted_sum_x_log_x(others[action], factors[action], n_others)


@compiled
def expected_entropies(
    tables: tuple[Any, ...],
    constants: tuple[Any, ...],
    aspects: FloatArray,
    identity: FloatArray,
    log_n_unseen: float,
    expected: FloatArray,
) -> None:
    """Fill in eq. 3 of each action, nats, shape [A].

    Args:
        tables: ``Tables``; the last hypothesis is *unseen*.
        constants: ``Constants``.
        aspects: p(X_t | O, z_0:t), shape [H, W].
        identity: p(O | z_0:t), shape [H].
        log_n_unseen: Ln U.
        expected: Filled.
    """
    n_actions, n_patterns = len(expected), constants[1]
    predictive = np.empty((n_actions, n_patterns))
    next_looks(tables, constants, aspects, identity, predictive, expected)
    for action in range(n_actions):
        entropy = _sum_x_log_x(predictive[action], n_patterns) - expected[action]
        expected[action] = max(entropy + identity[len(identity) - 1] * log_n_unseen, 0.0)
