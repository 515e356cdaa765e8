"""Which trials are of one object: one partition for the many that were sampled.

A partition that takes trials u and v for those of one object is wrong of that pair with probability 1 − S_uv, else with
S_uv, where S_uv is the share of the samples in which they are (Binder's loss; Dahl 2006). From what was taken for true
so far, trials are moved one at a time to the object that makes fewest pairs wrong, until none moves.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.learning import partition_kernels

#: Passes over all trials, at most.
_MOST_PASSES: Final = 8


def estimated_partition(samples: IntArray, weights: FloatArray, before: IntArray) -> IntArray:
    """Return the number of the object of each trial, shape [N]; numbers that were there before stay where they can.

    Args:
        samples: Object of each trial in each sample, shape [M, N]; each sample has numbers of its own, from 0 to N + 1.
        weights: Of the samples; they sum to one, shape [M].
        before: Number of the object that each was taken for so far, from 0 to N − 1, shape [N].
    """
    order = np.argsort(samples, axis=1, kind="stable")
    n_numbers = samples.shape[1] + 2
    counts = np.array([np.bincount(sample, minlength=n_numbers) for sample in samples])
    begins = np.concatenate((np.zeros((len(samples), 1), dtype=np.int64), np.cumsum(counts, axis=1)), axis=1)
    estimate = before.astype(np.int64)
    partition_kernels.move_trials(samples, order, begins, weights, estimate, _MOST_PASSES)
    return estimate
