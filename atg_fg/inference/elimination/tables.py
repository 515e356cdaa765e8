"""The tables of bucket elimination and what is done with them, in two ways: as GTSAM factors, and as logarithms.

Variables are numbered in the order of their elimination, and every scope is ascending, so the variable that is
summed out of a table is the first of its scope. Each message is divided by its greatest value, and the logarithm of
that is kept apart. GTSAM multiplies plain numbers; ``GtsamTables`` raises ``RangeError`` before a product could leave
their range, and then the same steps are done by ``LogTables``. It is also for tables so large that the trees GTSAM
keeps, about 200 bytes an entry, would be too much.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import gtsam
import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.inference import gtsam_factors as factors

#: ln of the least number that a product may hold: above the least normal float, 2.2e-308.
_LN_LEAST: Final = -690.0


#: A bound below this is replaced by the least value itself.
_LN_LOOSE: Final = -200.0


class RangeError(ArithmeticError):
    """A product of plain numbers could fall below the least float."""


class Table(NamedTuple):
    """Values over some variables.

    Attributes:
        scope: The variables, ascending.
        values: A GTSAM factor, or an array with one axis a variable.
        ln_least: A number that is not above the logarithm of the least value that is not zero.
    """

    scope: tuple[int, ...]
    values: Any
    ln_least: float = 0.0


class TableArithmetic(ABC):
    """What elimination does with tables.

    Args:
        sizes: Number of states of each variable, at least 2.
    """

    def __init__(self, sizes: Sequence[int]) -> None:
        self.sizes = sizes

    def shape(self, scope: Sequence[int]) -> tuple[int, ...]:
        """Return the shape of a table."""
        return tuple(self.sizes[variable] for variable in scope)

    @abstractmethod
    def table(self, scope: tuple[int, ...], values: FloatArray) -> Table:
        """Return values, not all zero, divided by the greatest, which the caller keeps."""

    @abstractmethod
    def product(self, tables: Sequence[Table]) -> Table:
        """Return the product of at least one table.

        Raises:
            RangeError: Plain numbers cannot hold it, or one of the tables.
        """

    @abstractmethod
    def message(self, product: Table, *, maximise: bool) -> Table:
        """Sum the first variable out, or maximise over it."""

    @abstractmethod
    def scaled(self, message: Table) -> tuple[Table, float]:
        """Return a message divided by its greatest value, and the logarithm of that: −∞ if all is zero."""

    @abstractmethod
    def conditional(self, product: Table, message: Table) -> Table:
        """Return the first variable's weights given the others, as plain numbers: ``product / message``, 0 for 0/0."""

    @abstractmethod
    def joint(self, conditional: Table, others: Table) -> Table:
        """Return the joint distribution of a conditional and the distribution of its other variables."""

    @abstractmethod
    def marginal(self, joint: Table, scope: tuple[int, ...]) -> Table:
        """Sum all variables but ``scope`` out of a joint distribution."""

    @abstractmethod
    def weights(self, table: Table, states: Sequence[int]) -> FloatArray:
        """Return the first variable's weights, shape [its states], in a conditional or a joint distribution.

        Args:
            table: The table.
            states: The state of each of its other variables.
        """


class GtsamTables(TableArithmetic):
    """Tables as GTSAM decision-tree factors."""

    def _key(self, variable: int) -> int:
        # The highest key is the root of a tree; there a variable is summed out by adding two subtrees.
        return len(self.sizes) - variable

    def _factor(self, scope: Sequence[int], values: FloatArray) -> factors.Factor:
        return factors.factor([self._key(variable) for variable in scope], values)

    def table(self, scope: tuple[int, ...], values: FloatArray) -> Table:
        """See ``TableArithmetic``; a value that the division takes out of range is seen by the first product."""
        greatest = values.max()
        ln_least = float(np.log(values[values > 0].min()) - np.log(greatest))
        return Table(scope, self._factor(scope, values / greatest), ln_least)

    def product(self, tables: Sequence[Table]) -> Table:
        """See ``TableArithmetic``."""
        ln_least = sum(table.ln_least for table in tables)
        if ln_least < _LN_LEAST:
            raise RangeError
        # Small ones first, so that the whole table is made as seldom as possible.
        first, *rest = sorted(tables, key=lambda table: len(table.scope))
        values = first.values
        for table in rest:
            values = values * table.values
        return Table(tuple(sorted({variable for table in tables for variable in table.scope})), values, ln_least)

    def message(self, product: Table, *, maximise: bool) -> Table:
        """See ``TableArithmetic``."""
        first = factors.ordering([self._key(product.scope[0])])
        values = product.values.max(first) if maximise else product.values.sum(first)
        return Table(product.scope[1:], values, product.ln_least)

    def scaled(self, message: Table) -> tuple[Table, float]:
        """See ``TableArithmetic``."""
        scope, values, ln_least = message
        greatest = values.max(values.size())
        divisor = float(greatest(gtsam.DiscreteValues()))
        if not divisor > 0:
            return message, -math.inf
        values, ln_least = values / greatest, ln_least - math.log(divisor)
        if ln_least < _LN_LOOSE:
            # GTSAM divides by zero to zero, so the greatest inverse is that of the least value above zero.
            inverse = (greatest / greatest) / values
            ln_least = -math.log(inverse.max(inverse.size())(gtsam.DiscreteValues()))
        return Table(scope, values, ln_least), math.log(divisor)

    def conditional(self, product: Table, message: Table) -> Table:
        """See ``TableArithmetic``."""
        return Table(product.scope, product.values / message.values)

    def joint(self, conditional: Table, others: Table) -> Table:
        """See ``TableArithmetic``."""
        return Table(conditional.scope, conditional.values * others.values)

    def marginal(self, joint: Table, scope: tuple[int, ...]) -> Table:
        """See ``TableArithmetic``."""
        gone = [self._key(variable) for variable in joint.scope if variable not in scope]
        return Table(scope, joint.values.sum(factors.ordering(gone)) if gone else joint.values)

    def weights(self, table: Table, states: Sequence[int]) -> FloatArray:
        """See ``TableArithmetic``."""
        variable, *others = table.scope
        assignment = {self._key(other): state for other, state in zip(others, states, strict=True)}
        every = [{**assignment, self._key(variable): state} for state in range(self.sizes[variable])]
        return np.array([table.values(factors.assigned(one)) for one in every])


class LogTables(TableArithmetic):
    """Tables as arrays of logarithms, and of plain numbers where they are probabilities."""

    def table(self, scope: tuple[int, ...], values: FloatArray) -> Table:
        """See ``TableArithmetic``."""
        logarithms = np.log(values, out=np.full(values.shape, -np.inf), where=values > 0)
        return Table(scope, logarithms - logarithms.max())

    def product(self, tables: Sequence[Table]) -> Table:
        """See ``TableArithmetic``."""
        scope = tuple(sorted({variable for table in tables for variable in table.scope}))
        total = np.zeros(self.shape(scope))
        for table in tables:
            total += self._spread(table, scope)
        return Table(scope, total)

    def _spread(self, table: Table, scope: Sequence[int]) -> FloatArray:
        """Return an array with an axis for each variable of ``scope``, of length 1 where the table lacks it."""
        shape = [self.sizes[variable] if variable in table.scope else 1 for variable in scope]
        spread: FloatArray = table.values.reshape(shape)
        return spread

    def message(self, product: Table, *, maximise: bool) -> Table:
        """See ``TableArithmetic``."""
        values = product.values.max(axis=0)
        if not maximise:
            possible = values > -np.inf
            summed = np.exp(product.values - np.where(possible, values, 0.0)).sum(axis=0)
            values = values + np.log(summed, out=np.zeros_like(summed), where=possible)
        return Table(product.scope[1:], values)

    def scaled(self, message: Table) -> tuple[Table, float]:
        """See ``TableArithmetic``."""
        greatest = float(message.values.max())
        if greatest == -math.inf:
            return message, greatest
        return Table(message.scope, message.values - greatest), greatest

    def conditional(self, product: Table, message: Table) -> Table:
        """See ``TableArithmetic``."""
        divisor = np.where(message.values > -np.inf, message.values, 0.0)
        return Table(product.scope, np.exp(product.values - divisor))

    def joint(self, conditional: Table, others: Table) -> Table:
        """See ``TableArithmetic``."""
        return Table(conditional.scope, conditional.values * others.values)

    def marginal(self, joint: Table, scope: tuple[int, ...]) -> Table:
        """See ``TableArithmetic``."""
        gone = tuple(axis for axis, variable in enumerate(joint.scope) if variable not in scope)
        return Table(scope, joint.values.sum(axis=gone))

    def weights(self, table: Table, states: Sequence[int]) -> FloatArray:
        """See ``TableArithmetic``."""
        weights: FloatArray = table.values[(slice(None), *states)]
        return weights
