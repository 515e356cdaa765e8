"""Times taken side by side: rounds of all contestants alternate, and ratios are taken round by round.

A slow moment of the machine then meets all of them, so ratios hold where single times do not.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

#: Returns seconds that only grow, such as ``time.perf_counter``.
Clock: TypeAlias = Callable[[], float]
#: Seconds of each quantity that was measured at once, such as a step and a decision of the same trial.
Sample: TypeAlias = dict[str, float]


def alternate(contestants: Mapping[str, Callable[[], Sample]], n_rounds: int) -> dict[str, dict[str, list[float]]]:
    """Let each contestant take its turn in every round; return seconds by contestant and quantity, one a round.

    The one that begins is another in each round, since what comes first finds the processor's caches as the last left
    them.
    """
    names = list(contestants)
    samples: dict[str, list[Sample]] = {name: [] for name in names}
    for number in range(n_rounds):
        first = number % max(len(names), 1)
        for name in names[first:] + names[:first]:
            samples[name].append(contestants[name]())
    return {
        name: {quantity: [sample[quantity] for sample in taken] for quantity in (taken[0] if taken else {})}
        for name, taken in samples.items()
    }


def median_of(samples: Sequence[Sample]) -> Sample:
    """Return the median of each quantity."""
    return {quantity: statistics.median(sample[quantity] for sample in samples) for quantity in samples[0]}


def ratios(seconds: Sequence[float], reference: Sequence[float]) -> list[float]:
    """Return the ratio of both in each round."""
    return [own / other for own, other in zip(seconds, reference, strict=True)]


def spread(values: Sequence[float]) -> dict[str, Any]:
    """Return median and quartiles; of one value, that value."""
    if len(values) == 1:
        return {"median": values[0], "quartiles": [values[0], values[0]]}
    low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
    return {"median": middle, "quartiles": [low, high]}


def repeats_for(seconds: float, wanted: float, most: int) -> int:
    """Return how often to repeat what takes ``seconds``, so that it takes about ``wanted`` of them in all."""
    return max(1, min(most, round(wanted / max(seconds, 1e-9))))
