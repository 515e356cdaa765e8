"""Parameters of the recognition model."""

from __future__ import annotations

from dataclasses import dataclass

from atg_fg.core.checks import number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import LEAST_SHARE


@dataclass(frozen=True)
class ModelParameters:
    """How much noise the model assumes, and whether it learns while a trial goes on.

    Attributes:
        transition_concentration: α ≥ 0, the Dirichlet concentration that the base distribution has
            beside the counted transitions.
        observation_noise: 0 ≤ δ < 1, the probability that a look shows a pattern drawn uniformly.
        learn_in_trial: Extend every hypothesis, *unseen* too, as the trial goes.
        learn_structure: Objects may follow one structure that all share, learned from all trials; only the engine
            ``learned-structure`` knows of it, and the memory has to be a ``StructuredMemory``.

    Raises:
        InvalidInputError: A value out of its range or not finite.
    """

    transition_concentration: float = 1e-8
    observation_noise: float = 1e-8
    learn_in_trial: bool = True
    learn_structure: bool = False

    def __post_init__(self) -> None:
        number(self.transition_concentration, "transition_concentration", 0.0)
        number(self.observation_noise, "observation_noise", 0.0, below=1.0)
        for name in ("transition_concentration", "observation_noise"):
            if 0 < getattr(self, name) < LEAST_SHARE:
                raise InvalidInputError(f"{name}: {getattr(self, name)!r}; expected 0, or at least {LEAST_SHARE}")
        for name in ("learn_in_trial", "learn_structure"):
            if not isinstance(getattr(self, name), bool):
                raise InvalidInputError(f"{name}: {getattr(self, name)!r}; expected true or false")
