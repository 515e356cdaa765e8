"""Actions that fail: a slip is one more action, *stay*. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within, written_out
from atg_fg.learning.gibbs_kernels import count_votes, log_total, put_in, take_out
from atg_fg.learning.kernels import SMALL, Clusters, TrialArrays, copy_into, draw_by_logarithm
from atg_fg.learning.object_kernels import cluster_weights
from atg_fg.learning.weight_kernels import side_by_side, sum_products, trial_weights

#: Paths with slips that are followed at once, and how improbable one may be beside the best.
_MAX_PATHS = 256
_LEAST_PATH = 1e-7
#: Products of so many times the greatest may be the greatest but for rounding.
_AS_GOOD = 1.0 - 1e-9


@compiled
def slip_moves(
    trials: TrialArrays,
    trial: int,
    clusters: Clusters,
    done: IntArray,
    log_odds: float,
    log_new: FloatArray,
    rng: np.random.Generator,
) -> None:
    """Toggle an action of a trial between what was asked for and *stay*, then draw its object and start.

    Args:
        trials: All of them; the actions of this one are changed in place.
        trial: Which one.
        clusters: Changed in place.
        done: The actions that were asked for, shape [T].
        log_odds: ln ε / (1 − ε) of a slip.
        log_new: As for ``trial_move``.
        rng: Draws.
    """
    path, stay = np.empty(trials.looks.shape[1], np.int64), clusters.successors.shape[1] - 1
    free, n_clusters = take_out(trials, trial, clusters, path)
    prior = cluster_weights(trials, trial, clusters, free, log_new[n_clusters])
    # As the trial is now, and toggled.
    weights, total, chosen = np.empty((2, len(clusters.n_trials), len(clusters.registers))), np.empty(2), 0
    for toggled in range(2 if trials.lengths[trial] > 1 else 1):
        if toggled:
            time = rng.integers(0, trials.lengths[trial] - 1)
            old = trials.actions[trial, time]
            trials.actions[trial, time] = done[time] if old == stay else stay
        trial_weights(trials, trial, clusters, free, prior, weights[toggled])
        total[toggled] = log_total(weights[toggled].ravel())
        if toggled:
            gain = total[1] - total[0] + (log_odds if old != stay else -log_odds)
            if rng.random() < 1.0 / (1.0 + np.exp(-gain)):
                chosen = 1
            else:
                trials.actions[trial, time] = old
    drawn = draw_by_logarithm(weights[chosen].ravel(), 1.0, rng)
    put_in(trials, trial, clusters, drawn // weights.shape[2], drawn % weights.shape[2], path)


class Paths(NamedTuple):
    """Ways that one trial may have gone, with slips, most of them forgotten on the way.

    Attributes:
        slipped: Whether each action failed, shape [B, T].
        start: First state, shape [B].
        log_prior: ln of the slips' probability, shape [B].
    """

    slipped: NDArray[np.bool_]
    start: IntArray
    log_prior: FloatArray


class _Work(NamedTuple):
    """What is followed along each path. A path keeps its row of the large tables when others are forgotten.

    Attributes:
        row: Of each path, and those that are free, shape [B].
        state: Where each path is, shape [B].
        local: Likelihood of each symbol in each register, by row, shape [B, R, V].
        totals: Σ_c table(r, c) local(r, c) of each cluster side by side, by row, shape [B, R, K].
    """

    row: IntArray
    state: IntArray
    local: FloatArray
    totals: FloatArray


@compiled
def slip_paths(
    trials: TrialArrays,
    trial: int,
    done: IntArray,
    clusters: Clusters,
    free: int,
    all_prior: FloatArray,
    log_odds: float,
) -> tuple[Paths, FloatArray]:
    """Follow all ways a trial may have gone, by the shared automaton, without the ones that become negligible.

    Args:
        trials: All of them.
        trial: One that is taken out.
        done: As for ``slip_moves``.
        clusters: Of the others.
        free: The cluster that stands for a new object.
        all_prior: Ln of what each cluster weighs before the looks, shape [C].
        log_odds: As for ``slip_moves``.

    Returns:
        The paths and ln p(trial, path | cluster), shape [B, C].
    """
    members, tables = side_by_side(clusters, free)
    n_states, length = len(clusters.registers), trials.lengths[trial]
    capacity, n_paths = max(2 * _MAX_PATHS, n_states), n_states
    paths = Paths(np.zeros((capacity, max(length, 1)), np.bool_), np.arange(capacity), np.zeros(capacity))
    work = _Work(
        np.arange(capacity),
        np.arange(capacity),
        np.ones((capacity, tables.shape[0], tables.shape[1])),
        np.ones((capacity, tables.shape[0], len(members))),
    )
    prior, best = np.empty(len(members)), np.empty(capacity)
    for number in range(len(members)):
        prior[number] = all_prior[members[number]]
    weights = np.exp(prior - prior.max())
    for time in range(length):
        if time > 0:
            n_paths = branch(paths, work, n_paths, time, clusters.successors[0, done[time - 1]], log_odds)
        for path in range(n_paths):
            take_in_look(trials, trial, time, clusters.registers, tables, work, path)
            best[path] = best_score(work, path, paths.log_prior[path], prior, weights)
        n_paths = drop(paths, work, best[:n_paths])
    scores = np.full((n_paths, len(clusters.n_trials)), -np.inf)
    for path in range(n_paths):
        for number in range(len(members)):
            scores[path, members[number]] = score_of(work, path, number, paths.log_prior[path], prior)
    return Paths(paths.slipped[:n_paths].copy(), paths.start[:n_paths].copy(), paths.log_prior[:n_paths].copy()), scores


@written_out
def branch(paths: Paths, work: _Work, n_paths: int, time: int, successors: IntArray, log_odds: float) -> int:
    """Let each path go on, and leave another behind for a slip; return how many there are then."""
    log_slip, log_stay = log_odds - np.log1p(np.exp(log_odds)), -np.log1p(np.exp(log_odds))
    n_old, slipped, state, row = n_paths, paths.slipped, work.state, work.row
    for path in range(n_old):
        if n_paths == len(row):
            break
        state[n_paths], paths.start[n_paths] = state[path], paths.start[path]
        paths.log_prior[n_paths] = paths.log_prior[path] + log_slip
        for earlier in range(time - 1):
            slipped[n_paths, earlier] = slipped[path, earlier]
        slipped[n_paths, time - 1] = True
        copy_into(work.local[row[n_paths]], work.local[row[path]])
        copy_into(work.totals[row[n_paths]], work.totals[row[path]])
        n_paths += 1
    for path in range(n_old):
        state[path] = successors[state[path]]
        paths.log_prior[path] += log_stay
    return n_paths


@written_out
def take_in_look(
    trials: TrialArrays, trial: int, time: int, registers: IntArray, tables: FloatArray, work: _Work, path: int
) -> None:
    """Multiply a look into the registers that a path shows, and sum over symbols for all clusters side by side."""
    looks, local, row, state = trials.looks, work.local, work.row[path], work.state[path]
    for slot in range(registers.shape[1]):
        register = registers[state, slot]
        for symbol in range(tables.shape[1]):
            local[row, register, symbol] *= looks[trial, time, slot, symbol]
        sum_products(tables, register, local[row], register, work.totals, row)


@written_out
def best_score(work: _Work, path: int, log_prior: float, prior: FloatArray, weights: FloatArray) -> float:
    """Return the greatest of the scores of a path, over clusters.

    A logarithm takes longer than all else: it is taken for the clusters alone that may be the best.

    Args:
        work: What is followed.
        path: Which one.
        log_prior: Of its slips.
        prior: Ln of what each cluster weighs, shape [K].
        weights: The same as a factor, shape [K].
    """
    totals, row, products = work.totals, work.row[path], weights.copy()
    for register in range(totals.shape[1]):
        for number in range(len(products)):
            products[number] *= totals[row, register, number]
    most, result = products.max(), -np.inf
    least = most * _AS_GOOD if SMALL < most < 1.0 / SMALL else -1.0
    for number in range(len(products)):
        if products[number] >= least:
            result = max(result, score_of(work, path, number, log_prior, prior))
    return result


@compiled_within
def score_of(work: _Work, path: int, number: int, log_prior: float, prior: FloatArray) -> float:
    """Return ln p(trial, path | cluster)."""
    score = log_prior + prior[number]
    for register in range(work.totals.shape[1]):
        score += np.log(max(work.totals[work.row[path], register, number], 1e-300))
    return float(score)


@written_out
def drop(paths: Paths, work: _Work, best: FloatArray) -> int:
    """Forget paths that are negligible beside the best; return how many are left. These are in order, best first."""
    n_paths, least, n_kept = len(best), best.max() + np.log(_LEAST_PATH), 0
    for path in range(n_paths):
        n_kept += best[path] > least
    if n_kept == n_paths <= _MAX_PATHS:
        return n_paths
    n_kept = min(n_kept, _MAX_PATHS)
    kept = np.argsort(-best)
    state, row, start, log_prior = work.state[kept], work.row[kept], paths.start[kept], paths.log_prior[kept]
    slipped = paths.slipped[kept[:n_kept]]
    for path in range(n_paths):
        work.row[path] = row[path]
    for path in range(n_kept):
        work.state[path], paths.start[path], paths.log_prior[path] = state[path], start[path], log_prior[path]
    copy_into(paths.slipped, slipped)
    return n_kept


@compiled
def path_move(
    trials: TrialArrays,
    trial: int,
    clusters: Clusters,
    done: IntArray,
    log_odds: float,
    log_new: FloatArray,
    rng: np.random.Generator,
    votes: FloatArray,
) -> None:
    """Draw object, start and slips of a trial jointly by forward filtering, given all other trials.

    As exact as the paths that were kept; the arguments are those of ``slip_moves`` and ``trial_move``.
    """
    path, stay = np.empty(trials.looks.shape[1], np.int64), clusters.successors.shape[1] - 1
    free, n_clusters = take_out(trials, trial, clusters, path)
    prior = cluster_weights(trials, trial, clusters, free, log_new[n_clusters])
    paths, scores = slip_paths(trials, trial, done, clusters, free, prior, log_odds)
    if len(votes) > 0:
        count_votes(np.ascontiguousarray(scores.T), free, votes)
    drawn = draw_by_logarithm(scores.ravel(), 1.0, rng)
    which, cluster = drawn // scores.shape[1], drawn % scores.shape[1]
    for time in range(trials.lengths[trial] - 1):
        trials.actions[trial, time] = stay if paths.slipped[which, time] else done[time]
    put_in(trials, trial, clusters, cluster, paths.start[which], path)
