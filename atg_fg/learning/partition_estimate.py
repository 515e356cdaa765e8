"""Which trials are of one object: one partition for the many that were sampled.

The distance between two partitions is their variation of information: what each tells that the other does not. The
estimate c is to have the least expected distance from the sampled ones; by a lower bound (Wade & Ghahramani 2018) it
is, up to a constant,

    Σ_n [ ln |c(n)| − 2 ln Σ_{m ∈ c(n)} S_nm ],

where c(n) is the set of trials that are of one object with trial n, itself among them, and S_nm the share of samples in
which n and m are of one object. Trials are moved one at a time to where the sum is least, until none moves.

From what was taken for true so far such moves do not get far: to divide an object the first one has to go alone. So
trials are first moved to where fewest pairs are wrong (Binder's loss; Dahl 2006). That alone would not do: a trial that
samples have now with these, now with those is left alone by it, an object that no sample has.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.learning import partition_kernels

#: Passes over all trials, at most.
_MOST_PASSES: Final = 8
#: Samples of less weight say nothing.
_LEAST_WEIGHT: Final = 1e-6


def estimated_partition(samples: IntArray, weights: FloatArray, before: IntArray) -> IntArray:
    """Return the number of the object of each trial, shape [N]; numbers that were there before stay where they can.

    Args:
        samples: Object of each trial in each sample, shape [M, N]; each sample has numbers of its own, from 0 to N + 1.
        weights: Of the samples; they sum to one, shape [M].
        before: Number of the object that each was taken for so far, from 0 to N − 1, shape [N].
    """
    samples, weights = samples[weights > _LEAST_WEIGHT], weights[weights > _LEAST_WEIGHT]
    order = np.argsort(samples, axis=1, kind="stable")
    n_numbers = samples.shape[1] + 2
    counts = np.array([np.bincount(sample, minlength=n_numbers) for sample in samples])
    begins = np.concatenate((np.zeros((len(samples), 1), dtype=np.int64), np.cumsum(counts, axis=1)), axis=1)
    estimate = before.astype(np.int64)
    for by_pairs in (True, False):
        partition_kernels.move_trials(samples, order, begins, weights, estimate, by_pairs, _MOST_PASSES)
    return estimate
