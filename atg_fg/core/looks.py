"""A look as a person or a detector writes it, as evidence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from atg_fg.core.checks import brief, number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import ObjectSense, check_measured
from atg_fg.core.patterns import Evidence, FloatArray, PatternAlphabet

#: Evidence; the symbol in each slot, by number or name; symbols, or their likelihoods, by slot, and readings by the
#: name of a sense of the object; ``None`` if nothing was seen.
Look: TypeAlias = Evidence | Sequence[int | str | None] | Mapping[str, Any] | None


def evidence_of(alphabet: PatternAlphabet, look: Look, object_senses: Sequence[ObjectSense] = ()) -> Evidence:
    """Return a look as evidence.

    A mapping has for some of the slots a symbol, or the likelihood of each symbol. Likelihoods that sum to less than
    one leave the rest to all other symbols alike, as the confidence of a detector that names its best guess does.

    Args:
        alphabet: The patterns.
        look: See ``Look``.
        object_senses: What may be felt of the object as a whole.

    Raises:
        InvalidInputError: It does not fit the alphabet.
    """
    if isinstance(look, Evidence):
        return look
    if look is None:
        return Evidence.of_detection(alphabet, (None,) * len(alphabet.slots))
    if not isinstance(look, Mapping):
        return Evidence.of_detection(alphabet, look)
    names = [*alphabet.slots, *(sense.name for sense in object_senses)]
    for name in look:
        if name not in names:
            raise InvalidInputError(f"look: slot {name!r}; expected one of: {', '.join(names)}")
    measured = check_measured(
        object_senses, {name: value for name, value in look.items() if name not in alphabet.slots}, "look"
    )
    given = [look.get(slot) for slot in alphabet.slots]
    labels = [None if isinstance(each, Mapping) else each for each in given]
    weights = [
        _weights(alphabet, slot, each) if isinstance(each, Mapping) else None
        for slot, each in zip(alphabet.slots, given, strict=True)
    ]
    return Evidence.of_slots(alphabet, weights, labels).with_readings(measured)


def _weights(alphabet: PatternAlphabet, slot: str, given: Mapping[Any, Any]) -> FloatArray:
    """Return the likelihood of each symbol, shape [V]."""
    place, stated = f"look, slot {slot!r}", np.full(alphabet.n_symbols, np.nan)
    for symbol, value in given.items():
        detection = [symbol if each == slot else None for each in alphabet.slots]
        index = alphabet.check_detection(detection, place)[alphabet.slots.index(slot)]
        if index is None:
            raise InvalidInputError(f"{place}: {brief(symbol)}; expected a symbol")
        stated[index] = number(value, f"{place}: {symbol}", 0.0)
    silent = np.isnan(stated)
    rest = max(1.0 - float(np.nansum(stated)), 0.0)
    return np.where(silent, rest / max(int(silent.sum()), 1), stated)


def likely_pattern(evidence: Evidence) -> int | None:
    """Return the pattern to learn from: the one seen whole, or that a likelihood alone makes more probable than not."""
    if evidence.pattern is not None or (evidence.detection is not None and not any(evidence.slots)):
        return evidence.pattern
    best = int(evidence.likelihood.argmax())
    return best if evidence.likelihood[best] > evidence.likelihood.sum() / 2 else None


def strength(evidence: Evidence) -> float:
    """Return how much a look says: minus the entropy of its likelihood as a distribution, nats; 0 is sure."""
    share = evidence.likelihood / evidence.likelihood.sum()
    positive = share[share > 0]
    return float((positive * np.log(positive)).sum())
