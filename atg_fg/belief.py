"""The belief over identity: remembered objects one by one, and all unseen ones together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from atg_fg.belief_table import SHOWN, BeliefTable
from atg_fg.errors import InvalidInputError
from atg_fg.patterns import FloatArray

#: Smallest normal number: x ln x of what is below it is zero up to rounding.
_LEAST: Final = float(np.finfo(np.float64).tiny)


def x_log_x(x: FloatArray) -> FloatArray:
    """Return x ln x, elementwise, with 0 ln 0 = 0."""
    # A logarithm of all elements is several times as quick as one of those that are positive.
    return x * np.log(np.maximum(x, _LEAST))


def log_of(x: FloatArray) -> FloatArray:
    """Return ln x, elementwise, with ln 0 = −∞."""
    return np.log(x, out=np.full_like(x, -np.inf), where=x > 0)


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

    @classmethod
    def of(cls, probabilities: FloatArray, n_unseen: int) -> IdentityBelief:
        """Return the belief with these probabilities of the states of O, shape [K + 1], *unseen* last."""
        return cls(probabilities[:-1], float(probabilities[-1]), n_unseen)

    @classmethod
    def uniform(cls, n_objects: int, n_unseen: int) -> IdentityBelief:
        """Return the belief that each of ``n_objects`` remembered and ``n_unseen`` other objects is as probable."""
        return cls.of(np.append(np.ones(n_objects), n_unseen) / (n_objects + n_unseen), n_unseen)

    @property
    def probabilities(self) -> FloatArray:
        """Probability of each state of O, shape [K + 1]: the remembered objects, then *unseen*."""
        return np.append(self.objects, self.unseen)

    def named(self, names: Sequence[str], shown: int = SHOWN) -> BeliefTable:
        """Return the belief with the names of the remembered objects, as a table that a notebook shows.

        Args:
            names: One for each remembered object, in the order of their index.
            shown: How many objects are shown one by one, the most probable first.

        Raises:
            InvalidInputError: Another number of names, or ``shown`` is below one.
        """
        return BeliefTable(self, names, shown)

    def _repr_html_(self) -> str:
        return self.named([f"object {index}" for index in range(len(self.objects))])._repr_html_()

    def check(self, n_objects: int, n_unseen: int) -> None:
        """Check that this is a distribution over ``n_objects`` remembered objects and ``n_unseen`` unseen ones.

        Raises:
            InvalidInputError: It is about other objects, or its probabilities are not finite numbers of at least 0
                whose sum is 1 within 1e-9.
        """
        if np.shape(self.objects) != (n_objects,) or self.n_unseen != n_unseen:
            raise InvalidInputError(
                f"belief: objects of shape {np.shape(self.objects)} and {self.n_unseen} unseen ones; "
                f"expected shape ({n_objects},) and {n_unseen}"
            )
        probabilities = self.probabilities
        if not (probabilities.min() >= 0 and abs(probabilities.sum() - 1.0) <= 1e-9):  # a NaN is neither
            raise InvalidInputError(
                f"belief: probabilities from {probabilities.min()!r} with sum {probabilities.sum()!r}; "
                "expected none below 0, and sum 1 within 1e-9"
            )

    def with_prior(self, prior: IdentityBelief, instead_of: IdentityBelief) -> IdentityBelief:
        """Return what the same evidence makes of another prior p(O) than the one that this belief began with.

        An object that the old prior ruled out stays ruled out.
        """
        began, wanted = instead_of.probabilities, prior.probabilities
        weights = np.divide(self.probabilities * wanted, began, out=np.zeros_like(began), where=began > 0)
        return IdentityBelief.of(weights / weights.sum(), self.n_unseen)

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
        return int(self.probabilities.argmax())

    @property
    def entropy(self) -> float:
        """H(O) in nats, with the unseen objects counted one by one."""
        return max(0.0, float(self.unseen * np.log(self.n_unseen) - x_log_x(self.probabilities).sum()))

    @property
    def entropy_of_verdict(self) -> float:
        """H(O) in nats, with *unseen* as one state: what is left to settle before the object is judged."""
        return max(0.0, -float(x_log_x(self.probabilities).sum()))
