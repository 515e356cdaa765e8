"""Moves of trials between objects by how often samples have them together. Compiled as ``atg_fg.learning.kernels``."""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled

#: A move has to be worth so much of a pair, lest rounding moves trials to and fro.
_LEAST_GAIN = 1e-9


@compiled
def move_trials(
    samples: IntArray, order: IntArray, begins: IntArray, weights: FloatArray, estimate: IntArray, most_passes: int
) -> None:
    """Move trials one at a time to the object that makes fewest pairs wrong.

    Args:
        samples: Object of each trial in each sample, shape [M, N].
        order: Trials of each sample by their object, shape [M, N].
        begins: Where those of each object begin, and the last ones end, shape [M, C + 1].
        weights: Of the samples, shape [M].
        estimate: Object of each trial, from 0 to N − 1, shape [N]; changed in place.
        most_passes: Over all trials.
    """
    n_trials = len(estimate)
    sizes = np.bincount(estimate, minlength=n_trials)
    gains, near = np.zeros(n_trials), np.empty(n_trials, np.int64)
    for _ in range(most_passes):
        has_moved = False
        for trial in range(n_trials):
            n_near, mine = 0, estimate[trial]
            sizes[mine] -= 1
            for sample in range(len(samples)):
                if weights[sample] <= 0.0:
                    continue
                number = samples[sample, trial]
                for position in range(begins[sample, number], begins[sample, number + 1]):
                    other = order[sample, position]
                    if other != trial:
                        if gains[estimate[other]] == 0.0:
                            near[n_near] = estimate[other]
                            n_near += 1
                        gains[estimate[other]] += weights[sample]
            # Alone, no pair is taken for one of one object.
            chosen, most = -1, 0.0
            for index in range(n_near):
                gain = gains[near[index]] - 0.5 * sizes[near[index]]
                if gain > most + _LEAST_GAIN:
                    chosen, most = near[index], gain
            stays = gains[mine] - 0.5 * sizes[mine]
            if stays >= most - _LEAST_GAIN:
                chosen = mine
            for index in range(n_near):
                gains[near[index]] = 0.0
            if chosen < 0:
                chosen = mine
                while sizes[chosen] > 0:
                    chosen = (chosen + 1) % n_trials
            has_moved = has_moved or chosen != mine
            estimate[trial] = chosen
            sizes[chosen] += 1
        if not has_moved:
            break
