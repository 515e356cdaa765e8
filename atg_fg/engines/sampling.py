"""What the sampling engines share."""

from __future__ import annotations

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray


def drawn(rows: FloatArray, rng: np.random.Generator) -> IntArray:
    """Return a column drawn from each row of weights, shape [n] from [n, W]; the weights need not be normalised."""
    cumulative = np.cumsum(rows, axis=1)
    total = cumulative[:, -1:]
    columns = (cumulative <= rng.random((len(rows), 1)) * total).sum(axis=1)
    # A threshold may be rounded up to the total; the last column with a weight is the first that reaches it.
    last = (cumulative < total).sum(axis=1)
    chosen: IntArray = np.minimum(columns, last).astype(np.int64)
    return chosen


def split_r_hat(chains: FloatArray) -> float:
    """Return the potential scale reduction factor of split chains, shape [C, S]; near 1 once they have mixed.

    Each chain is cut into halves, and √((W (n − 1)/n + B/n) / W) compares the variance B/n of the halves' means with
    the mean W of their variances. It is 1 if nothing varies, and infinite if the halves differ only from each other.
    """
    n = chains.shape[1] // 2
    halves = np.concatenate((chains[:, :n], chains[:, -n:]))
    within = float(halves.var(axis=1, ddof=1).mean())
    between = float(halves.mean(axis=1).var(ddof=1))
    if within == 0:
        return 1.0 if between == 0 else float("inf")
    return float(np.sqrt((n - 1) / n + between / within))
