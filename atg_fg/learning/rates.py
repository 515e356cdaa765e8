"""Rates that are learned with the structure: how often things go otherwise than the structure says."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray

#: Columns of events that are counted in a trial: what ``Tally`` sums up, and from the last on, of each action, how
#: probably it failed when it was last done.
SLIP, WRONG, REPEAT, REVEAL, AGAIN, FAILED_BEFORE, FAILED = range(7)

#: Beta priors (a, b): mean a / (a + b).
PRIORS: Final[dict[str, tuple[float, float]]] = {
    "slip": (1.0, 99.0),
    "wrong": (0.5, 199.5),
    "repeat": (0.5, 49.5),
    "share": (1.0, 1.0),
    "slip_again": (1.0, 1.0),
}
#: ε′ is a rate of its own if what was counted is so many nats more probable under it than under ε.
CLEARLY: Final = 4.0


@dataclass(frozen=True)
class Rates:
    """Rates in force; each is strictly between 0 and 1. The defaults are the means of their priors.

    Attributes:
        slip: ε, the probability that an action leaves the pose as it is.
        wrong: δ, the probability that a look shows a pattern drawn uniformly.
        repeat: κ, the probability that a register's symbol is drawn from all symbols, rather than from those that the
            object does not have elsewhere.
        share: π, the probability that an object follows the structure.
        slip_again: ε′, the probability of a slip if the action slipped when it was last done in the trial; ``None`` if
            that makes no difference.

    Raises:
        InvalidInputError: A rate that is not.
    """

    slip: float = 0.01
    wrong: float = 0.0025
    repeat: float = 0.01
    share: float = 0.5
    slip_again: float | None = None

    def __post_init__(self) -> None:
        for name, value in self.by_name().items():
            if isinstance(value, bool) or not isinstance(value, float) or not 0 < value < 1:
                raise InvalidInputError(f"rate {name}: {value!r}; expected a number between 0 and 1")

    @property
    def slips(self) -> tuple[float, float]:
        """ε and ε′."""
        return self.slip, self.slip if self.slip_again is None else self.slip_again

    def by_name(self) -> dict[str, float]:
        """Return all rates, ε′ if it is one of its own."""
        own = PRIORS.keys() if self.slip_again is not None else [name for name in PRIORS if name != "slip_again"]
        return {name: getattr(self, name) for name in own}


class Tally(NamedTuple):
    """Expected numbers of events, and of the occasions for them.

    Attributes:
        slips: Of ``n_actions`` actions.
        again: Of these slips, those of the ``n_failed_before`` actions that failed when they were last done.
        wrong: Looks, of ``n_looks``.
        repeats: Registers whose symbol was drawn from all symbols, of the ``reveals`` registers that were revealed.
    """

    slips: float
    n_actions: float
    again: float
    n_failed_before: float
    wrong: float
    n_looks: float
    repeats: float
    reveals: float


def estimate_rates(tally: Tally, followers: FloatArray, alone: Tally) -> Rates:
    """Return the posterior means of the rates.

    Args:
        tally: Over the trials that follow one of the structures, each counted as far as it does.
        followers: Probability of each object to follow the structure, shape [K].
        alone: Over the trials that would follow one structure if there were no other, which tells whether slips come
            together: objects that an action does not turn would else be another kind.
    """
    slip = _mean("slip", tally.slips - tally.again, tally.n_actions - tally.n_failed_before)
    return Rates(
        slip=slip,
        slip_again=_slip_again(slip, alone.again, alone.n_failed_before),
        wrong=_mean("wrong", tally.wrong, tally.n_looks),
        repeat=_mean("repeat", tally.repeats, tally.reveals),
        share=_mean("share", float(followers.sum()), len(followers)),
    )


def _slip_again(slip: float, again: float, n_failed_before: float) -> float | None:
    """Return the posterior mean of ε′; ``None`` unless any rate, each alike, is clearly better than ε."""
    succeeded = n_failed_before - again
    of_any = math.lgamma(1 + again) + math.lgamma(1 + succeeded) - math.lgamma(2 + n_failed_before)
    as_ever = again * math.log(slip) + succeeded * math.log1p(-slip)
    return _mean("slip_again", again, n_failed_before) if of_any > as_ever + CLEARLY else None


def _mean(name: str, events: float, occasions: float) -> float:
    a, b = PRIORS[name]
    mean = float(np.clip((a + events) / (a + b + occasions), 1e-9, 1 - 1e-9))
    # Sums of the same trials, scored at once or one by one, differ in their last digits.
    return float(f"{mean:.12g}")
