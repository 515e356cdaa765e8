"""What stands beside a look: the ``info`` of a world, or what is kept of evidence that came without one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from atg_fg.core.looks import likely_pattern
from atg_fg.core.patterns import Confidences, Detection, Evidence, Measured, PatternAlphabet


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
