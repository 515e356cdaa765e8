"""An order in which to sum variables out of a factor graph, and the sizes of the tables that it makes."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import NamedTuple, TypeAlias

from atg_fg.core.errors import TooLargeError

_BYTES_PER_ENTRY = 8


#: Fill edges (or a bound below them), logarithm of the table's size, the variable; then whether the number is exact,
#: and the variable's version.
_Candidate: TypeAlias = tuple[int, float, int, bool, int]


class EliminationOrder(NamedTuple):
    """An order of elimination and what it costs.

    Attributes:
        variables: All variables, the first to be eliminated first.
        entries: Size of the table that each is summed out of, in the same order.
    """

    variables: tuple[int, ...]
    entries: tuple[int, ...]


class EntryBudget(NamedTuple):
    """How many entries tables may have; they are counted before they are made.

    Attributes:
        limit: The most entries.
        together: Whether the limit is for all tables together, because all are kept, or for each of them.
        taken: Entries that are kept besides.
    """

    limit: int
    together: bool = False
    taken: int = 0

    def check(self, entries: int, total: int) -> None:
        """Check a table of ``entries``, which makes ``total`` with all those before it.

        Raises:
            TooLargeError: It is above the limit.
        """
        needed = self.taken + total if self.together else entries
        if needed > self.limit:
            what = "tables of together" if self.together else "a table of"
            raise TooLargeError(
                f"elimination: would need {what} at least {_shown(needed)} entries "
                f"({_shown(needed * _BYTES_PER_ENTRY)} bytes); the limit is {self.limit} entries"
            )


def best_order(scopes: Sequence[Sequence[int]], sizes: Sequence[int], budget: EntryBudget) -> EliminationOrder:
    """Return the cheaper of two orders: one that adds the fewest edges at each step, and the order of the numbers.

    The first is good on most graphs; in a chain or a grid that is numbered along its rows the second is hard to beat.

    Args:
        scopes: The variables of each factor.
        sizes: Number of states of each variable.
        budget: Counts the table of each step.

    Raises:
        TooLargeError: Both orders need more than the budget. An order is given up at the first table that is too
            large, so the message says *at least*.
    """
    orders, refusals = [], []
    for by_number in (False, True):
        try:
            orders.append(_order(_FillGraph(scopes, sizes), by_number, budget))
        except TooLargeError as error:
            refusals.append(error)
    if not orders:
        raise refusals[0]
    return min(orders, key=lambda order: sum(order.entries))


def _order(graph: _FillGraph, by_number: bool, budget: EntryBudget) -> EliminationOrder:
    variables: list[int] = []
    entries: list[int] = []
    total = 0
    for number in range(graph.n_variables):
        variable = number if by_number else graph.cheapest()
        entries.append(graph.entries(variable))
        total += entries[-1]
        budget.check(entries[-1], total)
        graph.eliminate(variable)
        variables.append(variable)
    return EliminationOrder(tuple(variables), tuple(entries))


class _FillGraph:
    """Which variables share a table, while variables are eliminated; finds the one that adds fewest edges.

    Counting the edges that a variable of many neighbours would add is long, and it is seldom the cheapest. So a
    count stops when it is certain that another variable is cheaper, and goes on only when that one is gone.
    """

    def __init__(self, scopes: Iterable[Sequence[int]], sizes: Sequence[int]) -> None:
        self._sizes = sizes
        self._neighbours: list[set[int]] = [set() for _ in sizes]
        for scope in scopes:
            for variable in scope:
                self._neighbours[variable].update(scope)
        for variable, neighbours in enumerate(self._neighbours):
            neighbours.discard(variable)
        self._versions = [0] * len(sizes)
        self._queue: list[_Candidate] = [(0, 0.0, variable, False, 0) for variable in range(len(sizes))]
        heapq.heapify(self._queue)

    @property
    def n_variables(self) -> int:
        """Number of variables, those eliminated included."""
        return len(self._sizes)

    def entries(self, variable: int) -> int:
        """Return the size of the table that a variable would be summed out of."""
        return math.prod((self._sizes[variable], *(self._sizes[other] for other in self._neighbours[variable])))

    def cheapest(self) -> int:
        """Take the variable that adds fewest edges off the queue."""
        while True:
            _, _, variable, exact, version = heapq.heappop(self._queue)
            if version != self._versions[variable]:
                continue
            if exact:
                return variable
            heapq.heappush(self._queue, self._counted(variable, self._queue[0][0] if self._queue else 0))

    def _counted(self, variable: int, enough: int) -> _Candidate:
        """Return a variable with the edges it would add, or with a bound above ``enough``."""
        neighbours, version = self._neighbours[variable], self._versions[variable]
        missing, bound = 0, 2 * enough + 1
        for other in neighbours:
            missing += len(neighbours) - 1 - len(neighbours & self._neighbours[other])
            if missing // 2 > bound:
                return missing // 2, 0.0, variable, False, version
        size = sum(math.log(self._sizes[member]) for member in (variable, *neighbours))
        return missing // 2, size, variable, True, version

    def eliminate(self, variable: int) -> None:
        """Join the neighbours of a variable with each other and take it out."""
        neighbours = self._neighbours[variable]
        changed = set(neighbours)
        for other in neighbours:
            self._neighbours[other].discard(variable)
        for one, other in combinations(sorted(neighbours), 2):
            if other not in self._neighbours[one]:
                changed |= self._neighbours[one] & self._neighbours[other]
                self._neighbours[one].add(other)
                self._neighbours[other].add(one)
        self._neighbours[variable] = set()
        for other in changed:
            self._versions[other] += 1
            heapq.heappush(self._queue, (0, 0.0, other, False, self._versions[other]))


def _shown(number: int) -> str:
    """Return a whole number in digits, or as a power of two if it is very long."""
    return str(number) if number < 10**18 else f"2**{number.bit_length() - 1}"
