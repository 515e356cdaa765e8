"""Gibbs moves: of one trial's object and start, and of the automata. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import NONE, compiled, compiled_within, written_out
from atg_fg.learning.kernels import (
    Clusters,
    TrialArrays,
    draw_by_logarithm,
    forget,
    learn_again,
    log_product,
    look_up,
    take_in,
    walk,
)
from atg_fg.learning.object_kernels import cluster_weights
from atg_fg.learning.transition_kernels import transition_moves
from atg_fg.learning.weight_kernels import trial_weights

#: Draws of an automaton for the evidence of a fresh object that has its own, and how one is annealed on a first trial.
OWN_DRAWS = 2000
OWN_SWEEPS = 10
OWN_HOTTEST = 0.2


@compiled
def take_out(trials: TrialArrays, trial: int, clusters: Clusters, path: IntArray) -> tuple[int, int]:
    """Take a trial out of its cluster; return a free cluster, forgotten, and the number of clusters left."""
    cluster = clusters.owner[trial]
    if cluster >= 0:
        clusters.n_trials[cluster] -= 1
        clusters.owner[trial] = -1
        if clusters.n_trials[cluster] > 0:
            learn_again(trials, clusters, cluster, path)
    n_clusters, free = 0, NONE
    for other in range(len(clusters.n_trials)):
        if clusters.n_trials[other] > 0:
            n_clusters += 1
        elif free < 0:
            free = other
    clusters.automaton[free] = 0
    forget(clusters, free)
    return free, n_clusters


@compiled_within
def log_total(logarithms: FloatArray) -> float:
    """Return ln Σ exp of a table, of which −∞ stands for zero."""
    peak, total = logarithms.max(), 0.0
    for logarithm in logarithms.flat:
        if logarithm > -np.inf:
            total += np.exp(logarithm - peak)
    return float(peak + np.log(total)) if total > 0 else float(peak)


@written_out
def trial_move(
    trials: TrialArrays,
    trial: int,
    clusters: Clusters,
    log_new: FloatArray,
    log_own: FloatArray,
    beta: float,
    rng: np.random.Generator,
    votes: FloatArray,
) -> None:
    """Draw the object and the start of a trial jointly, given all other trials, at inverse temperature β.

    Args:
        trials: All of them.
        trial: Which one moves.
        clusters: Changed in place.
        log_new: Ln of the weight of a new object beside K known ones, shape [C + 1], by K.
        log_own: ln p(trial | a fresh object with an automaton of its own), shape [N]; of length 0 if all share one.
        beta: Inverse temperature.
        rng: Draws.
        votes: p(cluster | the others), *new* last, is added to it, shape [C + 1]; of length 0 if it is not asked for.
    """
    path = np.empty(trials.looks.shape[1], np.int64)
    free, n_clusters = take_out(trials, trial, clusters, path)
    # One row more: a new object with an automaton of its own.
    n_states = len(clusters.registers)
    weights = np.full((len(clusters.n_trials) + 1, n_states), -np.inf)
    prior = cluster_weights(trials, trial, clusters, free, log_new[n_clusters])
    trial_weights(trials, trial, clusters, free, prior, weights[:-1])
    if len(log_own) > 0:
        share = sharing(clusters)
        for start in range(n_states):
            weights[free, start] += np.log(share)
        weights[-1, 0] = prior[free] + np.log(1.0 - share) + log_own[trial] + np.log(n_states)
    if len(votes) > 0:
        count_votes(weights, free, votes)
    drawn = draw_by_logarithm(weights.ravel(), beta, rng)
    cluster, start = drawn // n_states, drawn % n_states
    if cluster == len(clusters.n_trials):
        begin_own(trials, trial, clusters, free, rng)
    else:
        put_in(trials, trial, clusters, cluster, start, path)


@compiled
def sharing(clusters: Clusters) -> float:
    """Return the posterior mean of the share of objects that follow the shared automaton."""
    n_objects, n_sharing = 0, 0
    for cluster in range(len(clusters.n_trials)):
        if clusters.n_trials[cluster] > 0:
            n_objects += 1
            n_sharing += clusters.automaton[cluster] == 0
    return (n_sharing + 1.0) / (n_objects + 2.0)


@written_out
def begin_own(trials: TrialArrays, trial: int, clusters: Clusters, free: int, rng: np.random.Generator) -> None:
    """Let a trial be the first of an object with an automaton of its own, which is annealed on it."""
    own = 1 + free
    clusters.automaton[free] = own
    n_states = len(clusters.registers)
    for action in range(clusters.successors.shape[1] - 1):
        for state in range(n_states):
            clusters.successors[own, action, state] = rng.integers(0, n_states)
    put_in(trials, trial, clusters, free, int(rng.integers(0, n_states)), np.empty(trials.looks.shape[1], np.int64))
    for step in range(OWN_SWEEPS):
        beta = OWN_HOTTEST ** (1.0 - step / (OWN_SWEEPS - 1))
        transition_moves(trials, clusters, own, clusters.successors[own].size, beta, rng)


@compiled
def own_log_evidence(
    trials: TrialArrays, trial: int, n_states: int, n_actions: int, prior: FloatArray, rng: np.random.Generator
) -> float:
    """Return ln p(trial | a fresh object, an automaton drawn uniformly), a mean over ``OWN_DRAWS`` of these."""
    n_slots = trials.looks.shape[2]
    registers = np.arange(n_states * n_slots).reshape(n_states, n_slots)
    table = np.empty((n_states * n_slots, len(prior)))
    for symbol in range(len(prior)):
        table[:, symbol] = prior[symbol]
    local, visited = np.empty_like(table), np.empty(len(table), np.int64)
    path, logarithms = np.empty(trials.looks.shape[1], np.int64), np.empty(OWN_DRAWS)
    for number in range(OWN_DRAWS):
        successors = rng.integers(0, n_states, (n_actions, n_states))
        walk(successors, trials.actions[trial], trials.lengths[trial], 0, path)
        n_visited, scale = look_up(trials.looks[trial], trials.lengths[trial], path, registers, local, visited)
        logarithms[number] = scale + log_product(table, local, visited, n_visited)
    peak = logarithms.max()
    return float(peak + np.log(np.exp(logarithms - peak).mean()))


@compiled
def entries_used(trials: TrialArrays, clusters: Clusters, automaton: int) -> int:
    """Return how many entries of an automaton's successors its trials go through."""
    used, n_used = np.zeros(clusters.successors.shape[1:], np.bool_), 0
    path = np.empty(trials.looks.shape[1], np.int64)
    for trial in range(len(trials.lengths)):
        cluster = clusters.owner[trial]
        if cluster >= 0 and clusters.automaton[cluster] == automaton:
            length = trials.lengths[trial]
            walk(clusters.successors[automaton], trials.actions[trial], length, clusters.start[trial], path)
            for time in range(length - 1):
                n_used += not used[trials.actions[trial, time], path[time]]
                used[trials.actions[trial, time], path[time]] = True
    return n_used


@compiled_within
def count_votes(weights: FloatArray, free: int, votes: FloatArray) -> None:
    """Add p(cluster), summed over the second axis of logarithms, to votes, *new* after all that there are."""
    total, new = log_total(weights.ravel()), len(votes) - 1
    for cluster in range(len(weights)):
        share = 0.0
        for column in range(weights.shape[1]):
            if weights[cluster, column] > -np.inf:
                share += np.exp(weights[cluster, column] - total)
        # What is beyond the clusters is new as well.
        votes[new if cluster == free or cluster >= new else cluster] += share


@compiled_within
def put_in(trials: TrialArrays, trial: int, clusters: Clusters, cluster: int, start: int, path: IntArray) -> None:
    """Put a trial that is taken out into a cluster."""
    clusters.owner[trial], clusters.start[trial] = cluster, start
    clusters.n_trials[cluster] += 1
    take_in(trials, trial, clusters, cluster, path)


@compiled
def sweep(
    trials: TrialArrays,
    order: IntArray,
    clusters: Clusters,
    log_new: FloatArray,
    log_own: FloatArray,
    beta: float,
    rng: np.random.Generator,
    votes: FloatArray,
) -> None:
    """Move trials in this order; p(cluster | all others) of the last one is added to votes, shape [C + 1]."""
    for position in range(len(order)):
        counted = votes if position + 1 == len(order) else votes[:0]
        trial_move(trials, order[position], clusters, log_new, log_own, beta, rng, counted)
