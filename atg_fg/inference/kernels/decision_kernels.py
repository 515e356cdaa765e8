"""The decision of a Bayes filter over object and aspect: eq. 3 of all actions in one loop over the hypotheses.

``atg_fg.inference.expected_entropy`` says which values x the joint of object and next pattern takes. They are put into
blocks, whose x ln x are added up in a loop that the compiler turns into operations on several numbers at once. This
module loads Numba.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import ZERO, compiled, compiled_within, reordered

#: Smallest normal number, in place of zero under a logarithm: x ln x of what is below it is zero up to rounding.
_LEAST: Final = float(np.finfo(np.float64).tiny)

#: Values of an action in a block: they stay in the processor's nearest cache until their logarithms are taken.
_BLOCK: Final = 256

#: The bits of √½, and how many of a number's bits there are below its exponent.
_ROOT_OF_HALF: Final = int(np.array(np.sqrt(0.5)).view(np.int64))
_MANTISSA: Final = 52

_LN_2: Final = float(np.log(2.0))

#: What an index is made of that is never negative: Numba asks of any other whether it counts from the end, which costs
#: time where little else is done.
_place: Final = np.uint64


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
def _sum_x_log_x(values: FloatArray) -> float:
    """Return Σ x ln x."""
    total = 0.0
    for number in range(len(values)):
        value = max(values[number], _LEAST)
        total += value * logarithm(value)
    return total


@reordered
def _weighted_sum_x_log_x(values: FloatArray, weights: FloatArray) -> float:
    """Return Σ weight · x ln x."""
    total = 0.0
    for number in range(len(values)):
        value = max(values[number], _LEAST)
        total += weights[number] * value * logarithm(value)
    return total


@compiled_within
def _add_others(terms: FloatArray, others: FloatArray, factors: FloatArray, n_others: int) -> None:
    """Add Σ factor · x ln x of the first values in the block of each action to its term."""
    for action in range(len(terms)):
        begin, end = action * _BLOCK, action * _BLOCK + n_others
        terms[action] += _weighted_sum_x_log_x(others[begin:end], factors[begin:end])


@compiled_within
def _add_reached(terms: FloatArray, reached: FloatArray, n_reached: IntArray, n_next: int) -> tuple[FloatArray, int]:
    """Add Σ x ln x of the values of each action to its term; return empty blocks with room for more, and their size."""
    block = len(reached) // len(terms)
    for action in range(len(terms)):
        begin = action * block
        terms[action] += _sum_x_log_x(reached[begin : begin + n_reached[action]])
    n_reached[:] = 0
    if n_next > block:
        block = 2 * n_next
        reached = np.empty(len(terms) * block)
    return reached, block


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
    n_known, own_patterns, own_begins, pairs, _, edge_probability = tables
    n_aspects, n_patterns, _, delta = constants
    n_actions, observed, width = len(terms), 1.0 - delta, aspects.shape[1]
    # In one dimension, since the loops below have no registers left for strides.
    belief, pattern, begins, edges = aspects.ravel(), own_patterns.ravel(), own_begins.ravel(), pairs.ravel()
    # Four at a time are added in one operation.
    padded = (n_actions + 3) // 4 * 4
    more, everywhere, added = np.zeros(padded), np.zeros(n_actions), np.zeros(n_patterns * padded)
    reached, n_reached, block = np.empty(n_actions * _BLOCK), np.zeros(n_actions, np.int64), _BLOCK
    others, factors, n_others = np.empty(n_actions * _BLOCK), np.empty(n_actions * _BLOCK), ZERO
    terms[:] = 0.0
    for hypothesis in range(len(weights)):
        weight, n_own = weights[hypothesis], n_known[hypothesis]
        noise = delta / n_patterns * weight
        rate = 0.0
        if n_own < n_aspects:
            rate = (n_aspects - n_own) / n_aspects * (observed / (n_patterns - n_own))
        if n_others + 2 > _BLOCK:
            _add_others(terms, others, factors, n_others)
            n_others = ZERO
        row, own = hypothesis * width, hypothesis * (n_actions + 1)
        for action in range(n_actions):
            edge, last = begins[_place(own + action)], begins[_place(own + action + 1)]
            if n_reached[action] + last - edge > block:
                reached, block = _add_reached(terms, reached, n_reached, last - edge)
            first = action * block + n_reached[action]
            term, left = first, 1.0
            while edge < last:
                target = edges[_place(2 * edge)]
                arrived = belief[_place(row + edges[_place(2 * edge + 1)])] * edge_probability[_place(edge)]
                edge += 1
                while edge < last and edges[_place(2 * edge)] == target:
                    arrived += belief[_place(row + edges[_place(2 * edge + 1)])] * edge_probability[_place(edge)]
                    edge += 1
                left -= arrived
                arrived *= observed * weight
                added[_place(pattern[_place(row + target)] * padded + action)] += arrived
                reached[_place(term)] = arrived
                term += 1
            kept = max(left, 0.0) * weight
            unknown = kept * rate + noise
            unreached = kept * (observed / n_aspects) + noise
            for number in range(first, term):
                reached[_place(number)] += unreached
            n_reached[action] += term - first
            more[action] = unreached - unknown
            everywhere[action] += unknown
            other = action * _BLOCK + n_others
            others[_place(other)], factors[_place(other)] = unknown, n_patterns - n_own
            others[_place(other + 1)], factors[_place(other + 1)] = unreached, n_own - (term - first)
        n_others += 2
        for four in range(0, padded, 4):
            one, two, three, last_one = more[four], more[four + 1], more[four + 2], more[four + 3]
            for state in range(1, n_own + 1):
                known = pattern[_place(row + state)] * padded + four
                added[_place(known)] += one
                added[_place(known + 1)] += two
                added[_place(known + 2)] += three
                added[_place(known + 3)] += last_one
    _add_others(terms, others, factors, n_others)
    _add_reached(terms, reached, n_reached, ZERO)
    for action in range(n_actions):
        for each in range(n_patterns):
            predictive[action, each] = added[each * padded + action] + everywhere[action]


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
        entropy = _sum_x_log_x(predictive[action]) - expected[action]
        expected[action] = max(entropy + identity[len(identity) - 1] * log_n_unseen, 0.0)


@compiled
def expected_entropies_of_table(table: FloatArray, unseen: float, log_n_unseen: float) -> FloatArray:
    """Return eq. 3 for each action in nats, shape [A], from J = p(O = i, z | a) of every pattern, shape [A, I, |𝒵|].

    Args:
        table: J; its last hypothesis is *unseen*.
        unseen: p(unseen | z_0:t).
        log_n_unseen: Ln U.
    """
    n_actions, n_hypotheses, n_patterns = table.shape
    expected, predictive = np.empty(n_actions), np.empty(n_patterns)
    for action in range(n_actions):
        predictive[:] = 0.0
        terms = 0.0
        for hypothesis in range(n_hypotheses):
            terms += _sum_x_log_x(table[action, hypothesis])
            for pattern in range(n_patterns):
                predictive[pattern] += table[action, hypothesis, pattern]
        expected[action] = max(_sum_x_log_x(predictive) - terms + unseen * log_n_unseen, 0.0)
    return expected


@compiled
def next_patterns(
    tables: tuple[Any, ...],
    constants: tuple[Any, ...],
    aspects: FloatArray,
    weights: FloatArray,
    hypotheses: IntArray,
    n_actions: int,
) -> FloatArray:
    """Return J = p(O = i, z | a) of every pattern, shape [A, I, |𝒵|].

    Args:
        tables: ``Tables``.
        constants: ``Constants``.
        aspects: p(X_t | O, z_0:t), shape [H, W].
        weights: p(O | z_0:t), shape [H].
        hypotheses: Those in question, shape [I].
        n_actions: A.
    """
    n_known, pattern, begins, edges, _, edge_probability = tables
    n_aspects, n_patterns, _, delta = constants
    observed = 1.0 - delta
    result = np.empty((n_actions, len(hypotheses), n_patterns))
    for number in range(len(hypotheses)):
        hypothesis = hypotheses[number]
        weight, n_own = weights[hypothesis], n_known[hypothesis]
        noise = delta / n_patterns * weight
        rate = 0.0
        if n_own < n_aspects:
            rate = (n_aspects - n_own) / n_aspects * (observed / (n_patterns - n_own))
        for action in range(n_actions):
            left = 1.0
            for edge in range(begins[hypothesis, action], begins[hypothesis, action + 1]):
                left -= aspects[hypothesis, edges[edge, 1]] * edge_probability[edge]
            kept = max(left, 0.0) * weight
            for each in range(n_patterns):
                result[action, number, each] = kept * rate + noise
            for state in range(1, n_own + 1):
                result[action, number, pattern[hypothesis, state]] = kept * (observed / n_aspects) + noise
            for edge in range(begins[hypothesis, action], begins[hypothesis, action + 1]):
                arrived = aspects[hypothesis, edges[edge, 1]] * edge_probability[edge]
                result[action, number, pattern[hypothesis, edges[edge, 0]]] += observed * weight * arrived
    return result
