"""A product of tables over discrete variables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray

KINDS: Final = ("MARKOV", "BAYES")
#: NumPy's greatest number of axes.
MAX_SCOPE: Final = 64


class ModelFactor(NamedTuple):
    """A factor of a discrete model.

    Attributes:
        scope: Its variables, all different.
        table: Its values, one axis a variable in the order of the scope; a single number if the scope is empty.
    """

    scope: tuple[int, ...]
    table: FloatArray


@dataclass(frozen=True, eq=False)
class DiscreteModel:
    """A product of non-negative tables over discrete variables; its tables cannot be written to.

    Attributes:
        cardinalities: Number of states of each variable.
        factors: The tables; each is of the shape that the cardinalities of its scope make.
        kind: ``"MARKOV"``, or ``"BAYES"`` if each table is the distribution of its scope's last variable given the
            others. Both mean the product of the tables; that the distributions sum to 1 is not checked.

    Raises:
        InvalidInputError: Anything that does not fit together, or a value that is negative or not finite.
    """

    cardinalities: tuple[int, ...]
    factors: tuple[ModelFactor, ...]
    kind: str = "MARKOV"

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InvalidInputError(f"model: kind {self.kind!r}; expected one of: {', '.join(KINDS)}")
        for variable, cardinality in enumerate(self.cardinalities):
            if not _is_whole(cardinality) or cardinality < 1:
                raise InvalidInputError(f"model: variable {variable}: cardinality {cardinality!r}; expected at least 1")
        checked = [self._checked(index, *factor) for index, factor in enumerate(self.factors)]
        object.__setattr__(self, "cardinalities", tuple(map(int, self.cardinalities)))
        object.__setattr__(self, "factors", tuple(checked))

    def _checked(self, index: int, scope: Iterable[int], table: FloatArray) -> ModelFactor:
        """Return a factor whose table is its own, or raise ``InvalidInputError``."""
        place = f"model: factor {index}"
        scope = tuple(scope)
        if not all(_is_whole(variable) and 0 <= variable < len(self.cardinalities) for variable in scope):
            raise InvalidInputError(f"{place}: scope {scope}; expected variables 0 to {len(self.cardinalities) - 1}")
        if len(set(scope)) < len(scope):
            raise InvalidInputError(f"{place}: scope {scope} has a variable twice; expected all different")
        own = np.array(table, dtype=np.float64, order="C")
        shape = tuple(int(self.cardinalities[variable]) for variable in scope)
        if own.shape != shape:
            raise InvalidInputError(f"{place}: a table of shape {own.shape}; expected {shape}")
        if not (np.isfinite(own).all() and (own >= 0).all()):
            raise InvalidInputError(f"{place}: a value is negative or not finite; expected finite values of at least 0")
        own.setflags(write=False)
        return ModelFactor(tuple(map(int, scope)), own)

    def check_evidence(self, evidence: Mapping[int, int], place: str = "evidence") -> None:
        """Raise ``InvalidInputError``, naming ``place``, for a variable or a state that this model does not have."""
        for variable, state in evidence.items():
            if not _is_whole(variable) or not 0 <= variable < len(self.cardinalities):
                raise InvalidInputError(
                    f"{place}: variable {variable!r}; expected one of the {len(self.cardinalities)} variables from 0"
                )
            if not _is_whole(state) or not 0 <= state < self.cardinalities[variable]:
                raise InvalidInputError(
                    f"{place}: state {state!r} of variable {variable}; expected 0 to {self.cardinalities[variable] - 1}"
                )


def _is_whole(value: object) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)
