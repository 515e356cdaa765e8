"""The loops that sampling spends its time in, compiled by Numba.

All of them work on one form of structure: S states, a table of successors an action, and the register that each state
shows in each slot. A *cluster* holds the trials of one object; its table [R, V] is what they say of its registers,
``prior · Π likelihoods``, normalised. Randomness is drawn from the generator that is handed in.

This module is loaded where something is sampled, and not before: it takes longer to load than all of the rest.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within, written_out
from atg_fg.learning.raw_trials import NOTHING_FELT

#: Products are put aside as a logarithm before they leave the range of floating-point numbers.
SMALL = 1e-120
#: What is so many nats less probable than the most probable is not drawn.
NEVER_DRAWN = -45.0


class TrialArrays(NamedTuple):
    """N trials side by side.

    Attributes:
        looks: Likelihood of each symbol in each slot at each look, shape [N, T, J, V].
        actions: Index of the action after each look, shape [N, T]; that of *stay* is the last row of successors.
        lengths: Number of looks, shape [N].
        felt: Of each sense of the object how many readings there are, their sum in units of their error from what is
            typical, and the variance between objects in these units, shape [N, S, 3].
    """

    looks: FloatArray
    actions: IntArray
    lengths: IntArray
    felt: FloatArray = NOTHING_FELT


class Clusters(NamedTuple):
    """What one chain believes: which trials are of one object, and where each of them began.

    Attributes:
        successors: Of each automaton, the shared one first, shape [G, A + 1, S]; the last action is to stay.
        registers: The register in each slot in each state, shape [S, J].
        automaton: Which one each cluster follows, shape [C].
        tables: p(symbol in a register | its trials), shape [C, R, V].
        n_trials: Trials of each cluster, shape [C]; 0 of one that is free.
        owner: Cluster of each trial, −1 of one that is taken out, shape [N].
        start: First state of each trial, shape [N].
        prior: Of the symbols, shape [V].
    """

    successors: IntArray
    registers: IntArray
    automaton: IntArray
    tables: FloatArray
    n_trials: IntArray
    owner: IntArray
    start: IntArray
    prior: FloatArray


@compiled_within
def draw(weights: FloatArray, rng: np.random.Generator) -> int:
    """Return an index drawn by weights that need not be normalised."""
    rest = rng.random() * weights.sum()
    chosen = 0
    for index in range(len(weights)):
        if weights[index] > 0:
            chosen = index
            rest -= weights[index]
            if rest <= 0:
                break
    return chosen


@compiled_within
def draw_by_logarithm(logarithms: FloatArray, beta: float, rng: np.random.Generator) -> int:
    """Return an index drawn by exp(β · logarithm)."""
    peak, weights = logarithms.max(), np.empty(len(logarithms))
    for index in range(len(logarithms)):
        exponent = beta * (logarithms[index] - peak)
        weights[index] = np.exp(exponent) if exponent > NEVER_DRAWN else 0.0
    return draw(weights, rng)


@compiled
def shuffled(n: int, rng: np.random.Generator) -> IntArray:
    """Return the numbers below n in an order drawn as ``rng.permutation`` draws it, which takes seconds to compile."""
    order = np.arange(n)
    mask = 1
    while mask < n:
        mask *= 2
    for last in range(n - 1, 0, -1):
        while mask // 2 > last:
            mask //= 2
        other = np.int64(last + 1)
        while other > last:
            other = np.int64(rng.integers(0, 2**32, dtype=np.uint32)) & (mask - 1)
        order[last], order[other] = order[other], order[last]
    return order


@compiled_within
def copy_into(target: NDArray[Any], source: NDArray[Any]) -> None:
    """Copy a table of the same shape; ``target[:] = source`` compares the shapes, which takes seconds to compile."""
    for row in range(source.shape[0]):
        for column in range(source.shape[1]):
            target[row, column] = source[row, column]


@compiled_within
def add_share(share: float, table: FloatArray, total: FloatArray) -> None:
    """Add a share of a table to another, shape [P, S] both."""
    for register in range(table.shape[0]):
        for symbol in range(table.shape[1]):
            total[register, symbol] += share * table[register, symbol]


@compiled
def walk(successors: IntArray, actions: IntArray, length: int, start: int, path: IntArray) -> None:
    """Fill in the states that actions lead through."""
    path[0] = start
    for time in range(length - 1):
        path[time + 1] = successors[actions[time], path[time]]


@compiled_within
def look_up(
    looks: FloatArray, length: int, path: IntArray, registers: IntArray, local: FloatArray, visited: IntArray
) -> tuple[int, float]:
    """Fill in the likelihood Π e(c) of each register that a path shows; return how many, and ln of the scale."""
    n_visited, log_scale = 0, 0.0
    n_symbols = local.shape[1]
    for time in range(length):
        for slot in range(registers.shape[1]):
            register = registers[path[time], slot]
            is_new = True
            for other in range(n_visited):
                if visited[other] == register:
                    is_new = False
                    break
            if is_new:
                visited[n_visited] = register
                n_visited += 1
                for symbol in range(n_symbols):
                    local[register, symbol] = looks[time, slot, symbol]
            else:
                peak = 0.0
                for symbol in range(n_symbols):
                    local[register, symbol] *= looks[time, slot, symbol]
                    peak = max(peak, local[register, symbol])
                if 0.0 < peak < SMALL:
                    for symbol in range(n_symbols):
                        local[register, symbol] /= peak
                    log_scale += np.log(peak)
    return n_visited, log_scale


@compiled_within
def log_product(table: FloatArray, local: FloatArray, visited: IntArray, n_visited: int) -> float:
    """Return ln Π_r Σ_c table(r, c) · local(r, c) over the registers that were visited."""
    product, logarithm = 1.0, 0.0
    for index in range(n_visited):
        register = visited[index]
        total = 0.0
        for symbol in range(local.shape[1]):
            total += table[register, symbol] * local[register, symbol]
        product *= total
        if product < SMALL:
            logarithm += np.log(product) if product > 0 else -1e6
            product = 1.0
    return float(logarithm + np.log(product))


@compiled
def fresh_log_evidence(
    trials: TrialArrays, successors: IntArray, registers: IntArray, n_registers: int, prior: FloatArray
) -> FloatArray:
    """Return ln p(trial | a fresh object) = ln 1/S Σ_start Π_r Σ_c prior(c) Π_looks e(c) of each, shape [N]."""
    n_trials, n_states = len(trials.lengths), len(registers)
    table = np.empty((n_registers, len(prior)))
    for register in range(n_registers):
        for symbol in range(len(prior)):
            table[register, symbol] = prior[symbol]
    local, visited = np.empty_like(table), np.empty(n_registers, np.int64)
    path, logarithms = np.empty(trials.looks.shape[1], np.int64), np.empty(n_states)
    result = np.empty(n_trials)
    for trial in range(n_trials):
        length = trials.lengths[trial]
        for start in range(n_states):
            walk(successors, trials.actions[trial], length, start, path)
            n_visited, scale = look_up(trials.looks[trial], length, path, registers, local, visited)
            logarithms[start] = scale + log_product(table, local, visited, n_visited)
        peak = logarithms.max()
        result[trial] = peak + np.log(np.exp(logarithms - peak).sum() / n_states)
    return result


@compiled_within
def take_in(trials: TrialArrays, trial: int, clusters: Clusters, cluster: int, path: IntArray) -> float:
    """Multiply a trial into the table of a cluster; return ln p(trial | what the cluster knew, its start)."""
    table, registers = clusters.tables[cluster], clusters.registers
    successors = clusters.successors[clusters.automaton[cluster]]
    walk(successors, trials.actions[trial], trials.lengths[trial], clusters.start[trial], path)
    product, logarithm = 1.0, 0.0
    for time in range(trials.lengths[trial]):
        for slot in range(registers.shape[1]):
            register = registers[path[time], slot]
            total = 0.0
            for symbol in range(table.shape[1]):
                table[register, symbol] *= trials.looks[trial, time, slot, symbol]
                total += table[register, symbol]
            if total > 0:
                for symbol in range(table.shape[1]):
                    table[register, symbol] /= total
            product *= total
            if product < SMALL:
                logarithm += np.log(product) if product > 0 else -1e6
                product = 1.0
    return float(logarithm + np.log(product))


@compiled
def forget(clusters: Clusters, cluster: int) -> None:
    """Set the table of a cluster back to the prior."""
    for register in range(clusters.tables.shape[1]):
        for symbol in range(len(clusters.prior)):
            clusters.tables[cluster, register, symbol] = clusters.prior[symbol]


@written_out
def learn_again(trials: TrialArrays, clusters: Clusters, cluster: int, path: IntArray) -> float:
    """Make the table of a cluster anew from its trials; return ln of their evidence, given their starts."""
    forget(clusters, cluster)
    total = 0.0
    for trial in range(len(trials.lengths)):
        if clusters.owner[trial] == cluster:
            total += take_in(trials, trial, clusters, cluster, path)
    return total


@compiled
def learn_all_again(trials: TrialArrays, clusters: Clusters, automaton: int, path: IntArray) -> float:
    """Make the tables of all clusters that follow an automaton anew, of all if it is −1; return ln of the evidence."""
    for cluster in range(len(clusters.n_trials)):
        if clusters.n_trials[cluster] > 0 and (automaton < 0 or clusters.automaton[cluster] == automaton):
            forget(clusters, cluster)
    total = 0.0
    for trial in range(len(trials.lengths)):
        cluster = clusters.owner[trial]
        if cluster >= 0 and (automaton < 0 or clusters.automaton[cluster] == automaton):
            total += take_in(trials, trial, clusters, cluster, path)
    return total


@compiled
def right_probabilities(
    trials: TrialArrays, clusters: Clusters, labels: IntArray, weight: float, right: FloatArray, truth: FloatArray
) -> None:
    """Add weight · p(symbol in the slot | all trials) of each look to what is counted.

    Args:
        trials: All of them.
        clusters: With the tables of all trials.
        labels: Symbol seen in each slot at each look, −1 where none was, shape [N, T, J].
        weight: Of this chain.
        right: p(the label is right) of each label is added to it, shape [N, T, J].
        truth: p(truth, label) of all labels is added to it, shape [V, V].
    """
    path = np.empty(trials.looks.shape[1], np.int64)
    for trial in range(len(trials.lengths)):
        cluster = clusters.owner[trial]
        if cluster < 0:
            continue
        successors = clusters.successors[clusters.automaton[cluster]]
        walk(successors, trials.actions[trial], trials.lengths[trial], clusters.start[trial], path)
        for time in range(trials.lengths[trial]):
            for slot in range(labels.shape[2]):
                label = labels[trial, time, slot]
                if label >= 0:
                    register = clusters.registers[path[time], slot]
                    right[trial, time, slot] += weight * clusters.tables[cluster, register, label]
                    for symbol in range(len(truth)):
                        truth[symbol, label] += weight * clusters.tables[cluster, register, symbol]


@compiled
def recurrences(trials: TrialArrays, clusters: Clusters, labels: IntArray) -> tuple[int, int]:
    """Return how many pairs of wrong labels of one register there are within trials, and how many are of one label.

    A label is taken for wrong if it is not the most probable symbol of its register.
    """
    path = np.empty(trials.looks.shape[1], np.int64)
    counts = np.zeros(clusters.tables.shape[1:], np.int64)
    n_pairs, n_same = 0, 0
    for trial in range(len(trials.lengths)):
        cluster = clusters.owner[trial]
        if cluster < 0:
            continue
        successors = clusters.successors[clusters.automaton[cluster]]
        walk(successors, trials.actions[trial], trials.lengths[trial], clusters.start[trial], path)
        counts[:] = 0
        for time in range(trials.lengths[trial]):
            for slot in range(labels.shape[2]):
                register, label = clusters.registers[path[time], slot], labels[trial, time, slot]
                if label >= 0 and label != np.argmax(clusters.tables[cluster, register]):
                    n_pairs += counts[register].sum()
                    n_same += counts[register, label]
                    counts[register, label] += 1
    return n_pairs, n_same
