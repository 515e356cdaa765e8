"""Objects of six views before an ordinary detector: labels repeat, some are wrong or missing.

Confidences are no probabilities: from 0.5 to 0.98 of right labels, from 0.35 to 0.7 of wrong ones.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import MANY, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import MISSING, IntArray, PatternAlphabet
from atg_fg.worlds.finite_objects import FiniteObject, Mechanism, ObjectFamily
from atg_fg.worlds.object_world import ObjectWorld

LABELS: Final = ("logo", "text", "barcode", "plain", "lid", "base", "window", "seal")
ACTIONS: Final = ("rotate", "tip")
N_VIEWS: Final = 6
#: Rotating turns an object that stands round to its next side, and does nothing to one that lies on a side.
SHARED: Final = Mechanism.deterministic([[1, 4], [2, 4], [3, 4], [0, 4], [4, 5], [5, 0]])
RIGHT_CONFIDENCE: Final = (0.5, 0.98)
WRONG_CONFIDENCE: Final = (0.35, 0.7)


def boxed_goods(n_objects: int, seed: int, *, own_dynamics: bool = False) -> ObjectFamily:
    """Return objects with a label on each of six views, all drawn independently.

    Args:
        n_objects: How many.
        seed: Of all that is drawn.
        own_dynamics: Whether actions lead each object elsewhere, as drawn, rather than all alike.
    """
    whole_number(n_objects, "n_objects", 1, MANY)
    rng = np.random.default_rng(seed)
    objects = []
    for _ in range(n_objects):
        labels = rng.integers(len(LABELS), size=N_VIEWS).tolist()
        successors = rng.integers(N_VIEWS, size=(N_VIEWS, len(ACTIONS))).tolist() if own_dynamics else None
        mechanism = SHARED if successors is None else Mechanism.deterministic(successors)
        objects.append(FiniteObject(mechanism, tuple((label,) for label in labels)))
    return ObjectFamily(ACTIONS, PatternAlphabet.named(("label",), LABELS, exclusive=False), tuple(objects))


class DetectorWorld(ObjectWorld):
    """An object of the family before a detector.

    Args:
        n_objects: How many objects there are.
        objects_seed: Seed that they are drawn by.
        slip: Probability that an action fails and the object stays as it is.
        wrong: Probability that a look shows another label, drawn uniformly.
        missing: Probability that a look shows none.
        confidences: Whether ``info`` has the detector's confidence of each look.
        own_dynamics: As for ``boxed_goods``.
        render_mode: There is none but ``None``.

    Raises:
        InvalidInputError: An option out of its range.
    """

    def __init__(
        self,
        n_objects: int = 8,
        objects_seed: int = 0,
        *,
        slip: float = 0.0,
        wrong: float = 0.0,
        missing: float = 0.0,
        confidences: bool = False,
        own_dynamics: bool = False,
        render_mode: str | None = None,
    ) -> None:
        family = boxed_goods(n_objects, objects_seed, own_dynamics=own_dynamics)
        super().__init__(family, slip=slip, wrong=wrong, missing=missing, render_mode=render_mode)
        if wrong + missing > 1:
            raise InvalidInputError(f"wrong and missing: {wrong} and {missing}; expected a sum of at most 1")
        self.confidences = bool(confidences)
        self._confidence: float | None = None

    @property
    def assumptions(self) -> Assumptions:
        """What a robot in this world takes for granted: six aspects, though some of them may look alike."""
        return Assumptions(len(self.family.objects), N_VIEWS, self.family.actions, self.family.alphabet)

    def _look(self) -> IntArray:
        (label,) = self._pattern()
        rng, kind = self.np_random, self.np_random.random()
        self._confidence = None
        if kind < self.missing:
            return np.array([MISSING], dtype=np.int64)
        if kind < self.missing + self.wrong:
            label = (label + int(rng.integers(1, len(LABELS)))) % len(LABELS)
            self._confidence = round(float(rng.uniform(*WRONG_CONFIDENCE)), 2)
        else:
            self._confidence = round(float(rng.uniform(*RIGHT_CONFIDENCE)), 2)
        return np.array([label], dtype=np.int64)

    def _truth(self, *, slipped: bool) -> dict[str, Any]:
        truth = super()._truth(slipped=slipped)
        return {**truth, "confidences": (self._confidence,)} if self.confidences else truth
