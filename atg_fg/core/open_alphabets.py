"""What was written down under one alphabet, under another that knows more labels.

An alphabet that is open may be extended in the middle of a trial, and by two processes in different order. What was
seen then is as if all labels had been in the alphabet from the start.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from atg_fg.core.looks import Look
from atg_fg.core.patterns import Detection, Evidence, FloatArray, IntArray, PatternAlphabet, SlotLikelihoods


def new_labels(alphabet: PatternAlphabet, look: Look) -> list[str]:
    """Return the labels of a look that an open alphabet does not know yet; none of a closed one."""
    if not alphabet.is_open or isinstance(look, str) or not isinstance(look, (Mapping, Sequence)):
        return []
    entries: list[Any] = (
        [label for slot, label in look.items() if slot in alphabet.slots] if isinstance(look, Mapping) else list(look)
    )
    given = (label for each in entries for label in (each if isinstance(each, Mapping) else [each]))
    return list(dict.fromkeys(each for each in given if isinstance(each, str) and each not in alphabet.names))


@dataclass(frozen=True)
class Relabelling:
    """From one alphabet of names to another that has them all.

    Attributes:
        old: Under which something was written down.
        new: Under which it is to be read.
    """

    old: PatternAlphabet
    new: PatternAlphabet

    @cached_property
    def numbers(self) -> IntArray:
        """The new number of each old symbol, shape [V]."""
        return np.array([self.new.names.index(name) for name in self.old.names], dtype=np.int64)

    @cached_property
    def indices(self) -> IntArray:
        """The new index of each old pattern, shape [|𝒵|]."""
        return np.array([self.new.index(pattern) for pattern in self.numbers[self.old.symbols].tolist()])

    def pattern(self, index: int | None) -> int | None:
        """Return the new index of a pattern."""
        return None if index is None else int(self.indices[index])

    def detection(self, detection: Detection) -> Detection:
        """Return what was seen, by the new numbers."""
        return tuple(None if symbol is None else int(self.numbers[symbol]) for symbol in detection)

    def slots(self, likelihoods: SlotLikelihoods) -> SlotLikelihoods:
        """Return likelihoods of symbols; a label that they do not name is as improbable as the least probable one."""
        return tuple(
            None if each is None else tuple(self._spread(np.array(each), self.numbers, self.new.n_symbols).tolist())
            for each in likelihoods
        )

    def evidence(self, evidence: Evidence) -> Evidence:
        """Return what a look says of the new patterns.

        A detection agrees with all patterns that have its symbols. Where a likelihood was given, a pattern that it does
        not name is as improbable as the least probable one.
        """
        return self._evidence(evidence).with_readings(evidence.measured)

    def _evidence(self, evidence: Evidence) -> Evidence:
        if evidence.slots:
            return Evidence.of_slots(
                self.new, self.slots(evidence.slots), self.detection(evidence.detection or ()), evidence.confidences
            )
        if evidence.detection is None:
            return Evidence(self._spread(evidence.likelihood, self.indices, len(self.new)))
        plain = Evidence.of_detection(self.old, evidence.detection)
        seen = Evidence.of_detection(self.new, self.detection(evidence.detection), evidence.confidences)
        if np.array_equal(plain.likelihood, evidence.likelihood):
            return seen
        return replace(seen, likelihood=self._spread(evidence.likelihood, self.indices, len(self.new)))

    @staticmethod
    def _spread(values: FloatArray, places: IntArray, size: int) -> FloatArray:
        spread = np.full(size, values.min())
        spread[places] = values
        return spread
