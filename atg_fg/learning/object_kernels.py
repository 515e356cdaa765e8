"""What readings of the object as a whole say of the cluster of a trial. Compiled as ``atg_fg.learning.kernels``.

With the readings of a sense in units of its error and counted from what is typical, an object has w ~ N(0, v₀), and
k readings of the mean r̄ in one more trial have, beside n of the sum S in its other trials,

    p(r̄ | cluster) = N(r̄; S v, 1/k + v),   v = 1 / (1/v₀ + n);

how the k readings scatter is the same for all clusters.
"""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference.kernels.compilation import compiled
from atg_fg.learning.kernels import Clusters, TrialArrays


@compiled
def cluster_weights(trials: TrialArrays, trial: int, clusters: Clusters, free: int, log_new: float) -> FloatArray:
    """Return ln of what each cluster weighs for a trial before its looks, up to a constant, shape [C].

    Args:
        trials: All of them.
        trial: One that is taken out.
        clusters: Of the others.
        free: The cluster that stands for a new object.
        log_new: Ln of its weight beside that of each known object.
    """
    result = np.zeros(len(clusters.n_trials))
    result[free] = log_new
    for sense in range(trials.felt.shape[1]):
        own, spread = trials.felt[trial, sense, 0], trials.felt[trial, sense, 2]
        if own == 0.0:
            continue
        mean = trials.felt[trial, sense, 1] / own
        count, total = np.zeros(len(result)), np.zeros(len(result))
        for other in range(len(clusters.owner)):
            cluster = clusters.owner[other]
            if cluster >= 0 and other != trial:
                count[cluster] += trials.felt[other, sense, 0]
                total[cluster] += trials.felt[other, sense, 1]
        for cluster in range(len(result)):
            left = 1.0 / (1.0 / spread + count[cluster])
            variance = 1.0 / own + left
            result[cluster] -= 0.5 * (np.log(variance) + (mean - total[cluster] * left) ** 2 / variance)
    return result


@compiled
def log_felt(trials: TrialArrays, clusters: Clusters) -> float:
    """Return ln p(readings of all trials | which are of one object), up to a constant."""
    result = 0.0
    for sense in range(trials.felt.shape[1]):
        count, total = np.zeros(len(clusters.n_trials)), np.zeros(len(clusters.n_trials))
        for trial in range(len(clusters.owner)):
            if clusters.owner[trial] >= 0:
                count[clusters.owner[trial]] += trials.felt[trial, sense, 0]
                total[clusters.owner[trial]] += trials.felt[trial, sense, 1]
        for cluster in range(len(count)):
            grown = 1.0 + count[cluster] * trials.felt[0, sense, 2]
            result += 0.5 * (trials.felt[0, sense, 2] * total[cluster] ** 2 / grown - np.log(grown))
    return result
