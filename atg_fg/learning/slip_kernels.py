"""Actions that fail: a slip is one more action, *stay*. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled
from atg_fg.learning.gibbs_kernels import count_votes, log_total, put_in, take_out
from atg_fg.learning.kernels import Clusters, TrialArrays, copy_into, draw_by_logarithm
from atg_fg.learning.object_kernels import cluster_weights
from atg_fg.learning.weight_kernels import trial_weights

#: Paths with slips that are followed at once, and how improbable one may be beside the best.
_MAX_PATHS = 256
_LEAST_PATH = 1e-7


@compiled
def slip_moves(
    trials: TrialArrays,
    trial: int,
    clusters: Clusters,
    done: IntArray,
    log_odds: float,
    log_new: FloatArray,
    n_tries: int,
    rng: np.random.Generator,
) -> None:
    """Toggle actions of a trial between what was asked for and *stay*, then draw its object and start.

    Args:
        trials: All of them; the actions of this one are changed in place.
        trial: Which one.
        clusters: Changed in place.
        done: The actions that were asked for, shape [T].
        log_odds: ln ε / (1 − ε) of a slip.
        log_new: As for ``trial_move``.
        n_tries: How many toggles are tried.
        rng: Draws.
    """
    path, stay = np.empty(trials.looks.shape[1], np.int64), clusters.successors.shape[1] - 1
    free, n_clusters = take_out(trials, trial, clusters, path)
    weights = np.empty((len(clusters.n_trials), len(clusters.registers)))
    toggled = np.empty_like(weights)
    trial_weights(trials, trial, clusters, free, log_new[n_clusters], weights)
    before = log_total(weights.ravel())
    for _ in range(n_tries if trials.lengths[trial] > 1 else 0):
        time = rng.integers(0, trials.lengths[trial] - 1)
        old = trials.actions[trial, time]
        trials.actions[trial, time] = done[time] if old == stay else stay
        trial_weights(trials, trial, clusters, free, log_new[n_clusters], toggled)
        after = log_total(toggled.ravel())
        gain = after - before + (log_odds if old != stay else -log_odds)
        if rng.random() < 1.0 / (1.0 + np.exp(-gain)):
            before, weights, toggled = after, toggled, weights
        else:
            trials.actions[trial, time] = old
    drawn = draw_by_logarithm(weights.ravel(), 1.0, rng)
    put_in(trials, trial, clusters, drawn // weights.shape[1], drawn % weights.shape[1], path)


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


@compiled
def slip_paths(
    trials: TrialArrays,
    trial: int,
    done: IntArray,
    clusters: Clusters,
    free: int,
    log_new: float,
    log_odds: float,
) -> tuple[Paths, FloatArray]:
    """Follow all ways a trial may have gone, by the shared automaton, without the ones that become negligible.

    Returns:
        The paths and ln p(trial, path | cluster), shape [B, C].
    """
    n_clusters, n_registers, n_symbols = clusters.tables.shape
    n_states, length = len(clusters.registers), trials.lengths[trial]
    log_slip = log_odds - np.log1p(np.exp(log_odds))
    log_stay = -np.log1p(np.exp(log_odds))
    capacity = max(2 * _MAX_PATHS, n_states)
    n_paths = n_states
    state, start, log_prior = np.arange(capacity), np.arange(capacity), np.zeros(capacity)
    slipped = np.zeros((capacity, max(length, 1)), np.bool_)
    local = np.ones((capacity, n_registers, n_symbols))
    # ln Σ_c table(r, c) local(r, c) of each path, register and cluster; 0 where nothing was seen yet
    factors = np.zeros((capacity, n_registers, n_clusters))
    scores = np.full((capacity, n_clusters), -np.inf)
    prior = cluster_weights(trials, trial, clusters, free, log_new)
    for time in range(length):
        if time > 0:
            n_old = n_paths
            for path in range(n_old):
                if n_paths == capacity:
                    break
                state[n_paths], start[n_paths] = state[path], start[path]
                log_prior[n_paths] = log_prior[path] + log_slip
                for earlier in range(time - 1):
                    slipped[n_paths, earlier] = slipped[path, earlier]
                slipped[n_paths, time - 1] = True
                copy_into(local[n_paths], local[path])
                copy_into(factors[n_paths], factors[path])
                n_paths += 1
            for path in range(n_old):
                state[path] = clusters.successors[0, done[time - 1], state[path]]
                log_prior[path] += log_stay
        peak = -np.inf
        for path in range(n_paths):
            for slot in range(clusters.registers.shape[1]):
                register = clusters.registers[state[path], slot]
                for symbol in range(n_symbols):
                    local[path, register, symbol] *= trials.looks[trial, time, slot, symbol]
                for cluster in range(n_clusters):
                    if clusters.n_trials[cluster] > 0 or cluster == free:
                        total = 0.0
                        for symbol in range(n_symbols):
                            total += clusters.tables[cluster, register, symbol] * local[path, register, symbol]
                        factors[path, register, cluster] = np.log(max(total, 1e-300))
            for cluster in range(n_clusters):
                if clusters.automaton[cluster] == 0 and (clusters.n_trials[cluster] > 0 or cluster == free):
                    score = log_prior[path] + prior[cluster]
                    for register in range(n_registers):
                        score += factors[path, register, cluster]
                    scores[path, cluster] = score
                    peak = max(peak, score)
                else:
                    scores[path, cluster] = -np.inf
        best = np.empty(n_paths)
        for path in range(n_paths):
            best[path] = scores[path].max()
        order = np.argsort(-best)
        n_kept = 0
        kept = np.empty(n_paths, np.int64)
        for path in order:
            if n_kept < _MAX_PATHS and best[path] > peak + np.log(_LEAST_PATH):
                kept[n_kept] = path
                n_kept += 1
        kept = kept[:n_kept]
        if n_kept < n_paths:
            old_state, old_start, old_prior = state[kept], start[kept], log_prior[kept]
            old_local, old_factors = local[kept], factors[kept]
            for path in range(n_kept):
                state[path], start[path], log_prior[path] = old_state[path], old_start[path], old_prior[path]
                copy_into(local[path], old_local[path])
                copy_into(factors[path], old_factors[path])
            copy_into(slipped, slipped[kept])
            copy_into(scores, scores[kept])
            n_paths = n_kept
    return Paths(slipped[:n_paths].copy(), start[:n_paths].copy(), log_prior[:n_paths].copy()), scores[:n_paths].copy()


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
    paths, scores = slip_paths(trials, trial, done, clusters, free, log_new[n_clusters], log_odds)
    if len(votes) > 0:
        count_votes(np.ascontiguousarray(scores.T), free, votes)
    drawn = draw_by_logarithm(scores.ravel(), 1.0, rng)
    which, cluster = drawn // scores.shape[1], drawn % scores.shape[1]
    for time in range(trials.lengths[trial] - 1):
        trials.actions[trial, time] = stay if paths.slipped[which, time] else done[time]
    put_in(trials, trial, clusters, cluster, paths.start[which], path)
