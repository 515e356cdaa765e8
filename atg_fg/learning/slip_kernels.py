"""Actions that fail: a slip is one more action, *stay*. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import NONE, compiled, written_out
from atg_fg.learning.gibbs_kernels import count_votes, log_total, put_in, take_out
from atg_fg.learning.kernels import Clusters, TrialArrays, copy_into, draw_by_logarithm
from atg_fg.learning.object_kernels import cluster_weights
from atg_fg.learning.weight_kernels import side_by_side, sum_products, trial_weights

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
        state: Where each path is, shape [B].
        shown: What each register has shown on each path, as a history, shape [B, R].
    """

    slipped: NDArray[np.bool_]
    start: IntArray
    log_prior: FloatArray
    state: IntArray
    shown: IntArray


class _Histories(NamedTuple):
    """What a register may have shown, each history once: many paths come to the same. The first ones showed nothing.

    Attributes:
        likelihood: Of each symbol in the register, shape [E, V].
        log_totals: ln Σ_c table(r, c) likelihood(c) of each cluster side by side, shape [E, K].
        longer: The history that a slot makes of it at the last time that it did, shape [E, J].
        time: That time, shape [E, J].
    """

    likelihood: FloatArray
    log_totals: FloatArray
    longer: IntArray
    time: IntArray


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
    n_states, length, (n_registers, n_symbols, n_members) = len(clusters.registers), trials.lengths[trial], tables.shape
    capacity, n_slots, n_paths = max(2 * _MAX_PATHS, n_states), clusters.registers.shape[1], n_states
    paths = Paths(
        np.zeros((capacity, max(length, 1)), np.bool_),
        np.arange(capacity),
        np.zeros(capacity),
        np.arange(capacity),
        np.empty((capacity, n_registers), np.int64),
    )
    for register in range(n_registers):
        paths.shown[:, register] = register
    room = capacity * (n_registers + n_slots)
    histories = _Histories(
        np.empty((room, n_symbols)),
        np.empty((room, n_members)),
        np.empty((room, n_slots), np.int64),
        np.full((room, n_slots), NONE),
    )
    histories.likelihood[:n_registers] = 1.0
    histories.log_totals[:n_registers] = 0.0
    prior, best, n_known = np.empty(n_members), np.empty(capacity), n_registers
    for number in range(n_members):
        prior[number] = all_prior[members[number]]
    scores = np.empty((capacity, n_members))
    for time in range(length):
        if time > 0:
            n_paths = branch(paths, n_paths, time, clusters.successors[0, done[time - 1]], log_odds)
        if n_known + n_paths * n_slots > room:
            n_known = keep(paths, n_paths, histories, n_known)
        for path in range(n_paths):
            n_known = take_in_look(trials, trial, time, clusters.registers, tables, paths, path, histories, n_known)
            score_path(paths, path, histories, prior, scores[path])
            best[path] = scores[path].max()
        n_paths = drop(paths, scores, best[:n_paths])
    found = np.full((n_paths, len(clusters.n_trials)), -np.inf)
    for path in range(n_paths):
        for number in range(n_members):
            found[path, members[number]] = scores[path, number]
    slipped, start, log_prior, state, shown = paths
    return Paths(slipped[:n_paths], start[:n_paths], log_prior[:n_paths], state[:n_paths], shown[:n_paths]), found


@written_out
def branch(paths: Paths, n_paths: int, time: int, successors: IntArray, log_odds: float) -> int:
    """Let each path go on, and leave another behind for a slip; return how many there are then."""
    log_slip, log_stay = log_odds - np.log1p(np.exp(log_odds)), -np.log1p(np.exp(log_odds))
    n_old, (slipped, start, log_prior, state, shown) = n_paths, paths
    for path in range(n_old):
        if n_paths == len(state):
            break
        state[n_paths], start[n_paths], log_prior[n_paths] = state[path], start[path], log_prior[path] + log_slip
        for earlier in range(time - 1):
            slipped[n_paths, earlier] = slipped[path, earlier]
        slipped[n_paths, time - 1] = True
        for register in range(shown.shape[1]):
            shown[n_paths, register] = shown[path, register]
        n_paths += 1
    for path in range(n_old):
        state[path] = successors[state[path]]
        log_prior[path] += log_stay
    return n_paths


@written_out
def take_in_look(
    trials: TrialArrays,
    trial: int,
    time: int,
    registers: IntArray,
    tables: FloatArray,
    paths: Paths,
    path: int,
    histories: _Histories,
    n_known: int,
) -> int:
    """Have the registers that a path shows go on to longer histories; return how many histories are known then."""
    likelihood, log_totals, longer, at = histories
    looks, shown, state = trials.looks, paths.shown, paths.state[path]
    for slot in range(registers.shape[1]):
        register = registers[state, slot]
        before = shown[path, register]
        if at[before, slot] != time:
            at[before, slot], longer[before, slot] = time, n_known
            at[n_known] = NONE
            for symbol in range(tables.shape[1]):
                likelihood[n_known, symbol] = likelihood[before, symbol] * looks[trial, time, slot, symbol]
            sum_products(tables, register, likelihood[n_known], log_totals[n_known])
            for number in range(tables.shape[2]):
                log_totals[n_known, number] = np.log(max(log_totals[n_known, number], 1e-300))
            n_known += 1
        shown[path, register] = longer[before, slot]
    return n_known


@written_out
def keep(paths: Paths, n_paths: int, histories: _Histories, n_known: int) -> int:
    """Forget histories that no path has any more; return how many are left."""
    number, n_left = np.full(n_known, NONE), 0
    for path in range(n_paths):
        for register in range(paths.shown.shape[1]):
            number[paths.shown[path, register]] = 0
    for history in range(n_known):
        if number[history] == 0:
            number[history] = n_left
            histories.likelihood[n_left] = histories.likelihood[history]
            histories.log_totals[n_left] = histories.log_totals[history]
            histories.time[n_left] = NONE
            n_left += 1
    for path in range(n_paths):
        for register in range(paths.shown.shape[1]):
            paths.shown[path, register] = number[paths.shown[path, register]]
    return n_left


@written_out
def score_path(paths: Paths, path: int, histories: _Histories, prior: FloatArray, scores: FloatArray) -> None:
    """Fill in ln p(trial so far, path | cluster) of each cluster side by side, shape [K]."""
    log_prior, shown, log_totals = paths.log_prior[path], paths.shown, histories.log_totals
    for number in range(len(prior)):
        scores[number] = log_prior + prior[number]
    for register in range(shown.shape[1]):
        history = shown[path, register]
        for number in range(len(prior)):
            scores[number] += log_totals[history, number]


@written_out
def drop(paths: Paths, scores: FloatArray, best: FloatArray) -> int:
    """Forget paths that are negligible beside the best; return how many are left. These are in order, best first."""
    n_paths, least, n_kept = len(best), best.max() + np.log(_LEAST_PATH), 0
    for path in range(n_paths):
        n_kept += best[path] > least
    if n_kept == n_paths <= _MAX_PATHS:
        return n_paths
    n_kept = min(n_kept, _MAX_PATHS)
    kept = np.argsort(-best)[:n_kept]
    slipped, start, log_prior, state, shown = paths
    copy_into(slipped, slipped[kept])
    copy_into(shown, shown[kept])
    copy_into(scores, scores[kept])
    new_start, new_prior, new_state = start[kept], log_prior[kept], state[kept]
    for path in range(n_kept):
        start[path], log_prior[path], state[path] = new_start[path], new_prior[path], new_state[path]
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
