"""Gibbs moves of an automaton's entries: where an action leads from a state. Compiled as ``atg_fg.learning.kernels``.

Only the trials that pass an entry say anything of it, and of these only what comes after. What all else says of their
objects is multiplied once an entry, and what comes after once a successor; tables are normalised now and then alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within, written_out
from atg_fg.learning.kernels import SMALL, Clusters, TrialArrays, draw_by_logarithm, learn_all_again, shuffled, walk

#: Likelihoods that may be multiplied into a table before it is normalised, lest they leave the range of numbers.
_MOST_FACTORS = 16


class _Work(NamedTuple):
    """Room for what is multiplied together for one entry.

    Attributes:
        passes: When each trial passes the entry first, its length if it never does, −1 of one that follows another
            automaton, shape [N].
        is_passed: Whether a trial of each cluster passes it, shape [C].
        before: Product of all likelihoods before that in the registers of each cluster, shape [C, R, V].
        after: The same, of all likelihoods.
        is_there: Whether a register of a cluster has any after that, shape [C, R].
        n_factors: Likelihoods that were multiplied in since the last normalisation, shape [C].
    """

    passes: IntArray
    is_passed: NDArray[np.bool_]
    before: FloatArray
    after: FloatArray
    is_there: NDArray[np.bool_]
    n_factors: IntArray


@compiled
def transition_moves(
    trials: TrialArrays, clusters: Clusters, automaton: int, n_entries: int, beta: float, rng: np.random.Generator
) -> None:
    """Draw so many entries of an automaton's successors given all else: objects, starts, and the other entries."""
    successors = clusters.successors[automaton]
    n_actions, n_states = successors.shape[0] - 1, successors.shape[1]
    paths, scores, work = np.empty(trials.actions.shape, np.int64), np.empty(n_states), room_for(clusters)
    walk_all(trials, clusters, automaton, paths)
    for entry in shuffled(n_actions * n_states, rng)[:n_entries]:
        action, state = entry // n_states, entry % n_states
        before = successors[action, state]
        score_successors(trials, clusters, automaton, action, state, paths, work, scores)
        successors[action, state] = draw_by_logarithm(scores, beta, rng)
        if successors[action, state] != before:
            walk_all(trials, clusters, automaton, paths)
    learn_all_again(trials, clusters, automaton, paths[0])


@compiled
def room_for(clusters: Clusters) -> _Work:
    """Return room for the work on clusters."""
    return _Work(
        np.empty(len(clusters.owner), np.int64),
        np.empty(len(clusters.tables), np.bool_),
        np.empty_like(clusters.tables),
        np.empty_like(clusters.tables),
        np.empty(clusters.tables.shape[:2], np.bool_),
        np.empty(len(clusters.tables), np.int64),
    )


@compiled
def walk_all(trials: TrialArrays, clusters: Clusters, automaton: int, paths: IntArray) -> None:
    """Fill in the states of all trials that follow an automaton, shape [N, T]."""
    for trial in range(len(trials.lengths)):
        if follows(clusters, trial, automaton):
            actions, length = trials.actions[trial], trials.lengths[trial]
            walk(clusters.successors[automaton], actions, length, clusters.start[trial], paths[trial])


@compiled_within
def follows(clusters: Clusters, trial: int, automaton: int) -> bool:
    """Return whether a trial is of an object, one that follows an automaton."""
    cluster = clusters.owner[trial]
    return bool(cluster >= 0 and clusters.automaton[cluster] == automaton)


@compiled
def score_successors(
    trials: TrialArrays,
    clusters: Clusters,
    automaton: int,
    action: int,
    state: int,
    paths: IntArray,
    work: _Work,
    scores: FloatArray,
) -> None:
    """Fill in ln p(all looks | an action leads from a state to each successor), up to a constant, shape [S].

    Args:
        trials: All of them.
        clusters: The successors are left as they are.
        automaton: The one that is asked about.
        action: Of the entry.
        state: Of the entry.
        paths: States of all trials, shape [N, T].
        work: Room.
        scores: To be filled in.
    """
    scores[:] = 0.0
    if find_passes(trials, clusters, automaton, action, state, paths, work):
        multiply_before(trials, clusters, paths, work)
        successors = clusters.successors[automaton]
        old = successors[action, state]
        for successor in range(len(scores)):
            successors[action, state] = successor
            scores[successor] = multiply_after(trials, clusters, successors, state, work)
        successors[action, state] = old


@written_out
def find_passes(
    trials: TrialArrays, clusters: Clusters, automaton: int, action: int, state: int, paths: IntArray, work: _Work
) -> bool:
    """Fill in when each trial passes an entry first; return whether any does."""
    passes, is_passed, lengths, actions = work.passes, work.is_passed, trials.lengths, trials.actions
    is_passed[:] = False
    result = False
    for trial in range(len(lengths)):
        passes[trial] = -1
        if follows(clusters, trial, automaton):
            passes[trial] = lengths[trial]
            for time in range(lengths[trial] - 1):
                if paths[trial, time] == state and actions[trial, time] == action:
                    passes[trial] = time
                    is_passed[clusters.owner[trial]] = True
                    result = True
                    break
    return result


@written_out
def multiply_before(trials: TrialArrays, clusters: Clusters, paths: IntArray, work: _Work) -> None:
    """Multiply looks up to the first pass into the tables of all objects with trials that pass, and normalise them."""
    before, is_there, n_factors, is_passed = work.before, work.is_there, work.n_factors, work.is_passed
    looks, lengths, passes = trials.looks, trials.lengths, work.passes
    owner, registers = clusters.owner, clusters.registers
    for cluster in range(len(before)):
        if is_passed[cluster]:
            n_factors[cluster] = 0
            is_there[cluster] = True
            for register in range(before.shape[1]):
                for symbol in range(before.shape[2]):
                    before[cluster, register, symbol] = clusters.prior[symbol]
    for trial in range(len(lengths)):
        cluster = owner[trial]
        if passes[trial] >= 0 and is_passed[cluster]:
            for time in range(min(passes[trial] + 1, lengths[trial])):
                for slot in range(registers.shape[1]):
                    register = registers[paths[trial, time], slot]
                    for symbol in range(before.shape[2]):
                        before[cluster, register, symbol] *= looks[trial, time, slot, symbol]
                n_factors[cluster] += registers.shape[1]
                if n_factors[cluster] > _MOST_FACTORS:
                    n_factors[cluster] = 0
                    normalise(before, is_there, cluster)
    for cluster in range(len(before)):
        if is_passed[cluster]:
            normalise(before, is_there, cluster)


@written_out
def multiply_after(trials: TrialArrays, clusters: Clusters, successors: IntArray, state: int, work: _Work) -> float:
    """Return ln p(looks after the first pass of each trial | all that came before)."""
    before, after, is_there, n_factors = work.before, work.after, work.is_there, work.n_factors
    looks, lengths, passes = trials.looks, trials.lengths, work.passes
    owner, registers = clusters.owner, clusters.registers
    actions = trials.actions
    is_there[:] = False
    n_factors[:] = 0
    result = 0.0
    for trial in range(len(lengths)):
        if passes[trial] >= 0:
            there, cluster = state, owner[trial]
            for time in range(passes[trial], lengths[trial] - 1):
                there = successors[actions[trial, time], there]
                for slot in range(registers.shape[1]):
                    register = registers[there, slot]
                    if not is_there[cluster, register]:
                        is_there[cluster, register] = True
                        for symbol in range(before.shape[2]):
                            after[cluster, register, symbol] = before[cluster, register, symbol]
                    for symbol in range(before.shape[2]):
                        after[cluster, register, symbol] *= looks[trial, time + 1, slot, symbol]
                n_factors[cluster] += registers.shape[1]
                if n_factors[cluster] > _MOST_FACTORS:
                    n_factors[cluster] = 0
                    result += normalise(after, is_there, cluster)
    for cluster in range(len(after)):
        if n_factors[cluster] > 0:
            result += log_of_sums(after, is_there, cluster)
    return result


@compiled_within
def normalise(tables: FloatArray, is_there: NDArray[np.bool_], cluster: int) -> float:
    """Normalise the registers of a cluster into which anything was multiplied; return ln of the product of sums."""
    result = log_of_sums(tables, is_there, cluster)
    for register in range(tables.shape[1]):
        if is_there[cluster, register]:
            total = 0.0
            for symbol in range(tables.shape[2]):
                total += tables[cluster, register, symbol]
            scale = 1.0 / total if total > 0 else 1.0
            for symbol in range(tables.shape[2]):
                tables[cluster, register, symbol] *= scale
    return result


@compiled_within
def log_of_sums(tables: FloatArray, is_there: NDArray[np.bool_], cluster: int) -> float:
    """Return ln of the product of the sums of all registers of a cluster into which anything was multiplied."""
    product, logarithm = 1.0, 0.0
    for register in range(tables.shape[1]):
        if is_there[cluster, register]:
            total = 0.0
            for symbol in range(tables.shape[2]):
                total += tables[cluster, register, symbol]
            product *= total
            if not SMALL < product < 1.0 / SMALL:
                logarithm += np.log(product) if product > 0 else -1e6
                product = 1.0
    return float(logarithm + np.log(product))
