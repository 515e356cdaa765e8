"""What a trial weighs in each cluster, from each start. Compiled as ``atg_fg.learning.kernels``.

Sums over symbols are taken for all clusters side by side, in an order that does not depend on how many there are. From
many starts a trial comes back to its registers in the same order, only to others: where actions only turn an object,
from all. What its looks say of the first, second, … register that it visits is multiplied once for all of these.
"""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within, written_out
from atg_fg.learning.kernels import SMALL, Clusters, TrialArrays, log_product, look_up, walk


@compiled
def trial_weights(
    trials: TrialArrays, trial: int, clusters: Clusters, free: int, prior: FloatArray, weights: FloatArray
) -> None:
    """Fill in ln p(trial, start | cluster) up to the prior of starts, shape [C, S]; −∞ of clusters that are not there.

    Args:
        trials: All of them.
        trial: One that is taken out.
        clusters: Of the others.
        free: The cluster that stands for a new object.
        prior: Ln of what each cluster weighs before the looks, as ``cluster_weights`` has it, shape [C].
        weights: To be filled in.
    """
    weights[:] = -np.inf
    weigh_sharing(trials, trial, clusters, free, weights)
    weigh_others(trials, trial, clusters, weights)
    for cluster in range(len(prior)):
        for start in range(weights.shape[1]):
            weights[cluster, start] += prior[cluster]


@written_out
def weigh_others(trials: TrialArrays, trial: int, clusters: Clusters, weights: FloatArray) -> None:
    """Fill in the weights of clusters that follow an automaton of their own."""
    local, visited = np.empty(clusters.tables.shape[1:]), np.empty(clusters.tables.shape[1], np.int64)
    path, length = np.empty(trials.looks.shape[1], np.int64), trials.lengths[trial]
    for cluster in range(len(clusters.n_trials)):
        if clusters.automaton[cluster] > 0 and clusters.n_trials[cluster] > 0:
            successors = clusters.successors[clusters.automaton[cluster]]
            for start in range(weights.shape[1]):
                walk(successors, trials.actions[trial], length, start, path)
                n_visited, scale = look_up(trials.looks[trial], length, path, clusters.registers, local, visited)
                weights[cluster, start] = scale + log_product(clusters.tables[cluster], local, visited, n_visited)


@written_out
def weigh_sharing(trials: TrialArrays, trial: int, clusters: Clusters, free: int, weights: FloatArray) -> None:
    """Fill in the weights of clusters that follow the shared automaton, and of the one for a new object."""
    members, tables = side_by_side(clusters, free)
    n_states, length, n_registers = weights.shape[1], trials.lengths[trial], tables.shape[0]
    path, local = np.empty(trials.looks.shape[1], np.int64), np.empty(tables.shape[:2])
    visits = np.empty((n_states, length * clusters.registers.shape[1]), np.int64)
    visited, n_visited = np.empty((n_states, n_registers), np.int64), np.empty(n_states, np.int64)
    factors, is_known = (
        np.empty((n_registers, n_registers, len(members))),
        np.empty((n_registers, n_registers), np.bool_),
    )
    is_done, product, logarithm = np.zeros(n_states, np.bool_), np.empty(len(members)), np.empty(len(members))
    for start in range(n_states):
        walk(clusters.successors[0], trials.actions[trial], length, start, path)
        n_visited[start] = number_visits(path, length, clusters.registers, visits[start], visited[start])
    for first in range(n_states):
        if is_done[first]:
            continue
        walk(clusters.successors[0], trials.actions[trial], length, first, path)
        _, scale = look_up(trials.looks[trial], length, path, clusters.registers, local, visited[first])
        is_known[:] = False
        for start in range(first, n_states):
            is_alike = not is_done[start]
            for visit in range(visits.shape[1]):
                is_alike = is_alike and visits[first, visit] == visits[start, visit]
            if not is_alike:
                continue
            is_done[start] = True
            product[:] = 1.0
            logarithm[:] = 0.0
            for visit in range(n_visited[start]):
                register = visited[start, visit]
                if not is_known[visit, register]:
                    is_known[visit, register] = True
                    sum_products(tables, register, local[visited[first, visit]], factors[visit, register])
                for number in range(len(members)):
                    product[number] *= factors[visit, register, number]
                for number in range(len(members)):
                    if product[number] < SMALL:
                        logarithm[number] += np.log(product[number]) if product[number] > 0 else -1e6
                        product[number] = 1.0
            for number in range(len(members)):
                weights[members[number], start] = scale + (logarithm[number] + np.log(product[number]))


@compiled_within
def side_by_side(clusters: Clusters, free: int) -> tuple[IntArray, FloatArray]:
    """Return the clusters that follow the shared automaton, shape [K], and their tables, shape [R, V, K]."""
    members, n_members = np.empty(len(clusters.n_trials), np.int64), 0
    for cluster in range(len(clusters.n_trials)):
        if clusters.automaton[cluster] == 0 and (clusters.n_trials[cluster] > 0 or cluster == free):
            members[n_members] = cluster
            n_members += 1
    tables = np.empty((clusters.tables.shape[1], clusters.tables.shape[2], n_members))
    for number in range(n_members):
        for register in range(tables.shape[0]):
            for symbol in range(tables.shape[1]):
                tables[register, symbol, number] = clusters.tables[members[number], register, symbol]
    return members[:n_members], tables


@compiled_within
def number_visits(path: IntArray, length: int, registers: IntArray, visits: IntArray, visited: IntArray) -> int:
    """Number the registers that a path shows in the order of their first visit, as ``look_up`` does; return how many.

    Args:
        path: State at each look.
        length: Number of looks.
        registers: In each slot in each state, shape [S, J].
        visits: To be filled in: number of the register of each look's slots, one look after the other.
        visited: To be filled in: the register of each number.
    """
    n_visited = 0
    for time in range(length):
        for slot in range(registers.shape[1]):
            register, number = registers[path[time], slot], 0
            while number < n_visited and visited[number] != register:
                number += 1
            if number == n_visited:
                visited[number] = register
                n_visited += 1
            visits[time * registers.shape[1] + slot] = number
    return n_visited


@compiled_within
def sum_products(tables: FloatArray, register: int, local: FloatArray, totals: FloatArray) -> None:
    """Fill in Σ_c table(register, c) · local(c) of all clusters side by side, shape [K]."""
    for number in range(tables.shape[2]):
        totals[number] = 0.0
    for symbol in range(tables.shape[1]):
        likelihood = local[symbol]
        for number in range(tables.shape[2]):
            totals[number] += tables[register, symbol, number] * likelihood
