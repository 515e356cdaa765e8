"""Rates that are learned with the structure: how often things go otherwise than the structure says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray

#: Beta priors (a, b): mean a / (a + b).
PRIORS: Final[dict[str, tuple[float, float]]] = {
    "slip": (1.0, 99.0),
    "wrong": (0.5, 199.5),
    "repeat": (0.5, 49.5),
    "share": (1.0, 1.0),
}


@dataclass(frozen=True)
class Rates:
    """Rates in force; each is strictly between 0 and 1. The defaults are the means of their priors.

    Attributes:
        slip: ε, the probability that an action leaves the pose as it is.
        wrong: δ, the probability that a look shows a pattern drawn uniformly.
        repeat: κ, the probability that a register's symbol is drawn from all symbols, rather than from those that the
            object does not have elsewhere.
        share: π, the probability that an object follows the structure.

    Raises:
        InvalidInputError: A rate that is not.
    """

    slip: float = 0.01
    wrong: float = 0.0025
    repeat: float = 0.01
    share: float = 0.5

    def __post_init__(self) -> None:
        for name in PRIORS:
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, float) or not 0 < value < 1:
                raise InvalidInputError(f"rate {name}: {value!r}; expected a number between 0 and 1")


class Tally(NamedTuple):
    """Expected numbers of events, and of the occasions for them.

    Attributes:
        slips: Of ``n_actions`` actions.
        wrong: Looks, of ``n_looks``.
        repeats: Registers whose symbol was drawn from all symbols, of the ``reveals`` registers that were revealed.
    """

    slips: float
    n_actions: float
    wrong: float
    n_looks: float
    repeats: float
    reveals: float


def estimate_rates(tally: Tally, followers: FloatArray) -> Rates:
    """Return the posterior means of the rates.

    Args:
        tally: Over the trials that follow the structure, each counted as far as it does.
        followers: Probability of each object to follow the structure, shape [K].
    """
    return Rates(
        slip=_mean("slip", tally.slips, tally.n_actions),
        wrong=_mean("wrong", tally.wrong, tally.n_looks),
        repeat=_mean("repeat", tally.repeats, tally.reveals),
        share=_mean("share", float(followers.sum()), len(followers)),
    )


def _mean(name: str, events: float, occasions: float) -> float:
    a, b = PRIORS[name]
    mean = float(np.clip((a + events) / (a + b + occasions), 1e-9, 1 - 1e-9))
    # Sums of the same trials, scored at once or one by one, differ in their last digits.
    return float(f"{mean:.12g}")
