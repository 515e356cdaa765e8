"""Raw trials, as detections and actions, and many of them in one array."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import ObjectSense, check_measured
from atg_fg.core.open_alphabets import Relabelling
from atg_fg.core.patterns import (
    MISSING,
    Confidences,
    Detection,
    Evidence,
    FloatArray,
    IntArray,
    Measured,
    PatternAlphabet,
    SlotLikelihoods,
    read_only,
)
from atg_fg.core.slot_checks import check_confidences, check_slots


@dataclass(frozen=True)
class RawTrial:
    """What was seen and done with one object.

    Attributes:
        detections: The symbol in each slot at each look, ``None`` where nothing was seen; t + 1 of them.
        actions: Index of the action between each two looks; t of them.
        confidences: How sure the detector was of each symbol at each look, as it was given; empty if it never says.
        likelihoods: Of the symbols of each slot at each look, as they were given; empty if there are none.
        measured: What was felt of the object as a whole at each look; empty if nothing was.
    """

    detections: tuple[Detection, ...]
    actions: tuple[int, ...]
    confidences: tuple[Confidences, ...] = ()
    likelihoods: tuple[SlotLikelihoods, ...] = ()
    measured: tuple[Measured, ...] = ()

    @classmethod
    def of(cls, looks: Sequence[Evidence], actions: Sequence[int], alphabet: PatternAlphabet) -> RawTrial:
        """Return the trial in which these looks were had between these actions.

        Of evidence that is no detection, and was not given slot by slot, it keeps what that says of each slot alone.
        """
        nothing: Detection = (None,) * len(alphabet.slots)
        likelihoods: list[SlotLikelihoods] = []
        for look in looks:
            if look.detection is None and not look.slots:
                likelihoods.append(tuple(map(tuple, alphabet.slot_likelihoods(look.likelihood).tolist())))
            else:
                likelihoods.append(look.slots)
        confidences = tuple(look.confidences for look in looks)
        measured = tuple(look.measured for look in looks)
        return cls(
            tuple(look.detection or nothing for look in looks),
            tuple(actions),
            confidences if any(confidences) else (),
            tuple(likelihoods) if any(likelihoods) else (),
            measured if any(measured) else (),
        )

    @cached_property
    def symbols(self) -> IntArray:
        """The symbol in each slot at each look, ``MISSING`` where nothing was seen, shape [t + 1, J]."""
        seen = [[MISSING if symbol is None else symbol for symbol in look] for look in self.detections]
        return read_only(np.array(seen, dtype=np.int64))

    def relabelled(self, labels: Relabelling) -> RawTrial:
        """Return the same trial under another alphabet."""
        detections = tuple(map(labels.detection, self.detections))
        return replace(self, detections=detections, likelihoods=tuple(map(labels.slots, self.likelihoods)))

    def check(self, assumptions: Assumptions, place: str = "trial") -> None:
        """Raise ``InvalidInputError``, naming ``place``, if this is no trial under these assumptions."""
        if len(self.detections) != len(self.actions) + 1:
            raise InvalidInputError(
                f"{place}: {len(self.detections)} looks, {len(self.actions)} actions; expected one look more"
            )
        for look, detection in enumerate(self.detections):
            assumptions.alphabet.check_detection(detection, f"{place}: look {look}")
        if len(self.confidences) not in (0, len(self.detections)):
            raise InvalidInputError(
                f"{place}: {len(self.confidences)} confidences; expected one for each of {len(self.detections)} looks"
            )
        for look, confidences in enumerate(self.confidences):
            check_confidences(confidences, len(assumptions.alphabet.slots), f"{place}: look {look}: confidences")
        if len(self.likelihoods) not in (0, len(self.detections)):
            raise InvalidInputError(
                f"{place}: {len(self.likelihoods)} likelihoods; expected one for each of {len(self.detections)} looks"
            )
        for look, likelihoods in enumerate(self.likelihoods):
            check_slots(
                likelihoods,
                assumptions.alphabet.slots,
                assumptions.alphabet.n_symbols,
                f"{place}: look {look}: likelihoods",
            )
        if len(self.measured) not in (0, len(self.detections)):
            raise InvalidInputError(
                f"{place}: {len(self.measured)} readings; expected one entry for each of {len(self.detections)} looks"
            )
        for look, measured in enumerate(self.measured):
            check_measured(assumptions.object_senses, dict(measured), f"{place}: look {look}")
        for action in self.actions:
            if not 0 <= action < len(assumptions.actions):
                raise InvalidInputError(f"{place}: action {action}; expected 0 to {len(assumptions.actions) - 1}")


class TrialArrays(NamedTuple):
    """N trials side by side, as long as the longest of them.

    Attributes:
        symbols: Seen in each slot at each look, ``MISSING`` where nothing was or the trial has ended, [N, T + 1, J].
        actions: Between the looks, −1 where the trial has ended, shape [N, T].
    """

    symbols: IntArray
    actions: IntArray


def side_by_side(trials: Sequence[RawTrial]) -> TrialArrays:
    """Return trials, at least one, as arrays."""
    longest = max(len(trial.actions) for trial in trials)
    n_slots = len(trials[0].detections[0])
    symbols = np.full((len(trials), longest + 1, n_slots), MISSING, dtype=np.int64)
    actions = np.full((len(trials), longest), -1, dtype=np.int64)
    for number, trial in enumerate(trials):
        symbols[number, : len(trial.detections)] = trial.symbols
        actions[number, : len(trial.actions)] = trial.actions
    return TrialArrays(symbols, actions)


#: What was felt where there is no sense of the object.
NOTHING_FELT: Final = np.zeros((1, 0, 3))
#: Likelihoods where all looks are labels.
NOTHING_SOFT: Final = read_only(np.ones((1, 1, 1, 1)))


class Recording(NamedTuple):
    """All raw trials side by side, as they were given.

    Attributes:
        labels: Symbol seen in each slot at each look, ``MISSING`` where none was, shape [N, T, J].
        confidences: Of each label, not a number where none was given, shape [N, T, J].
        actions: That were asked for after each look, shape [N, T].
        lengths: Number of looks, shape [N].
        n_symbols: V.
        likelihoods: Of each symbol in each slot at each look, with the mean 1, shape [N, T, J, V]; all 1 where none was
            given. Of shape [1, 1, 1, 1] if none ever was.
        felt: Of each sense of the object, as ``atg_fg.learning.kernels.TrialArrays`` has it, shape [N, S, 3].
    """

    labels: IntArray
    confidences: FloatArray
    actions: IntArray
    lengths: IntArray
    n_symbols: int
    likelihoods: FloatArray = NOTHING_SOFT
    felt: FloatArray = NOTHING_FELT

    @classmethod
    def of(cls, trials: Sequence[RawTrial], n_symbols: int, senses: Sequence[ObjectSense] = ()) -> Recording:
        """Return trials, at least one, as arrays, with the readings of senses of the object."""
        arrays = side_by_side(trials)
        confidences = np.full(arrays.symbols.shape, np.nan)
        for number, trial in enumerate(trials):
            for look, stated in enumerate(trial.confidences):
                if stated:
                    confidences[number, look] = [np.nan if value is None else value for value in stated]
        actions = np.concatenate((np.maximum(arrays.actions, 0), np.zeros((len(trials), 1), dtype=np.int64)), axis=1)
        lengths = np.array([len(trial.detections) for trial in trials])
        soft = _likelihoods(trials, arrays, n_symbols)
        return cls(arrays.symbols, confidences, actions, lengths, n_symbols, soft, _felt(trials, senses))


def _felt(trials: Sequence[RawTrial], senses: Sequence[ObjectSense]) -> FloatArray:
    if not senses:
        return NOTHING_FELT
    result = np.zeros((len(trials), len(senses), 3))
    for number, sense in enumerate(senses):
        moments = [
            sense.moments_of(value for look in trial.measured for name, value in look if name == sense.name)
            for trial in trials
        ]
        variance = sense.variance(moments)
        middle = sense.on_scale(sense.typical)
        result[:, number, 0] = [each.count for each in moments]
        result[:, number, 1] = [(each.total - each.count * middle) / math.sqrt(variance) for each in moments]
        result[:, number, 2] = sense.spread**2 / variance
    return result


def _likelihoods(trials: Sequence[RawTrial], arrays: TrialArrays, n_symbols: int) -> FloatArray:
    if not any(trial.likelihoods for trial in trials):
        return NOTHING_SOFT
    result = np.ones((*arrays.symbols.shape, n_symbols))
    for number, trial in enumerate(trials):
        for look, slots in enumerate(trial.likelihoods):
            for slot, weights in enumerate(slots):
                if weights is not None:
                    result[number, look, slot] = np.array(weights) * (n_symbols / sum(weights))
    return result


class Reassignment(NamedTuple):
    """A raw trial that was given to another ATG.

    Attributes:
        after: Number of raw trials by which this came to light.
        trial: Number of the trial.
        old: Name of the ATG that it was of.
        new: Name of the one that it is of from then on.
    """

    after: int
    trial: int
    old: str
    new: str
