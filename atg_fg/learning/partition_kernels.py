"""Moves of trials between objects by how often samples have them together. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled, compiled_within

#: A move has to be worth so much, lest rounding moves trials to and fro.
_LEAST_GAIN = 1e-9


@compiled
def move_trials(
    samples: IntArray,
    order: IntArray,
    begins: IntArray,
    weights: FloatArray,
    estimate: IntArray,
    by_pairs: bool,
    most_passes: int,
) -> None:
    """Move trials one at a time to the object where the expected loss is least.

    Args:
        samples: Object of each trial in each sample, shape [M, N].
        order: Trials of each sample by their object, shape [M, N].
        begins: Where those of each object begin, and the last ones end, shape [M, C + 1].
        weights: Of the samples, shape [M].
        estimate: Object of each trial, from 0 to N − 1, shape [N]; changed in place.
        by_pairs: Whether the loss is the number of pairs that are wrong; else it is the variation of information.
        most_passes: Over all trials.
    """
    n_trials = len(estimate)
    sizes = np.bincount(estimate, minlength=n_trials)
    shares, near = np.zeros(n_trials), np.empty(n_trials, np.int64)
    with_own = np.ones(n_trials)  # Σ of a trial's shares with those of its object, itself among them
    for trial in range(n_trials):
        n_near = look_near(samples, order, begins, weights, trial, shares, near)
        for other in near[:n_near]:
            if estimate[other] == estimate[trial]:
                with_own[trial] += shares[other]
            shares[other] = 0.0
    own, losses, objects = np.zeros(n_trials), np.zeros(n_trials), np.empty(n_trials, np.int64)
    for _ in range(most_passes):
        has_moved = False
        for trial in range(n_trials):
            mine, n_objects = estimate[trial], 0
            n_near = look_near(samples, order, begins, weights, trial, shares, near)
            sizes[mine] -= 1
            estimate[trial] = -1
            for other in near[:n_near]:
                number = estimate[other]
                if own[number] == 0.0:
                    objects[n_objects] = number
                    n_objects += 1
                    losses[number] = 0.0
                if number == mine:
                    with_own[other] -= shares[other]
                own[number] += shares[other]
                losses[number] -= 2.0 * np.log1p(shares[other] / with_own[other])
            # Alone it loses nothing.
            chosen, least, stays = -1, 0.0, 0.0 if sizes[mine] == 0 else np.inf
            for number in objects[:n_objects]:
                size = sizes[number]
                if by_pairs:
                    loss = 0.5 * size - own[number]
                else:
                    loss = losses[number] + (size + 1) * np.log(size + 1.0) - size * np.log(size)
                    loss -= 2.0 * np.log1p(own[number])
                if number == mine:
                    stays = loss
                if loss < least - _LEAST_GAIN:
                    chosen, least = number, loss
                own[number] = 0.0
            if stays <= least + _LEAST_GAIN:
                chosen = mine
            if chosen < 0:
                chosen = mine
                while sizes[chosen] > 0:
                    chosen = (chosen + 1) % n_trials
            with_own[trial] = 1.0
            for other in near[:n_near]:
                if estimate[other] == chosen:
                    with_own[trial] += shares[other]
                    with_own[other] += shares[other]
                shares[other] = 0.0
            has_moved = has_moved or chosen != mine
            estimate[trial] = chosen
            sizes[chosen] += 1
        if not has_moved:
            break


@compiled_within
def look_near(
    samples: IntArray,
    order: IntArray,
    begins: IntArray,
    weights: FloatArray,
    trial: int,
    shares: FloatArray,
    near: IntArray,
) -> int:
    """Add the weights of the samples that have a trial with each other one; return how many there are of these.

    Args:
        samples: As for ``move_trials``.
        order: As there.
        begins: As there.
        weights: As there.
        trial: Which one.
        shares: Zeros, to which the weights are added, shape [N].
        near: To be filled in with the others, shape [N].
    """
    n_near = 0
    for sample in range(len(samples)):
        number = samples[sample, trial]
        for other in order[sample, begins[sample, number] : begins[sample, number + 1]]:
            if other != trial:
                if shares[other] == 0.0:
                    near[n_near] = other
                    n_near += 1
                shares[other] += weights[sample]
    return n_near
