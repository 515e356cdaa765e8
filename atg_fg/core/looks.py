"""A look as a person or a detector writes it, as evidence, and what stands beside it: the ``info`` of a world.

Of evidence that came without a world the same is kept.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from atg_fg.core.checks import brief, number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import ObjectSense, check_measured
from atg_fg.core.patterns import Confidences, Detection, Evidence, FloatArray, Measured, PatternAlphabet

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


def confidences_in(info: Mapping[str, Any]) -> Confidences:
    """Return how sure the detector is of each symbol, as a world's ``info`` of a look has it; empty without."""
    return tuple(info.get("confidences") or ())


def confidences_of(looks: Sequence[Mapping[str, Any]]) -> tuple[Confidences, ...]:
    """Return the confidences in the ``info`` of each look; empty if there are none at all."""
    stated = tuple(confidences_in(info) for info in looks)
    return stated if any(stated) else ()


def surest_looks(
    detections: Iterable[Sequence[int | None]], confidences: Iterable[Sequence[float | None]]
) -> dict[int, tuple[int, int]]:
    """Return for each symbol the look and the slot that show it most surely, the first of several that do.

    Args:
        detections: The symbol seen in each slot at each look, ``None`` where nothing was.
        confidences: How sure it is; those of a look may be left out.
    """
    best: dict[int, tuple[float, int, int]] = {}
    for look, (symbols, stated) in enumerate(zip(detections, confidences, strict=True)):
        for slot, symbol in enumerate(symbols):
            surely = (stated[slot] if stated else None) or 0.0
            if symbol is not None and surely > best.get(symbol, (-1.0,))[0]:
                best[symbol] = surely, look, slot
    return {symbol: (look, slot) for symbol, (_, look, slot) in sorted(best.items())}


def measured_in(info: Mapping[str, Any]) -> Measured:
    """Return the readings of the object as a whole, as the ``info`` of a look has them by name; empty without."""
    return tuple((str(name), float(value)) for name, value in (info.get("measured") or {}).items())


def truth_of(evidence: Evidence, presented: int | str | None = None) -> dict[str, Any]:
    """Return the ``info`` of a look that came without a world: what was presented, if known, and the evidence kept."""
    return {
        **({} if presented is None else {"object": presented}),
        **({"confidences": evidence.confidences} if evidence.confidences else {}),
        **({"likelihoods": evidence.slots} if evidence.slots else {}),
        **({"measured": dict(evidence.measured)} if evidence.measured else {}),
    }


def evidence_in(alphabet: PatternAlphabet, detection: Detection, info: Mapping[str, Any]) -> Evidence:
    """Return the evidence of a look that was recorded as a detection and the ``info`` beside it."""
    likelihoods, measured = info.get("likelihoods") or (), measured_in(info)
    if any(likelihoods):
        evidence = Evidence.of_slots(alphabet, likelihoods, detection, confidences_in(info))
    else:
        evidence = Evidence.of_detection(alphabet, detection, confidences_in(info))
    return evidence.with_readings(measured)


def pattern_to_learn(
    alphabet: PatternAlphabet, detection: Detection, pattern: int | None, info: Mapping[str, Any]
) -> int | None:
    """Return the pattern to learn from, also where there are likelihoods; a sense says itself what is clear."""
    if pattern is not None or info.get("readings") or not any(info.get("likelihoods") or ()):
        return pattern
    return likely_pattern(evidence_in(alphabet, detection, info))
