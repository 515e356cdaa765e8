"""What readings of the object as a whole say of O: a factor on O alone, for every hypothesis of a trial.

Given O = i the readings of a trial follow each other as those of one object do that was felt n_i times before
(``atg_fg.core.object_sense``); *unseen* is an object that was never felt.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple, Self

import numpy as np

from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import Moments, ObjectSense
from atg_fg.core.patterns import FloatArray, IntArray, Measured, read_only

#: A reading that is this improbable is so of all objects alike: it rules none of them out.
LEAST_DENSITY: Final = 1e-300
#: Readings are looked at up to so many standard deviations from each mean, so many times a standard deviation.
_REACH: Final = 8.0
_STEPS: Final = 4.0
#: Readings less probable than this, and hypotheses, are left out of what may be felt.
_NEGLIGIBLE: Final = 1e-13


class Readings(NamedTuple):
    """Readings that an action may reveal, as nodes of a quadrature.

    Attributes:
        weights: Of each node, shape [Q].
        densities: p(reading | O), shape [Q, H].
        neg_entropies: ∫ p(r | O) ln p(r | O) dr of each hypothesis, shape [H].
    """

    weights: FloatArray
    densities: FloatArray
    neg_entropies: FloatArray


class ObjectTables:
    """What the readings so far say of the next one, for S senses and H hypotheses; ``after`` makes another one.

    Args:
        senses: Of the object.
        counts: n of each hypothesis, shape [S, H].
        totals: Their sum on the scale of the sense, shape [S, H].
        variances: σ² of each sense, shape [S].
    """

    def __init__(
        self, senses: Sequence[ObjectSense], counts: FloatArray, totals: FloatArray, variances: Sequence[float]
    ) -> None:
        self.senses, self.counts, self.totals = tuple(senses), read_only(counts), read_only(totals)
        self.variances = tuple(variances)

    @classmethod
    def of(cls, memory: RobotMemory) -> Self:
        """Return the tables at the beginning of a trial."""
        senses = memory.assumptions.object_senses
        if not senses:
            return cls((), np.zeros((0, 0)), np.zeros((0, 0)), ())
        felt = [[graph.measured.get(sense.name, Moments()) for graph in memory] for sense in senses]
        counts = np.array([[*(each.count for each in row), 0] for row in felt], dtype=np.float64)
        totals = np.array([[*(each.total for each in row), 0] for row in felt], dtype=np.float64)
        return cls(senses, counts, totals, [sense.variance(row) for sense, row in zip(senses, felt, strict=True)])

    def next_readings(self, number: int) -> tuple[FloatArray, FloatArray]:
        """Return mean and variance of the next reading of a sense on its scale, each of shape [H]."""
        return self.senses[number].next_reading(self.counts[number], self.totals[number], self.variances[number])

    def likelihood(self, measured: Measured) -> FloatArray:
        """Return p(readings | O, the readings before), a density on the scale of each sense, shape [H]."""
        log_density, tables = np.zeros(self.counts.shape[1]), self
        for name, reading in measured:
            number = self._number(name)
            mean, variance = tables.next_readings(number)
            log_density += _log_normal(self.senses[number].on_scale(reading), mean, variance)
            tables = tables.after(((name, reading),))
        density: FloatArray = np.exp(np.maximum(log_density, np.log(LEAST_DENSITY)))
        return density

    def after(self, measured: Measured) -> ObjectTables:
        """Return the tables once readings were had."""
        counts, totals = self.counts.copy(), self.totals.copy()
        for name, reading in measured:
            number = self._number(name)
            counts[number] += 1.0
            totals[number] += self.senses[number].on_scale(reading)
        return ObjectTables(self.senses, counts, totals, self.variances)

    def _number(self, name: str) -> int:
        return [sense.name for sense in self.senses].index(name)

    def restricted(self, hypotheses: IntArray) -> ObjectTables:
        """Return the tables of some hypotheses."""
        if not self.senses:
            return self
        return ObjectTables(self.senses, self.counts[:, hypotheses], self.totals[:, hypotheses], self.variances)

    def revealed_by(self, action: str) -> tuple[int, ...]:
        """Return the numbers of the senses that an action reveals."""
        return tuple(number for number, sense in enumerate(self.senses) if action in sense.revealed_by)

    def readings(self, numbers: Iterable[int], identity: FloatArray) -> Readings:
        """Return what may be read by some senses, one reading of each.

        The nodes stand evenly, a quarter of the least standard deviation apart, up to eight of them from each mean. For
        mixtures of normal densities this sum is as good as exact: an expected entropy is off by less than 1e-6 nats.

        Args:
            numbers: Of the senses.
            identity: p(O), shape [H].
        """
        matters = identity > _NEGLIGIBLE * identity.sum()
        weights, densities = np.ones(1), np.ones((1, len(identity)))
        neg_entropies = np.zeros(len(identity))
        for number in numbers:
            mean, variance = self.next_readings(number)
            deviation = np.sqrt(variance)
            step = float(deviation[matters].min()) / _STEPS
            first = float((mean - _REACH * deviation)[matters].min())
            last = float((mean + _REACH * deviation)[matters].max())
            nodes = np.arange(first, last + step, step)
            density = np.exp(_log_normal(nodes[:, None], mean, variance))
            weights = np.outer(weights, np.full(len(nodes), step)).ravel()
            densities = (densities[:, None, :] * density).reshape(-1, len(identity))
            neg_entropies -= 0.5 * (np.log(2.0 * np.pi * variance) + 1.0)
            kept = weights * (densities @ identity) > _NEGLIGIBLE * identity.sum()
            weights, densities = weights[kept], densities[kept]
        return Readings(weights, densities, neg_entropies)


def _log_normal(value: float | FloatArray, mean: FloatArray, variance: FloatArray) -> FloatArray:
    logarithms: FloatArray = -0.5 * (np.log(2.0 * np.pi * variance) + (value - mean) ** 2 / variance)
    return logarithms
