"""Worlds without tags: an object in one of 24 orientations, of which features of what a camera sees are told."""

from __future__ import annotations

from abc import abstractmethod
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.senses.appearance import APPEARANCE, SEEN, AppearanceSense, appearance_space
from atg_fg.senses.face_features import face_features
from atg_fg.senses.feature_space import FeatureSpace
from atg_fg.senses.object_readings import observed_readings, with_readings
from atg_fg.worlds.arcube import ACTION_SOURCES, ORIENTATIONS, SUCCESSORS
from atg_fg.worlds.base import FiniteStateWorld


class AppearanceWorld(FiniteStateWorld):
    """An object that three actions turn, flip, left and right; of what a camera sees of it the features are told.

    An observation has the features of each slot (``appearance``), and which of them were ``seen``. Where the robot
    feels the object's weight, it also has that, and whether it was ``measured``. A subclass turns objects and has a
    camera: what is told is of ``crops``, ``seen`` and ``felt`` as it left them.

    Args:
        n_objects: Objects of this world.
        alphabet: Its slots, and the numbers that classes of appearance can have.
        features: Name of what makes features of a crop.
        side: Of a crop, pixels.
        weight_sense: How the weight of an object is felt.
        weight: Whether it is felt.
        noise: ``slip`` and ``missing`` of ``FiniteStateWorld``.

    Attributes:
        features: Makes features of a crop.
        object_senses: What is felt of an object as a whole.
        crops: What was cut out of the last frame, a crop a slot, RGB, shape [slots, side, side, 3].
        seen: Which of them were found, shape [slots].
        felt: What was measured by ``object_senses`` in the last action, by their names.

    Raises:
        InvalidInputError: An option out of its range.
    """

    state_name = "orientation"
    #: σ² of the codebook: how much more looks scatter than those that were calibrated on.
    within: float = 1.0

    def __init__(
        self,
        n_objects: int,
        alphabet: PatternAlphabet,
        *,
        features: str,
        side: int,
        weight_sense: ObjectSense,
        weight: bool = False,
        render_mode: str | None = None,
        **noise: float,
    ) -> None:
        if not isinstance(weight, bool):
            raise InvalidInputError(f"weight: {weight!r}; expected true or false")
        n_actions, n_slots = len(ACTION_SOURCES), len(alphabet.slots)
        super().__init__(n_objects, n_actions, n_slots, alphabet.n_symbols, render_mode=render_mode, **noise)
        self.features, self.features_name, self.alphabet = face_features(features), features, alphabet
        self.object_senses = (weight_sense,) if weight else ()
        looks = appearance_space(n_slots, len(self.features(np.zeros((side, side, 3), dtype=np.uint8))))
        self.observation_space: Any = with_readings(looks, self.object_senses)
        self.crops: NDArray[np.uint8] = np.zeros((n_slots, side, side, 3), dtype=np.uint8)
        self.seen: NDArray[np.int8] = np.ones(n_slots, dtype=np.int8)
        self.felt: dict[str, float] = {}

    @abstractmethod
    def feature_space(self) -> FeatureSpace:
        """Return the space of features, calibrated on objects that are in no world."""

    @cached_property
    def sense(self) -> AppearanceSense:
        """One that reads these observations and knows no class yet."""
        return AppearanceSense(self.feature_space(), self.alphabet, within=self.within)

    @property
    def assumptions(self) -> Assumptions:
        """What a robot in this world takes for granted."""
        actions = tuple(ACTION_SOURCES)
        return Assumptions(self._n_objects, len(ORIENTATIONS), actions, self.alphabet, self.object_senses)

    def _n_states(self) -> int:
        return len(ORIENTATIONS)

    def _successor(self, action: int) -> int:
        return SUCCESSORS[self.state][action]

    def _look(self) -> dict[str, NDArray[Any]]:
        appearance = np.array([self.features(crop) for crop in self.crops], dtype=np.float64)
        seen = self.seen.copy()
        if self.missing:
            seen[self.np_random.random(len(seen)) < self.missing] = 0
        felt = observed_readings(self.object_senses, self.felt)
        return {APPEARANCE: appearance * seen[:, None], SEEN: seen, **felt}
