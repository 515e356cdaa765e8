"""Looks wrong in all slots at once, drawn with the object of their trial. Compiled as ``atg_fg.learning.kernels``.

Given which looks are wrong, all else is as without: a wrong look says nothing. A trial's object, its path and its wrong
looks are drawn together: for each object and path that is probable at all, looks are judged one after the other, which
gives an unbiased estimate of what all judgements together say, and one of these judgements. Drawing among them in
proportion to the estimates, those of the present object and path being made along its present judgements, leaves the
posterior as it is (conditional importance sampling with one particle a candidate; Andrieu, Doucet & Holenstein 2010).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within, written_out
from atg_fg.learning.gibbs_kernels import count_votes, put_in, take_out
from atg_fg.learning.kernels import Clusters, TrialArrays, copy_into, draw_by_logarithm, walk
from atg_fg.learning.object_kernels import cluster_weights
from atg_fg.learning.slip_kernels import slip_paths
from atg_fg.learning.weight_kernels import trial_weights

#: Objects and starts whose looks are judged: so many nats behind the best, where slots err each for itself.
_MARGIN = 12.0


@compiled
def judge_looks(
    looks: FloatArray,
    length: int,
    path: IntArray,
    registers: IntArray,
    table: FloatArray,
    rate: float,
    forced: bool,
    wrong: NDArray[np.bool_],
    rng: np.random.Generator,
) -> float:
    """Draw which looks are wrong, one after the other; return ln of the product of what each says given those before.

    Args:
        looks: Likelihood of each symbol in each slot at each look that is not wrong, shape [T, J, V].
        length: Number of looks.
        path: State at each.
        registers: In each slot in each state, shape [S, J].
        table: p(symbol in a register) without this trial, shape [R, V]; as it is with it in the end.
        rate: Probability that a look is wrong.
        forced: Whether ``wrong`` is kept as it is.
        wrong: Which looks are, shape [T].
        rng: Draws.
    """
    n_slots, n_symbols = registers.shape[1], table.shape[1]
    before = np.empty((n_slots, n_symbols))
    result = 0.0
    for time in range(length):
        says = 1.0
        for slot in range(n_slots):
            register, total = registers[path[time], slot], 0.0
            for symbol in range(n_symbols):
                before[slot, symbol] = table[register, symbol]
                table[register, symbol] *= looks[time, slot, symbol]
                total += table[register, symbol]
            for symbol in range(n_symbols):
                table[register, symbol] /= total
            says *= total
        evidence = (1.0 - rate) * says + rate
        if not forced:
            wrong[time] = rng.random() * evidence < rate
        result += np.log(evidence)
        if wrong[time]:
            for slot in range(n_slots - 1, -1, -1):
                for symbol in range(n_symbols):
                    table[registers[path[time], slot], symbol] = before[slot, symbol]
    return result


@compiled_within
def settle(
    trials: TrialArrays, looks: FloatArray, trial: int, wrong: NDArray[np.bool_], judged: NDArray[np.bool_]
) -> None:
    """Keep which looks of a trial are wrong, and let these say nothing."""
    for time in range(trials.lengths[trial]):
        wrong[trial, time] = judged[time]
        if judged[time]:
            trials.looks[trial, time] = 1.0
        else:
            copy_into(trials.looks[trial, time], looks[trial, time])


@written_out
def judged_move(
    trials: TrialArrays,
    looks: FloatArray,
    each_slot: TrialArrays,
    trial: int,
    clusters: Clusters,
    log_new: FloatArray,
    rate: float,
    wrong: NDArray[np.bool_],
    rng: np.random.Generator,
    votes: FloatArray,
) -> None:
    """Draw the object, the start and the wrong looks of a trial jointly, given all other trials.

    Args:
        trials: All of them, wrong looks saying nothing; changed in place.
        looks: Those of looks that are not wrong, shape [N, T, J, V].
        each_slot: The trials as they are where slots err each for itself: says what is probable at all.
        trial: Which one moves.
        clusters: Changed in place.
        log_new: As for ``trial_move``.
        rate: Probability that a look is wrong.
        wrong: Which looks are, shape [N, T]; changed in place.
        rng: Draws.
        votes: As for ``trial_move``.
    """
    length = trials.lengths[trial]
    path, n_states = np.empty(looks.shape[1], np.int64), len(clusters.registers)
    owner, start = clusters.owner[trial], clusters.start[trial]
    free, n_clusters = take_out(trials, trial, clusters, path)
    if owner >= 0 and clusters.n_trials[owner] == 0:
        owner = free  # the first of an object is that of a new one
    weights = np.empty((len(clusters.n_trials), n_states))
    prior = cluster_weights(each_slot, trial, clusters, free, log_new[n_clusters])
    trial_weights(each_slot, trial, clusters, free, prior, weights)
    least = weights.max() - _MARGIN
    if owner >= 0:
        least = min(least, weights[owner, start])
    judged = np.empty((weights.size, looks.shape[1]), np.bool_)
    table = np.empty(clusters.tables.shape[1:])
    for cluster in range(len(weights)):
        for first in range(n_states):
            if weights[cluster, first] < least or weights[cluster, first] == -np.inf:
                weights[cluster, first] = -np.inf
                continue
            walk(clusters.successors[0], trials.actions[trial], length, first, path)
            copy_into(table, clusters.tables[cluster])
            number, forced = cluster * n_states + first, cluster == owner and first == start
            if forced:
                for time in range(length):
                    judged[number, time] = wrong[trial, time]
            weights[cluster, first] = judge_looks(
                looks[trial], length, path, clusters.registers, table, rate, forced, judged[number], rng
            )
            weights[cluster, first] += prior[cluster]
    if len(votes) > 0:
        count_votes(weights, free, votes)
    drawn = draw_by_logarithm(weights.ravel(), 1.0, rng)
    settle(trials, looks, trial, wrong, judged[drawn])
    put_in(trials, trial, clusters, drawn // n_states, drawn % n_states, path)


@compiled
def judged_sweep(
    trials: TrialArrays,
    looks: FloatArray,
    each_slot: TrialArrays,
    order: IntArray,
    clusters: Clusters,
    log_new: FloatArray,
    rate: float,
    wrong: NDArray[np.bool_],
    rng: np.random.Generator,
    votes: FloatArray,
) -> None:
    """Move trials in this order, as ``sweep`` does."""
    for position in range(len(order)):
        counted = votes if position + 1 == len(order) else votes[:0]
        judged_move(trials, looks, each_slot, order[position], clusters, log_new, rate, wrong, rng, counted)


@compiled
def judged_path_move(
    trials: TrialArrays,
    looks: FloatArray,
    each_slot: TrialArrays,
    trial: int,
    clusters: Clusters,
    done: IntArray,
    log_odds: float,
    log_new: FloatArray,
    rate: float,
    wrong: NDArray[np.bool_],
    rng: np.random.Generator,
    votes: FloatArray,
) -> None:
    """Draw object, start, slips and wrong looks of a trial jointly, by the paths that forward filtering keeps."""
    length, stay = trials.lengths[trial], clusters.successors.shape[1] - 1
    path, owner = np.empty(looks.shape[1], np.int64), clusters.owner[trial]
    start, slipped = clusters.start[trial], trials.actions[trial].copy()
    free, n_clusters = take_out(trials, trial, clusters, path)
    if owner >= 0 and clusters.n_trials[owner] == 0:
        owner = free
    prior = cluster_weights(each_slot, trial, clusters, free, log_new[n_clusters])
    paths, scores = slip_paths(each_slot, trial, done, clusters, free, prior, log_odds)
    least = scores.max() - _MARGIN
    judged = np.empty((scores.size, looks.shape[1]), np.bool_)
    table = np.empty(clusters.tables.shape[1:])
    for which in range(len(scores)):
        is_present = paths.start[which] == start
        for time in range(length - 1):
            trials.actions[trial, time] = stay if paths.slipped[which, time] else done[time]
            is_present = is_present and trials.actions[trial, time] == slipped[time]
        walk(clusters.successors[0], trials.actions[trial], length, paths.start[which], path)
        for cluster in range(scores.shape[1]):
            forced = is_present and cluster == owner
            if scores[which, cluster] == -np.inf or (scores[which, cluster] < least and not forced):
                scores[which, cluster] = -np.inf
                continue
            copy_into(table, clusters.tables[cluster])
            number = which * scores.shape[1] + cluster
            if forced:
                for time in range(length):
                    judged[number, time] = wrong[trial, time]
            said = judge_looks(looks[trial], length, path, clusters.registers, table, rate, forced, judged[number], rng)
            scores[which, cluster] = paths.log_prior[which] + said + prior[cluster]
    count_votes(np.ascontiguousarray(scores.T), free, votes)
    drawn = draw_by_logarithm(scores.ravel(), 1.0, rng)
    which, cluster = drawn // scores.shape[1], drawn % scores.shape[1]
    for time in range(length - 1):
        trials.actions[trial, time] = stay if paths.slipped[which, time] else done[time]
    settle(trials, looks, trial, wrong, judged[drawn])
    put_in(trials, trial, clusters, cluster, paths.start[which], path)
