"""The belief over identity: remembered objects one by one, and all unseen ones together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.log_math import x_log_x
from atg_fg.core.patterns import FloatArray, read_only
from atg_fg.core.table import Bar, Cell, Table

#: Objects that a table shows one by one.
SHOWN: Final = 5


@dataclass(frozen=True, eq=False)
class IdentityBelief:
    """p(O | z, a), normalised.

    Attributes:
        objects: Probability of each remembered object (eq. 2), shape [K]; its own copy, which cannot be written to.
        unseen: Probability that the object was never met (eq. 1).
        n_unseen: U, how many objects *unseen* stands for.
    """

    objects: FloatArray
    unseen: float
    n_unseen: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "objects", read_only(np.array(self.objects, dtype=np.float64)))

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        return IdentityBelief, (self.objects, self.unseen, self.n_unseen)  # so that no copy can be written to, either

    @classmethod
    def of(cls, probabilities: FloatArray, n_unseen: int) -> IdentityBelief:
        """Return the belief with these probabilities of the states of O, shape [K + 1], *unseen* last."""
        return cls(probabilities[:-1], float(probabilities[-1]), n_unseen)

    @classmethod
    def uniform(cls, n_objects: int, n_unseen: int) -> IdentityBelief:
        """Return the belief in which ``n_objects`` remembered and ``n_unseen`` other objects are equally probable."""
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


def entropies(beliefs: Sequence[IdentityBelief]) -> list[float]:
    """Return H(O) of each belief in nats, bit for bit as its ``entropy``; all of them are over the same objects."""
    if not beliefs:
        return []
    n_unseen = np.array([belief.n_unseen for belief in beliefs])
    probabilities = np.empty((len(beliefs), 1 + len(beliefs[0].objects)))
    for row, belief in zip(probabilities, beliefs, strict=True):
        row[:-1], row[-1] = belief.objects, belief.unseen
    found = probabilities[:, -1] * np.log(n_unseen) - x_log_x(probabilities).sum(axis=1)
    return [max(0.0, each) for each in found.tolist()]


class BeliefTable:
    """p(O | z, a) by name, the most probable objects first; shows itself in a notebook.

    Args:
        belief: Over as many remembered objects as there are names.
        names: Of the remembered objects, in the order of their index.
        shown: How many objects are shown one by one.

    Raises:
        InvalidInputError: Another number of names, or ``shown`` is below one.

    Attributes:
        belief: The belief.
        names: The names.
    """

    def __init__(self, belief: IdentityBelief, names: Sequence[str], shown: int = SHOWN) -> None:
        if len(names) != len(belief.objects):
            raise InvalidInputError(f"names: {len(names)}; expected one for each of {len(belief.objects)} objects")
        if shown < 1:
            raise InvalidInputError(f"shown: {shown!r}; expected a whole number of at least 1")
        self.belief, self.names, self.shown = belief, tuple(names), shown

    @property
    def unseen(self) -> float:
        """Probability that the object was never met."""
        return self.belief.unseen

    def __getitem__(self, name: str) -> float:
        """Return the probability of the remembered object of this name.

        Raises:
            UnknownNameError: None has this name.
        """
        if name not in self.names:
            raise unknown_name("belief", name, self.names)
        return float(self.belief.objects[self.names.index(name)])

    def __len__(self) -> int:
        """K, the number of remembered objects."""
        return len(self.names)

    def __iter__(self) -> Iterator[tuple[str, float]]:
        """Yield name and probability of every remembered object, the most probable first."""
        for index in np.argsort(-self.belief.objects, kind="stable"):
            yield self.names[index], float(self.belief.objects[index])

    def table(self) -> Table:
        """Return the table that is shown: the best objects, all others together, and *unseen*."""
        best = [pair for _, pair in zip(range(self.shown), self, strict=False)]
        rows: list[tuple[Cell, ...]] = [(name, _probability(value)) for name, value in best]
        others = len(self) - len(best)
        if others:
            rest = max(0.0, 1.0 - self.unseen - sum(value for _, value in best))
            rows.append((f"{others} {'other' if others == 1 else 'others'}", _probability(rest)))
        rows.append((f"unseen ({self.belief.n_unseen} never met)", _probability(self.unseen)))
        known = self.belief.most_probable_object
        verdict = "novel" if self.belief.is_novel or known is None else f"known, {self.names[known]}"
        note = f"entropy {self.belief.entropy:.3f} nats; judged {verdict}"
        return Table("Belief over identity", ("object", "probability"), tuple(rows), note)

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    def __repr__(self) -> str:
        return repr(self.table())


def _probability(value: float) -> Bar:
    return Bar(value, f"{value:.3f}")
