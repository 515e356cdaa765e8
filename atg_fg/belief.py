"""The belief over identity: remembered objects one by one, and all unseen ones together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from atg_fg.patterns import FloatArray


def x_log_x(x: FloatArray) -> FloatArray:
    """Return x ln x, elementwise, with 0 ln 0 = 0."""
    return x * np.log(x, out=np.zeros_like(x), where=x > 0)


def log_sum_exp(logarithms: FloatArray) -> float:
    """Return ln Σ exp of logarithms, of which −∞ stands for zero."""
    peak = float(logarithms.max())
    return peak + float(np.log(np.exp(logarithms - peak).sum())) if np.isfinite(peak) else peak


@dataclass(frozen=True, eq=False)
class IdentityBelief:
    """p(O | z, a), normalised.

    Attributes:
        objects: Probability of each remembered object (eq. 2), shape [K].
        unseen: Probability that the object was never met (eq. 1).
        n_unseen: U, how many objects *unseen* stands for.
    """

    objects: FloatArray
    unseen: float
    n_unseen: int

    @property
    def is_novel(self) -> bool:
        """Whether the object is judged novel: the probability of *unseen* is above one half."""
        return self.unseen > 0.5

    @property
    def most_probable_object(self) -> int | None:
        """Index of the most probable remembered object, or ``None`` if nothing is remembered."""
        return int(self.objects.argmax()) if len(self.objects) else None

    @property
    def most_probable_hypothesis(self) -> int:
        """Index of the most probable state of O; K stands for *unseen*."""
        return int(np.append(self.objects, self.unseen).argmax())

    @property
    def entropy(self) -> float:
        """H(O) in nats, with the unseen objects counted one by one."""
        probabilities = np.append(self.objects, self.unseen)
        return max(0.0, float(self.unseen * np.log(self.n_unseen) - x_log_x(probabilities).sum()))
