"""The look of things as a sense: features of each slot become soft evidence over classes of a codebook."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from atg_fg.core.checks import finite_array, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import MISSING, Detection, Evidence, FloatArray, IntArray, PatternAlphabet
from atg_fg.core.sense import Reading, Readings, SensedLook, SensedTrial
from atg_fg.senses.codebook import Codebook
from atg_fg.senses.face_features import FaceFeatures, Image
from atg_fg.senses.feature_space import FeatureSpace

#: A look is taken for the look of a class, or of a new one, only if that is so probable.
SURE: Final = 0.9
#: Name of what an observation has of each slot, and of which slots it has it.
APPEARANCE, SEEN = "appearance", "seen"


def appearance_space(n_slots: int, n_features: int) -> spaces.Dict:
    """Return the space of observations that have features of each slot that is seen."""
    return spaces.Dict(
        {APPEARANCE: spaces.Box(-np.inf, np.inf, (n_slots, n_features), np.float64), SEEN: spaces.MultiBinary(n_slots)}
    )


class AppearanceSense:
    """Classes of appearance, and the readings that they were made from.

    Args:
        space: Of the features.
        alphabet: Its slots are those that features are of, its symbols the numbers that classes can have.
        within: σ² of the codebook.
        concentration: γ of the codebook.

    Attributes:
        codebook: The classes.
        trials: All that was learned from, in their order.
    """

    def __init__(
        self, space: FeatureSpace, alphabet: PatternAlphabet, *, within: float = 1.0, concentration: float = 1.0
    ) -> None:
        self.space, self.alphabet = space, alphabet
        self.codebook = Codebook(space.between, alphabet.n_symbols, within=within, concentration=concentration)
        self.trials: list[SensedTrial] = []

    @property
    def features(self) -> str:
        """Name of what makes the features."""
        return self.space.features

    def begin(self) -> AppearanceTrial:
        """Return a copy for one trial; the sense itself learns at its end."""
        return AppearanceTrial(self.space, self.alphabet, self.codebook.copy())

    def symbol_of(self, features: ArrayLike) -> int | None:
        """Return the class that a picture with these features is of, ``None`` if it is of none that was met for sure.

        Of a crop that is no look of a trial, such as that of a goal.
        """
        belief = self.codebook.posterior(self.space.encode(features))
        best = int(belief.classes.argmax())
        return best if belief.classes[best] >= SURE else None

    def thumbnails(self, crops: Iterable[Image], features: FaceFeatures) -> dict[int, Image]:
        """Return, for each class that any of the crops is of for sure, the one that is nearest to it.

        ``draw_atg(graph, symbol_images=…)`` draws them in place of the numbers of classes.

        Args:
            crops: RGB, such as a world's ``crops`` at each look.
            features: That this sense reads.

        Raises:
            InvalidInputError: Features of another length than the codebook's, or not finite.
        """
        best: dict[int, tuple[float, Image]] = {}
        for crop in crops:
            values = features(crop)
            symbol = self.symbol_of(values)
            if symbol is not None:
                density = float(self.codebook.log_densities(self.space.encode(values))[0][symbol])
                if symbol not in best or density > best[symbol][0]:
                    best[symbol] = density, crop
        return {symbol: crop for symbol, (_, crop) in sorted(best.items())}

    def check_space(self, space: Any) -> None:
        """Raise ``InvalidInputError`` unless these are observations that the sense can read."""
        expected = appearance_space(len(self.alphabet.slots), self.space.n_features)
        if space != expected:
            raise InvalidInputError(f"world: observations {space}; expected {expected}, as the memory's sense reads")

    def learn(self, trial: SensedTrial) -> list[tuple[Detection, ...]] | None:
        """Learn from a trial that has ended; see ``Sense.learn``.

        Raises:
            InvalidInputError: Readings of another length than the codebook's or not finite, or classes there are not.
        """
        self.restore([trial])
        if not _is_milestone(len(self.trials)):
            return None
        looks, labels = self._looks()
        refitted = self.codebook.refit(looks, labels)
        if (refitted == labels).all():
            return None
        numbers = iter(refitted.tolist())
        self.trials = [
            each._replace(
                detections=tuple(
                    tuple(None if reading is None else next(numbers) for reading in look) for look in each.readings
                )
            )
            for each in self.trials
        ]
        return [each.detections for each in self.trials]

    def restore(self, trials: Sequence[SensedTrial]) -> None:
        """Add trials that were learned from, as they were taken then; all of them, or none if one is refused.

        Raises:
            InvalidInputError: As for ``learn``.
        """
        expected = f"{self.space.n_dimensions} numbers, as in the codebook of {self.features!r}"
        added: list[tuple[FloatArray, int]] = []
        for trial in trials:
            if len(trial.detections) != len(trial.readings):
                raise InvalidInputError(f"readings: {len(trial.readings)} looks; expected {len(trial.detections)}")
            for look, (readings, detection) in enumerate(zip(trial.readings, trial.detections, strict=True)):
                place = f"readings: look {look}"
                if not len(readings) == len(detection) == len(self.alphabet.slots):
                    raise InvalidInputError(
                        f"{place}: {len(readings)} slots, {len(detection)} classes; expected {len(self.alphabet.slots)}"
                    )
                for slot, reading, symbol in zip(self.alphabet.slots, readings, detection, strict=True):
                    if reading is None:
                        continue
                    where = f"{place}, slot {slot!r}"
                    point = finite_array(reading, where, (self.space.n_dimensions,), expected)
                    if symbol is not None:
                        most = self.alphabet.n_symbols - 1
                        added.append((point, whole_number(symbol, f"{where}: class", 0, most)))
        for point, symbol in added:
            self.codebook.add(point, symbol)
        self.trials += trials

    def _looks(self) -> tuple[FloatArray, IntArray]:
        """Return all readings, shape [N, D], and the class of each, shape [N]."""
        found = [
            (reading, MISSING if symbol is None else symbol)
            for trial in self.trials
            for readings, detection in zip(trial.readings, trial.detections, strict=True)
            for reading, symbol in zip(readings, detection, strict=True)
            if reading is not None
        ]
        looks = np.array([reading for reading, _ in found], dtype=np.float64)
        return looks.reshape(-1, self.space.n_dimensions), np.array([symbol for _, symbol in found], dtype=np.int64)

    def copy(self) -> AppearanceSense:
        """Return a sense that can learn without touching this one."""
        settings = {"within": self.codebook.within, "concentration": self.codebook.concentration}
        twin = AppearanceSense(self.space, self.alphabet, **settings)
        twin.codebook, twin.trials = self.codebook.copy(), list(self.trials)
        return twin

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, AppearanceSense):
            return NotImplemented
        ours, theirs = (
            (each.space, each.alphabet, each.codebook.within, each.codebook.concentration, each.trials)
            for each in (self, other)
        )
        return ours == theirs

    def __repr__(self) -> str:
        return f"AppearanceSense({self.codebook.n_classes} classes of {self.features!r}, {len(self.trials)} trials)"


class AppearanceTrial:
    """The codebook of one trial; each look that is sure falls into its class at once.

    Args:
        space: Of the features.
        alphabet: Of the classes.
        codebook: A copy of its own.
    """

    def __init__(self, space: FeatureSpace, alphabet: PatternAlphabet, codebook: Codebook) -> None:
        self.space, self.alphabet, self.codebook = space, alphabet, codebook

    def look(self, observation: Mapping[str, Any]) -> SensedLook:
        """Take in the features of a look, an observation of ``appearance_space``.

        Raises:
            InvalidInputError: Features that are missing, of another length than the codebook's, or not finite.
        """
        n_slots, slots = len(self.alphabet.slots), ", ".join(self.alphabet.slots)
        try:
            seen, appearance = observation[SEEN], observation[APPEARANCE]
            n_looks = len(appearance)
        except (KeyError, TypeError, IndexError) as error:
            raise InvalidInputError(
                f"observation: {observation!r:.60}; expected {APPEARANCE!r} and {SEEN!r} of {n_slots} slots"
            ) from error
        there = finite_array(seen, f"observation: {SEEN!r}", (n_slots,), f"0 or 1 of each slot: {slots}")
        if n_looks != n_slots:
            raise InvalidInputError(f"observation: {n_looks} slots; expected {n_slots}: {slots}")
        return self.look_at(
            tuple(
                tuple(self.space.encode(features, f"observation: slot {slot!r}").tolist()) if is_seen else None
                for slot, features, is_seen in zip(self.alphabet.slots, appearance, there, strict=True)
            )
        )

    def look_at(self, readings: Readings) -> SensedLook:
        """Take in readings in the space of the codebook."""
        likelihood = np.ones(len(self.alphabet))
        detection: list[int | None] = []
        confidences: list[float | None] = []
        unsure: list[tuple[float, ...] | None] = []
        for slot, reading in enumerate(readings):
            weights, symbol, confidence = self._symbol(reading)
            likelihood *= weights[self.alphabet.symbols[:, slot]]
            detection.append(symbol)
            confidences.append(confidence)
            unsure.append(tuple(weights.tolist()) if symbol is None and reading is not None else None)
        slots = tuple(unsure) if any(unsure) else ()
        evidence = Evidence(likelihood, self._pattern(detection), tuple(detection), tuple(confidences), slots)
        return SensedLook(evidence, readings)

    def _symbol(self, reading: Reading) -> tuple[FloatArray, int | None, float | None]:
        """Return the likelihood of each symbol, the symbol if it is sure, and how sure that is; learn from it."""
        if reading is None:
            return np.ones(self.alphabet.n_symbols), None, None
        look = np.array(reading)
        weights, belief = self.codebook.likelihood(look), self.codebook.posterior(look)
        best, new = int(belief.classes.argmax()), self.codebook.next_number
        if new is not None and belief.new > belief.classes[best]:
            symbol, confidence = new, belief.new
        else:
            symbol, confidence = best, float(belief.classes[best])
        if confidence < SURE:
            return weights, None, None
        self.codebook.add(look, symbol)
        return weights, symbol, round(confidence, 4)

    def _pattern(self, detection: Sequence[int | None]) -> int | None:
        symbols = [symbol for symbol in detection if symbol is not None]
        repeated = self.alphabet.exclusive and len(set(symbols)) < len(symbols)
        return None if len(symbols) < len(detection) or repeated else self.alphabet.index(symbols)


def _is_milestone(n_trials: int) -> bool:
    """Return whether all readings are looked at again: after 2ⁿ and 3 · 2ⁿ trials."""
    return n_trials.bit_count() == 1 or (n_trials % 3 == 0 and (n_trials // 3).bit_count() == 1)
