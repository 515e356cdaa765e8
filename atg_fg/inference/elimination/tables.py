"""The tables of bucket elimination and what is done with them: sums and products of logarithms.

Variables are numbered in the order of their elimination, and every scope is ascending, so the variable that is
summed out of a table is the first of its scope. Each message is divided by its greatest value, and the logarithm of
that is kept apart. So no weight is too small or too large for a float.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from atg_fg.core.log_math import log_of
from atg_fg.core.patterns import FloatArray


class Table(NamedTuple):
    """Values over some variables.

    Attributes:
        scope: The variables, ascending.
        values: Logarithms, or plain numbers where they are probabilities; one axis a variable.
    """

    scope: tuple[int, ...]
    values: FloatArray


def log_table(scope: tuple[int, ...], weights: FloatArray) -> Table:
    """Return the logarithms of weights, not all zero, divided by the greatest, which the caller keeps."""
    logarithms = log_of(weights)
    return Table(scope, logarithms - logarithms.max())


def product(tables: Sequence[Table]) -> Table:
    """Return the product of at least one table of logarithms."""
    scope = tuple(sorted({variable for table in tables for variable in table.scope}))
    spread = [_spread(table, scope) for table in tables]
    total = np.zeros(np.broadcast_shapes(*(values.shape for values in spread)))
    for values in spread:
        total += values
    return Table(scope, total)


def _spread(table: Table, scope: Sequence[int]) -> FloatArray:
    """Return an array with an axis for each variable of ``scope``, of length 1 where the table lacks it."""
    lacking = tuple(axis for axis, variable in enumerate(scope) if variable not in table.scope)
    return np.expand_dims(table.values, lacking)


def message(product: Table, *, maximise: bool) -> Table:
    """Sum the first variable out of a table of logarithms, or maximise over it."""
    values = product.values.max(axis=0)
    if not maximise:
        possible = values > -np.inf
        summed = np.exp(product.values - np.where(possible, values, 0.0)).sum(axis=0)
        values = values + np.log(summed, out=np.zeros_like(summed), where=possible)
    return Table(product.scope[1:], values)


def scaled(message: Table) -> tuple[Table, float]:
    """Return a message divided by its greatest value, and the logarithm of that: −∞ if all is zero."""
    greatest = float(message.values.max())
    if greatest == -math.inf:
        return message, greatest
    return Table(message.scope, message.values - greatest), greatest


def conditional(product: Table, message: Table) -> Table:
    """Return the first variable's weights given the others, as plain numbers: ``product / message``, 0 for 0/0."""
    divisor = np.where(message.values > -np.inf, message.values, 0.0)
    return Table(product.scope, np.exp(product.values - divisor))


def joint(conditional: Table, others: Table) -> Table:
    """Return the joint distribution of a conditional and the distribution of its other variables."""
    return Table(conditional.scope, conditional.values * others.values)


def marginal(joint: Table, scope: tuple[int, ...]) -> Table:
    """Sum all variables but ``scope`` out of a joint distribution."""
    gone = tuple(axis for axis, variable in enumerate(joint.scope) if variable not in scope)
    return Table(scope, joint.values.sum(axis=gone))
