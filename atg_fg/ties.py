"""Which actions are equally good."""

from __future__ import annotations

from typing import Final

from atg_fg.patterns import FloatArray

#: Costs or expected entropies closer than this are a tie.
TIE_TOLERANCE: Final = 1e-9


def best_actions(costs: FloatArray) -> list[int]:
    """Return all actions whose cost, such as the expected entropy, is the least, up to ``TIE_TOLERANCE``."""
    values = costs.tolist()
    least = min(values) + TIE_TOLERANCE
    return [action for action, value in enumerate(values) if value <= least]
