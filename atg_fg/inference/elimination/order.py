"""An order in which to sum variables out of a factor graph, and the sizes of the tables that it makes."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Sequence
from itertools import combinations
from typing import Final, NamedTuple, TypeAlias

from atg_fg.core.errors import TooLargeError

_BYTES_PER_ENTRY: Final = 8
#: Entries that all tables may have which are made in turn and not kept, or 64 times the limit: they cost time.
IN_TURN: Final = 2**32
#: Pairs of neighbours that are looked at to say what an order needs, after its first table above the limit: a second.
MOST_WORK: Final = 1_000_000
#: Fill edges (or a bound below them), logarithm of the table's size, the variable; then whether the number is exact,
#: and the variable's version.
_Candidate: TypeAlias = tuple[int, float, int, bool, int]


class EliminationOrder(NamedTuple):
    """An order of elimination and what it costs.

    Attributes:
        variables: The variables, the first to be eliminated first; all of them, unless that takes too long.
        entries: Size of the table that each is summed out of, in the same order.
        is_complete: Whether these are all variables.
    """

    variables: tuple[int, ...]
    entries: tuple[int, ...]
    is_complete: bool


class EntryBudget(NamedTuple):
    """How many entries tables may have; they are counted before the first is made, for memory and for time.

    Attributes:
        limit: The most entries of all tables together if all are kept, else of the largest (then see ``IN_TURN``).
        together: Whether all are kept.
        taken: Entries that are kept besides.
    """

    limit: int
    together: bool = False
    taken: int = 0

    def excess(self, order: EliminationOrder) -> str | None:
        """Return what an order would need, if that is too much."""
        total, largest = self.taken + sum(order.entries), max(order.entries, default=0)
        if self.together:
            needs = [("tables of together", total, self.limit)]
        else:
            needs = [
                ("a table of", largest, self.limit),
                ("to make tables in turn, of", total, max(IN_TURN, 64 * self.limit)),
            ]
        for what, needed, limit in needs:
            if needed > limit:
                shown, more = (_shown, "") if order.is_complete else (_power, "more than ")
                size = f"{more}{shown(needed)} entries ({more}{shown(needed * _BYTES_PER_ENTRY)} bytes)"
                return f"elimination: would need {what} {size}; the limit is {limit} entries"
        return None


def best_order(scopes: Sequence[Sequence[int]], sizes: Sequence[int], budget: EntryBudget) -> EliminationOrder:
    """Return the cheaper of two orders: one that adds the fewest edges at each step, and the order of the numbers.

    The first is good on most graphs; in a chain or a grid that is numbered along its rows the second is hard to beat.

    Args:
        scopes: The variables of each factor.
        sizes: Number of states of each variable.
        budget: What the tables may need.

    Raises:
        TooLargeError: Both orders need more than the budget; the message says what the better one needs, or *more than*
            what was counted if its tables are so many or so large that counting them all would take too long.
    """
    orders = [_order(_FillGraph(scopes, sizes), by_number, budget) for by_number in (False, True)]
    best = min(orders, key=lambda order: (budget.excess(order) is not None, not order.is_complete, sum(order.entries)))
    excess = budget.excess(best)
    if excess is not None:
        raise TooLargeError(excess)
    return best


def _order(graph: _FillGraph, by_number: bool, budget: EntryBudget) -> EliminationOrder:
    variables: list[int] = []
    entries: list[int] = []
    most = math.inf
    for number in range(graph.n_variables):
        variable = number if by_number else graph.cheapest()
        variables.append(variable)
        entries.append(graph.entries(variable))
        if entries[-1] > budget.limit:
            most = min(most, graph.work + MOST_WORK)
        if graph.work + graph.degree(variable) ** 2 > most:
            return EliminationOrder(tuple(variables), tuple(entries), is_complete=False)
        graph.eliminate(variable)
    return EliminationOrder(tuple(variables), tuple(entries), is_complete=True)


class _FillGraph:
    """Which variables share a table, while variables are eliminated; finds the one that adds fewest edges.

    Counting the edges that a variable of many neighbours would add takes long, and such a variable is seldom the
    cheapest. So a count stops when it is certain that another variable is cheaper, and goes on only when that one is
    gone.
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
        #: pairs of neighbours looked at so far
        self.work = 0

    @property
    def n_variables(self) -> int:
        """Number of variables, those eliminated included."""
        return len(self._sizes)

    def entries(self, variable: int) -> int:
        """Return the size of the table that a variable would be summed out of."""
        return math.prod((self._sizes[variable], *(self._sizes[other] for other in self._neighbours[variable])))

    def degree(self, variable: int) -> int:
        """Return how many variables share a table with a variable."""
        return len(self._neighbours[variable])

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
            self.work += len(neighbours)
            missing += len(neighbours) - 1 - len(neighbours & self._neighbours[other])
            if missing // 2 > bound:
                return missing // 2, 0.0, variable, False, version
        size = sum(math.log(self._sizes[member]) for member in (variable, *neighbours))
        return missing // 2, size, variable, True, version

    def eliminate(self, variable: int) -> None:
        """Join the neighbours of a variable with each other and take it out."""
        neighbours = self._neighbours[variable]
        self.work += len(neighbours) ** 2
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
    return str(number) if number < 10**18 else _power(number)


def _power(number: int) -> str:
    """Return a whole number above zero rounded down to a power of two."""
    return f"2**{number.bit_length() - 1}"
