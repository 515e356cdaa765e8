"""How many objects there are: the prior of which trials are of one object.

Each trial is of one of M objects, each as probable. M is N, the number that is told, with probability 0.9999, else any
from 1 to N. So a partition of T trials into K objects has the probability

    Σ_M p(M) (M)_K / M^T,   (M)_K = M (M − 1) … (M − K + 1)

and a robot that is told of more objects than it ever meets finds out. It may also be told of too few: that there is one
more is 0.05 times as probable, so p(K) / p(K − 1) = 0.05 K (1 − 1/K)^T for K > N.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray

#: Probability that there are as many objects as the robot is told.
TOLD: Final = 0.9999
#: How probable one object more than told is, beside no more.
ONE_TOO_MANY: Final = 0.05
#: Numbers of objects that are summed over; of more, some stand for all.
_MAX_NUMBERS: Final = 400


def log_partition(n_objects: int, n_trials: int, most: int) -> FloatArray:
    """Return ln p(a partition into K objects) for K = 0 … ``most``, shape [most + 1].

    Args:
        n_objects: N.
        n_trials: T.
        most: The greatest K.
    """
    numbers = np.unique(np.geomspace(1, n_objects, _MAX_NUMBERS).round()) if n_objects > _MAX_NUMBERS else None
    numbers = np.arange(1.0, n_objects + 1) if numbers is None else numbers
    width = np.diff(numbers, prepend=0.0)
    prior = (1.0 - TOLD) * width / width.sum()
    prior[-1] += TOLD
    left = numbers[:, None] - np.arange(min(most, n_objects))
    factors = np.where(left > 0, np.log(np.maximum(left, 1.0)), -np.inf)
    falling = np.concatenate((np.zeros((len(numbers), 1)), np.cumsum(factors, axis=1)), axis=1)
    result: FloatArray = np.logaddexp.reduce(
        np.log(prior)[:, None] + falling - n_trials * np.log(numbers)[:, None], axis=0
    )
    more = np.arange(n_objects + 1.0, most + 1.0)
    steps = np.log(ONE_TOO_MANY * more) + n_trials * np.log1p(-1.0 / more)
    return np.append(result, result[-1] + np.cumsum(steps))


def log_new_weights(n_objects: int, n_trials: int, most: int) -> FloatArray:
    """Return ln of the weight of a new object beside each known one, by how many are known, shape [most].

    Args:
        n_objects: N.
        n_trials: T, with the trial in question.
        most: One more than the greatest number of known objects.
    """
    weights: FloatArray = np.diff(log_partition(n_objects, n_trials, most))
    return weights
