"""Remembered objects that know no pattern seen so far: one interval of weights for all that know equally many.

The derivation is in ``docs/large_memories.md``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from atg_fg.core.compact.columns import AnyIntArray
from atg_fg.core.compact.compact_memory import CompactMemory, GraphArrays
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.engines.large_memory.aspect_filter import AspectFilter, Hidden
from atg_fg.inference.recognition_model import COLLECTION


class ClassMasses(NamedTuple):
    """Masses of one object of each class, on any common scale.

    Attributes:
        mass: Of the collection node and of each aspect found in the trial, the middle of its bounds, shape [C, W].
        hidden: Of the aspects known before the trial, the middle of its bounds, shape [C].
        total: Their sum, shape [C].
        unsure: How far ``total`` may be from the true weight, shape [C].
        unsure_states: How far ``mass`` and ``hidden`` may be, in all, from where the mass truly is, shape [C].
    """

    mass: FloatArray
    hidden: FloatArray
    total: FloatArray
    unsure: FloatArray
    unsure_states: FloatArray


class NeverMatched:
    """Classes of objects, by their number n of aspects known before the trial, with bounds of what one of them weighs.

    In ``filter`` row c is an upper bound of each mass of an object of class c, and row C + c a lower one: what counted
    edges do with the mass on aspects known before the trial, which is of the order of δ, differs from object to object
    and is not looked at.

    Args:
        memory: The robot memory.
        parameters: α, δ and whether to learn within the trial.
        log_prior: ln p(O = i) of each remembered object.

    Attributes:
        members: Number of objects in each class, shape [C].
        showing: Number of these that show each pattern, shape [C, |𝒵|].
        filter: The bounds.
    """

    def __init__(self, memory: CompactMemory, parameters: ModelParameters, log_prior: float) -> None:
        classes = memory.size_classes
        sizes = classes.sizes
        self.members = classes.members
        self.showing = classes.showing
        self._row_of_each = classes.row_of_each
        n_classes, n_aspects = len(sizes), memory.assumptions.n_aspects
        number = np.tile(sizes, 2).astype(np.float64)
        upper = np.repeat((True, False), n_classes)
        hidden = Hidden(number, upper.astype(np.float64), np.where(upper, 1.0, number / n_aspects))
        log_weight = np.full(2 * n_classes, log_prior)
        self.filter = AspectFilter(memory.assumptions, parameters, log_weight, hidden)

    @property
    def n_classes(self) -> int:
        """C."""
        return len(self.members)

    def rows_of(self, n_known: AnyIntArray) -> IntArray:
        """Return the class of each of some objects that knew n aspects before the trial."""
        return self._row_of_each(n_known)

    def remove(self, graphs: GraphArrays) -> None:
        """Take objects out of their classes."""
        rows = self.rows_of(graphs.n_known)
        self.members -= np.bincount(rows, minlength=self.n_classes)
        np.subtract.at(self.showing, (np.repeat(rows, graphs.n_known.astype(np.int64)), graphs.patterns), 1.0)

    def log_of_classes(self, log_weight: FloatArray, members: IntArray) -> FloatArray:
        """Return ln of what the members of each class weigh together, −∞ where there are none, shape [C].

        Args:
            log_weight: Of ``filter``, shape [2 C].
            members: Number of members of each class, shape [C].
        """
        high, low = log_weight[: self.n_classes], log_weight[self.n_classes :]
        possible = (members > 0) & np.isfinite(high)
        logarithms = np.full(self.n_classes, -np.inf)
        middle = high[possible] + np.log((1.0 + np.exp(low[possible] - high[possible])) / 2.0)
        logarithms[possible] = middle + np.log(members[possible])
        return logarithms

    def masses(self, log_scale: float) -> ClassMasses:
        """Return what one object of each class weighs, divided by exp ``log_scale``."""
        weights = np.exp(self.filter.log_weight - log_scale)
        mass = self.filter.mass * weights[:, None]
        hidden = self.filter.hidden_mass * weights
        half = self.n_classes
        low, high = mass[half:], mass[:half]
        middle, hidden_middle = (high + low) / 2, (hidden[:half] + hidden[half:]) / 2
        unsure_states = np.maximum(high - low, 0.0).sum(axis=1) / 2
        return ClassMasses(
            middle,
            hidden_middle,
            middle.sum(axis=1) + hidden_middle,
            unsure_states + np.maximum(hidden[:half] - hidden[half:], 0.0) / 2,
            unsure_states + hidden[:half],
        )

    def kept(self, masses: ClassMasses) -> FloatArray:
        """Return S of one object of each class under each action, [A, C]; its edges among hidden aspects left out."""
        listed: FloatArray = np.einsum("cw,acw->ac", masses.mass, self.filter.prior_weight[:, : self.n_classes])
        return listed + masses.hidden

    def arrivals(self, masses: ClassMasses) -> FloatArray:
        """Return what edges counted in the trial carry to each aspect found in it, shape [A, C, W]."""
        padded = np.concatenate((masses.mass, np.zeros_like(masses.mass)))
        actions = range(len(self.filter.edges))
        return np.stack([self.filter.arrivals(action, padded)[: self.n_classes] for action in actions])

    @property
    def shown(self) -> IntArray:
        """Pattern of each aspect found in the trial, shape [C, W]; −1 for collection nodes and padding."""
        return self.filter.pattern[: self.n_classes].astype(np.int64)

    @property
    def n_known(self) -> IntArray:
        """N of an object of each class, with what it has learned in the trial, shape [C]."""
        return self.filter.n_known[: self.n_classes]

    def collection_share(self) -> FloatArray:
        """Return m/G of each class, shape [C]."""
        return self.filter.n_unobserved[: self.n_classes] / self.filter.n_aspects

    def collection_rate(self) -> FloatArray:
        """Return p(z | C) without noise of each class, shape [C]."""
        return self.filter.collection_rate[: self.n_classes]

    def aspects_of_one(self, masses: ClassMasses, row: int) -> FloatArray:
        """Return p(X_t | O) of an object of a class: the collection node, the n hidden aspects alike, those found."""
        number = int(self.filter.hidden.number[row])
        spread = np.full(number, masses.hidden[row] / max(number, 1))
        aspects = np.concatenate((masses.mass[row, : COLLECTION + 1], spread, masses.mass[row, COLLECTION + 1 :]))
        return aspects / masses.total[row] if masses.total[row] > 0 else aspects
