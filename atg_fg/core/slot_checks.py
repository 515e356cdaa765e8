"""What a detector says of each slot, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from atg_fg.core.checks import brief, number, sequence
from atg_fg.core.errors import InvalidInputError

#: Greatest weight of a slot, and its inverse the least, that is left on its scale: products of 16 are still numbers.
_GREATEST: Final = 1e15


def check_slots(
    likelihoods: Sequence[ArrayLike | None], slots: Sequence[str], n_symbols: int, place: str = "likelihoods"
) -> tuple[tuple[float, ...] | None, ...]:
    """Return likelihoods of each slot's symbols as tuples, or raise ``InvalidInputError`` naming ``place``.

    None at all are as good. Only their ratios count: those of a slot whose greatest is beyond what can be multiplied
    are divided by it.
    """
    if len(sequence(likelihoods, place)) not in (0, len(slots)):
        raise InvalidInputError(f"{place}: {len(likelihoods)}; expected one for each of {len(slots)} slots, or none")
    result: list[tuple[float, ...] | None] = []
    for slot, given in zip(slots, likelihoods, strict=False):
        if given is None:
            result.append(None)
            continue
        where = f"{place}, slot {slot!r}"
        try:
            weights = np.array(given, dtype=np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise InvalidInputError(f"{where}: {brief(given)}; expected numbers") from error
        if weights.shape != (n_symbols,):
            raise InvalidInputError(
                f"{where}: shape {weights.shape}; expected a weight for each of {n_symbols} symbols"
            )
        greatest = weights.max()
        if not (weights.min() >= 0 and 0 < greatest < np.inf):  # a NaN is neither
            raise InvalidInputError(
                f"{where}: {brief(weights.tolist())}; expected finite ones of at least 0, not all 0"
            )
        is_usual = 1 / _GREATEST <= greatest <= _GREATEST
        result.append(tuple((weights if is_usual else weights / greatest).tolist()))
    return tuple(result)


def check_confidences(
    confidences: Sequence[float | None], n_slots: int, place: str = "confidences"
) -> tuple[float | None, ...]:
    """Return confidences as a tuple, or raise ``InvalidInputError`` naming ``place``; none at all are as good."""
    if len(sequence(confidences, place)) not in (0, n_slots):
        raise InvalidInputError(f"{place}: {len(confidences)}; expected one for each of {n_slots} slots, or none")
    return tuple(None if value is None else number(value, place) for value in confidences)
