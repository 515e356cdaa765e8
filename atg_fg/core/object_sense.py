"""A scalar of an object that can be felt, such as its weight: what is taken for granted of it, and what is measured.

On the sense's own scale, logarithmic where errors are relative, the value of an object is w ~ N(m₀, s₀²) and a reading
of it r ~ N(w, σ²). Of n readings with the sum S the next one has

    r ~ N((m₀/s₀² + S/σ²) v, σ² + v),   v = 1 / (1/s₀² + n/σ²),

so the readings of an object are a factor on O alone: those of a fresh object have n = 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from atg_fg.core.checks import brief, is_number, plain_text
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray, Measured

#: Senses of the object that a robot can have, at most.
MOST_OBJECT_SENSES: Final = 2
#: How much more objects may differ than readings of one of them err, at most: expected entropy looks at all in between.
MOST_RATIO: Final = 250.0
#: Readings are numbers up to here.
GREATEST_READING: Final = 1e12
#: Readings that an error is worth which was only guessed from them.
_GUESSED: Final = 4.0
#: How many times as much objects differ as readings err, if readings do not say, and how many times at most then.
_DIFFERENT: Final = 5.0
_SURELY: Final = 50.0
#: Least standard deviation between objects, of the logarithm.
_LEAST_SPREAD: Final = 0.3


@dataclass(frozen=True)
class Moments:
    """What is kept of all readings of one object, on the scale of their sense.

    Attributes:
        count: n.
        total: Their sum.
        squares: The sum of their squares.
    """

    count: int = 0
    total: float = 0.0
    squares: float = 0.0

    def plus(self, other: Moments) -> Moments:
        """Return those of both."""
        return Moments(self.count + other.count, self.total + other.total, self.squares + other.squares)

    def minus(self, other: Moments) -> Moments:
        """Return those of the readings that ``other`` is not of."""
        if other.count >= self.count:
            return Moments()
        return Moments(self.count - other.count, self.total - other.total, self.squares - other.squares)


@dataclass(frozen=True)
class ObjectSense:
    """A sense of the object as a whole: it measures a number that an object has whichever way it lies.

    Attributes:
        name: Such as ``"weight"``.
        typical: What an object has that is like most.
        spread: Standard deviation between objects; of the logarithm if ``relative``, so 0.5 is about 50 %.
        error: Standard deviation of readings of one object, on the same scale.
        unit: Of the readings, such as ``"kg"``.
        relative: Whether errors are relative; then a reading is above 0.
        worth: How many readings ``error`` is worth: it is learned from the scatter of all objects' readings, beginning
            with so many. ∞ if it is known.
        revealed_by: Names of the actions after which there is a reading, such as those that lift the object.

    Raises:
        InvalidInputError: An empty name, a number out of its range, or objects that differ over ``MOST_RATIO`` times as
            much as readings.
    """

    name: str
    typical: float
    spread: float
    error: float
    unit: str = ""
    relative: bool = True
    worth: float = math.inf
    revealed_by: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        plain_text(self.name, "object sense: name")
        place = f"object sense {self.name!r}"
        if not isinstance(self.unit, str) or not isinstance(self.relative, bool):
            raise InvalidInputError(f"{place}: unit {self.unit!r}, relative {self.relative!r}; expected text, bool")
        object.__setattr__(self, "typical", self.check(self.typical, f"{place}: typical"))
        for field in ("spread", "error", "worth"):
            value = getattr(self, field)
            most = math.inf if field == "worth" else GREATEST_READING
            if not is_number(value) or not 1e-9 <= value <= most:
                raise InvalidInputError(f"{place}: {field} {brief(value)}; expected a number of at least 1e-09")
            object.__setattr__(self, field, float(value))
        if self.spread > MOST_RATIO * self.error:
            raise InvalidInputError(
                f"{place}: spread {self.spread:g}, error {self.error:g}; expected at most {MOST_RATIO:g} times as much"
            )
        object.__setattr__(self, "revealed_by", tuple(self.revealed_by))

    @classmethod
    def of_readings(cls, name: str, trials: Iterable[Sequence[float]], revealed_by: Sequence[str] = ()) -> ObjectSense:
        """Return a sense of which nothing is known but readings, of one object in each trial.

        Errors are relative if all readings are above 0. Readings err by as much as they differ in a trial: worth few of
        them, so that what is learned corrects it. Trials may all be of one object, so objects are taken to differ by
        at least a few times as much.
        """
        groups = [list(each) for each in trials if len(each)]
        relative = all(value > 0 for each in groups for value in each)
        on_scale = [[math.log(value) for value in each] if relative else each for each in groups] or [[0.0]]
        means = [math.fsum(each) / len(each) for each in on_scale]
        typical, between = math.fsum(means) / len(means), float(np.std(means))
        free = sum(len(each) - 1 for each in on_scale)
        scatter = math.fsum((value - mean) ** 2 for each, mean in zip(on_scale, means, strict=True) for value in each)
        within = math.sqrt(scatter / free) if free else 0.0
        least = _LEAST_SPREAD if relative else 1e-3 * max(abs(typical), 1e-3)
        spread = min(max(between, _DIFFERENT * within, least), GREATEST_READING)
        error = min(max(within, spread / _SURELY), spread / _DIFFERENT) if within else spread / _DIFFERENT
        return cls(
            name,
            math.exp(typical) if relative else typical,
            spread,
            error,
            relative=relative,
            worth=_GUESSED,
            revealed_by=tuple(revealed_by),
        )

    def check(self, value: Any, place: str) -> float:
        """Return a reading as a float, or raise ``InvalidInputError`` naming ``place`` and the unit."""
        least = 0.0 if self.relative else -GREATEST_READING
        # A NaN is in no range.
        if not is_number(value) or not least <= value <= GREATEST_READING or (self.relative and not value > 0):
            unit = f", in {self.unit}" if self.unit else ""
            bounds = "above 0" if self.relative else "that is finite"
            raise InvalidInputError(f"{place}: {brief(value)}; expected a number {bounds}{unit}")
        return float(value)

    def on_scale(self, reading: float) -> float:
        """Return a reading on the sense's own scale: its logarithm if errors are relative."""
        return math.log(reading) if self.relative else reading

    def off_scale(self, value: float) -> float:
        """Return the reading that is there on the sense's own scale."""
        return math.exp(value) if self.relative else value

    def moments_of(self, readings: Iterable[float]) -> Moments:
        """Return what is kept of readings."""
        values = [self.on_scale(reading) for reading in readings]
        return Moments(len(values), math.fsum(values), math.fsum(value * value for value in values))

    def variance(self, moments: Iterable[Moments]) -> float:
        """Return σ²: as it is known, or as the readings of these objects say."""
        if math.isinf(self.worth):
            return self.error**2
        scatter, free = self.worth * self.error**2, self.worth
        for each in moments:
            if each.count > 1:
                scatter += max(each.squares - each.total**2 / each.count, 0.0)
                free += each.count - 1
        return scatter / free

    def next_reading(self, count: FloatArray, total: FloatArray, variance: float) -> tuple[FloatArray, FloatArray]:
        """Return mean and variance of the next reading of objects with n readings of the sum S, on the scale.

        Args:
            count: n, any shape.
            total: S, of the same shape.
            variance: σ².
        """
        spread = self.spread**2
        left = 1.0 / (1.0 / spread + count / variance)
        return left * (self.on_scale(self.typical) / spread + total / variance), left + variance

    def log_evidence(self, moments: Moments, variance: float) -> float:
        """Return ln p(readings | they are of one object), but for a term that does not depend on which are."""
        total = (moments.total - moments.count * self.on_scale(self.typical)) / math.sqrt(variance)
        spread = self.spread**2 / variance
        grown = 1.0 + moments.count * spread
        return 0.5 * (spread * total**2 / grown - math.log(grown))

    def estimate(self, moments: Moments, variance: float) -> tuple[float, float]:
        """Return what an object has by its readings, and the standard deviation of that on the scale."""
        (mean,), (of_next,) = self.next_reading(np.array([float(moments.count)]), np.array([moments.total]), variance)
        return self.off_scale(float(mean)), math.sqrt(float(of_next) - variance)


def check_object_senses(
    senses: Any, actions: Sequence[str], slots: Sequence[str], place: str = "object senses"
) -> tuple[ObjectSense, ...]:
    """Return senses as a tuple, or raise ``InvalidInputError`` unless a robot can have them beside these slots."""
    is_sequence = isinstance(senses, (tuple, list)) and all(isinstance(each, ObjectSense) for each in senses)
    if not is_sequence or len(senses) > MOST_OBJECT_SENSES:
        raise InvalidInputError(f"{place}: {brief(senses)}; expected at most {MOST_OBJECT_SENSES} of them")
    taken = list(slots)
    for each in senses:
        if each.name in taken:
            raise InvalidInputError(f"{place}: name {each.name!r} is taken; expected another one")
        taken.append(each.name)
        for action in each.revealed_by:
            if action not in actions:
                raise InvalidInputError(
                    f"{place}: {each.name!r} is revealed by {brief(action)}; expected some of: {', '.join(actions)}"
                )
    return tuple(senses)


def check_measured(senses: Sequence[ObjectSense], measured: Any, place: str = "measured") -> Measured:
    """Return readings by the name of their sense in the order of the senses, those that are not there left out.

    Raises:
        InvalidInputError: A sense that the robot does not have, or a reading that is none of it.
    """
    if not isinstance(measured, Mapping):
        raise InvalidInputError(f"{place}: {brief(measured)}; expected readings by name")
    if not measured:
        return ()
    names = [each.name for each in senses]
    for name in measured:
        if name not in names:
            there = f"one of: {', '.join(names)}" if names else "no readings of an object, which are not assumed"
            raise InvalidInputError(f"{place}: {brief(name)}; expected {there}")
    return tuple(
        (each.name, each.check(measured[each.name], f"{place}: {each.name}"))
        for each in senses
        if measured.get(each.name) is not None
    )
