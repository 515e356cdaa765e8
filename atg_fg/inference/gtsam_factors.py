"""Plain arrays to GTSAM factors: the one place that knows keys, their order and what GTSAM must not be given.

GTSAM does not check cardinalities, signs or NaN, and some bad values crash the interpreter; so every array is
checked here. A variable with a single state makes GTSAM read memory that is not its own, so such a variable gets
a second, impossible state, which is left out again where values are read.

The highest key becomes the root of a decision tree: O is highest, then X0, X1, … downwards, and the hypothetical
observation is lowest. Several objects in one graph have numbers from 1: O1, O2, … are highest, then X1,0, X1,1, …,
X2,0, … downwards. The only object of a graph has the number 0, which its names leave out.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Final, TypeAlias

import gtsam
import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray

#: GTSAM's classes are not typed; these aliases say what is meant.
Factor: TypeAlias = Any
FactorGraph: TypeAlias = Any
Ordering: TypeAlias = Any
MAX_TIME: Final = 1_000_000
MAX_NUMBER: Final = 1_000
_FIRST_OBJECT_KEY: Final = (MAX_NUMBER + 3) * MAX_TIME
_FIRST_ASPECT_KEY: Final = (MAX_NUMBER + 2) * MAX_TIME
HYPOTHETICAL_KEY: Final = 1


def object_key(number: int = 0) -> int:
    """Key of the object variable O, or of O_number of several."""
    if not 0 <= number <= MAX_NUMBER:
        raise InvalidInputError(f"object: {number}; expected 0 to {MAX_NUMBER}")
    return _FIRST_OBJECT_KEY - number


def aspect_key(time: int, number: int = 0) -> int:
    """Key of the aspect variable X_time, or of that of O_number of several."""
    if not 0 <= time < MAX_TIME:
        raise InvalidInputError(f"time: {time}; expected 0 to {MAX_TIME - 1}")
    if not 0 <= number <= MAX_NUMBER:
        raise InvalidInputError(f"object: {number}; expected 0 to {MAX_NUMBER}")
    return _FIRST_ASPECT_KEY - number * MAX_TIME - time


def key_name(key: int) -> str:
    """Name of a variable as the paper writes it: O, X0, X1, …, or Z for a hypothetical observation.

    With several objects it is O1, O2, … and X1,0, X1,1, …, X2,0, …: first the object, then the time.
    """
    if key == HYPOTHETICAL_KEY:
        return "Z"
    if key > _FIRST_ASPECT_KEY:
        number = _FIRST_OBJECT_KEY - key
        return f"O{number}" if number else "O"
    number, time = divmod(_FIRST_ASPECT_KEY - key, MAX_TIME)
    return f"X{number},{time}" if number else f"X{time}"


def names(keys: Iterable[int]) -> str:
    """Return the names of variables in one text, such as "O, X0"."""
    return ", ".join(key_name(key) for key in keys)


def names_in(factor: Factor) -> tuple[str, ...]:
    """Return the names of a factor's variables, objects first and then by time."""
    return tuple(key_name(key) for key in sorted(factor.keys(), reverse=True))


def factor(keys: Sequence[int], table: FloatArray) -> Factor:
    """Return a factor on ``keys`` with the values of ``table``, one axis a key.

    Raises:
        InvalidInputError: Not one axis a key, an empty axis, or a value that is negative or not finite.
    """
    if table.ndim != len(keys) or 0 in table.shape:
        raise InvalidInputError(
            f"factor on ({names(keys)}): shape {table.shape}; expected one axis a variable, none empty"
        )
    if not (table.min() >= 0 and table.sum() < np.inf):  # the sum of anything with a NaN is below nothing
        raise InvalidInputError(f"factor on ({names(keys)}): expected finite values of at least 0")
    if 1 in table.shape:
        table = np.pad(table, [(0, cardinality(size) - size) for size in table.shape])
    return gtsam.DecisionTreeFactor(list(zip(keys, table.shape, strict=True)), table.ravel().tolist())


def cardinality(n_states: int) -> int:
    """Return the cardinality that GTSAM is told for a variable with ``n_states`` states."""
    return max(n_states, 2)


def ordering(keys: Iterable[int]) -> Ordering:
    """Return an elimination ordering."""
    order = gtsam.Ordering()
    for key in keys:
        order.push_back(key)
    return order


def assigned(assignment: dict[int, int]) -> Any:
    """Return an assignment of states to keys."""
    result = gtsam.DiscreteValues()
    for key, state in assignment.items():
        result[key] = state
    return result


def total(weights: Factor) -> float:
    """Return the sum of a factor's values."""
    return float(weights.sum(weights.size())(gtsam.DiscreteValues()))


def vector(weights: Factor, n_states: int) -> FloatArray:
    """Return the values of a factor on one variable, shape [n_states], without normalising them."""
    normaliser = total(weights)
    if not normaliser > 0:
        return np.zeros(n_states)
    return normaliser * np.array(gtsam.DiscreteDistribution(weights).pmf())[:n_states]


def table(weights: Factor, sizes: dict[int, int]) -> FloatArray:
    """Return the values of a factor as an array with one axis for each key of ``sizes`` (key: states)."""
    keys = list(sizes)
    values_by_state = np.zeros([cardinality(size) for size in sizes.values()])
    for assignment, value in weights.enumerate():
        values_by_state[tuple(assignment[key] for key in keys)] = value
    return values_by_state[tuple(slice(size) for size in sizes.values())]
