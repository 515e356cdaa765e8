"""Loops of what kinds of objects there are: trials of plain ATGs for many α and δ at once, and shares of kinds.

This module loads Numba.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.belief_kernels import BEGIN, step
from atg_fg.inference.kernels.compilation import NONE, compiled
from atg_fg.inference.kernels.table_kernels import weigh_all


@compiled
def log_evidence_of_each(
    tables: tuple[Any, ...],
    sizes: tuple[int, int],
    grid: FloatArray,
    evidence: FloatArray,
    actions: IntArray,
    patterns: IntArray,
) -> FloatArray:
    """Return ln p(trial | hypothesis, α, δ), learned as the trial goes, shape [N, H].

    Args:
        tables: What H hypotheses know, with room for what the trial finds, ``Tables``; not changed.
        sizes: |G| and |𝒵|.
        grid: α and δ, shape [N, 2]; rows of the same α are weighed once if they lie together.
        evidence: Likelihood of each pattern at each look, shape [T + 1, |𝒵|].
        actions: Between the looks, shape [T].
        patterns: Pattern of each look, −1 if it was not complete, shape [T + 1].
    """
    n_known, pattern, begins, edges, counted, probability = tables
    n_rows, width = pattern.shape
    result = np.empty((len(grid), n_rows))
    aspects, log_identity, identity = np.zeros((n_rows, width)), np.zeros(n_rows), np.zeros(n_rows)
    weighed = (n_known, pattern, begins, edges, counted, probability.copy())
    for number in range(len(grid)):
        constants = (sizes[0], sizes[1], grid[number, 0], grid[number, 1])
        if number == 0 or grid[number, 0] != grid[number - 1, 0]:
            weigh_all(weighed, constants[2])
        own = (n_known.copy(), pattern.copy(), begins.copy(), edges.copy(), counted.copy(), weighed[5].copy())
        log_identity[:] = 0.0
        total, shown, shown_pattern = 0.0, np.zeros_like(n_known), NONE
        for time in range(len(evidence)):
            action = actions[time - 1] if time > 0 else BEGIN
            counted_from = patterns[time - 1] if time > 0 else -1
            learned = (counted_from, max(action, 0), patterns[time], shown_pattern)
            total += step(own, constants, (aspects, log_identity, identity), action, evidence[time], learned, shown)
            if patterns[time] >= 0:
                shown_pattern = patterns[time]
        for row in range(n_rows):
            result[number, row] = log_identity[row] + total
    return result


@compiled
def share_out(table: FloatArray, before: FloatArray, n_rounds: int) -> tuple[FloatArray, FloatArray, float]:
    """Return p(kind | row), shape [n, K], the shares of the kinds, shape [K], and a bound of the log evidence.

    The bound is ln ∫ Π_t Σ_k π_k p(row t | kind k) dπ from below, π ~ Dirichlet(before).

    Args:
        table: ln p(row | kind), shape [n, K].
        before: Concentration of each kind, shape [K].
        n_rounds: In which the shares are estimated.
    """
    n_rows, n_kinds = table.shape
    likelihood = np.empty_like(table)
    for row in range(n_rows):
        most = table[row].max()
        for kind in range(n_kinds):
            likelihood[row, kind] = np.exp(table[row, kind] - most)
    total = before.sum()
    shares = before / total
    following = np.empty_like(table)
    for _ in range(n_rounds):
        expected = before.copy()
        for row in range(n_rows):
            weight = 0.0
            for kind in range(n_kinds):
                following[row, kind] = likelihood[row, kind] * shares[kind]
                weight += following[row, kind]
            for kind in range(n_kinds):
                following[row, kind] /= weight
                expected[kind] += following[row, kind]
        shares = expected / (total + n_rows)
    bound = math.lgamma(total) - math.lgamma(total + n_rows)
    for kind in range(n_kinds):
        members = 0.0
        for row in range(n_rows):
            share = following[row, kind]
            members += share
            if share > 0.0:
                bound += share * (table[row, kind] - np.log(share))
        bound += math.lgamma(before[kind] + members) - math.lgamma(before[kind])
    return following, shares, bound


@compiled
def evidence_of_sets(table: FloatArray, before: FloatArray, members: NDArray[np.bool_], n_rounds: int) -> FloatArray:
    """Return the bound of the log evidence that ``share_out`` gives of some of the kinds alone, shape [M].

    Args:
        table: ln p(row | kind), shape [n, K].
        before: Concentration of each kind, shape [K].
        members: Which kinds there are, shape [M, K].
        n_rounds: In which the shares are estimated.
    """
    result = np.empty(len(members))
    for number in range(len(members)):
        kinds, n_kinds = np.empty(len(before), np.int64), 0
        for kind in range(len(before)):
            if members[number, kind]:
                kinds[n_kinds] = kind
                n_kinds += 1
        own, concentration = np.empty((len(table), n_kinds)), np.empty(n_kinds)
        for place in range(n_kinds):
            concentration[place] = before[kinds[place]]
            for row in range(len(table)):
                own[row, place] = table[row, kinds[place]]
        result[number] = share_out(own, concentration, n_rounds)[2]
    return result
