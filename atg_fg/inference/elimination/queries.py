"""Exact inference on any discrete factor graph: partition function, marginals, most probable explanation.

Bucket elimination on logarithms, in an order whose tables are measured before the first is made. Observed variables,
and those with a single state, are taken out of the tables first. GTSAM does not eliminate here: it chooses its joint
tables itself, and it keeps weights as plain numbers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.elimination import tables
from atg_fg.inference.elimination.discrete_model import DiscreteModel
from atg_fg.inference.elimination.order import EliminationOrder, EntryBudget, best_order
from atg_fg.inference.elimination.tables import Table

#: The most entries that tables may have if nothing else is asked for; 8 bytes each.
DEFAULT_LIMIT: Final = 2**26


class Explanation(NamedTuple):
    """A most probable explanation.

    Attributes:
        states: The state of every variable, those observed included.
        log_weight: ln of the product of all tables there.
    """

    states: tuple[int, ...]
    log_weight: float


def log_partition(model: DiscreteModel, evidence: Mapping[int, int] | None = None, limit: int = DEFAULT_LIMIT) -> float:
    """Return ln Z: of the sum over all assignments that agree with the evidence of the product of all tables.

    Args:
        model: The model.
        evidence: The state of each observed variable.
        limit: The most entries of a table.

    Raises:
        InvalidInputError: Evidence that does not fit the model.
        ImpossibleEvidenceError: Z is zero.
        TooLargeError: The tables would be above the limit.
    """
    graph = _ReducedGraph(model, evidence or {})
    order = graph.order(EntryBudget(limit))
    return _eliminated(graph, order, maximise=False, keep=False)[1]


def marginals(
    model: DiscreteModel, evidence: Mapping[int, int] | None = None, limit: int = DEFAULT_LIMIT
) -> list[FloatArray]:
    """Return the distribution of every variable given the evidence, each of shape [its cardinality].

    Args:
        model: The model.
        evidence: The state of each observed variable.
        limit: The most entries of all tables together, since they are kept.

    Raises:
        InvalidInputError: Evidence that does not fit the model.
        ImpossibleEvidenceError: The evidence has probability zero.
        TooLargeError: The tables would be above the limit.
    """
    graph = _ReducedGraph(model, evidence or {})
    fixed = sum(model.cardinalities[variable] for variable in graph.states)
    order = graph.order(EntryBudget(limit, together=True, taken=fixed))
    by_number = _distributions(_eliminated(graph, order, maximise=False, keep=True)[0])
    result = [np.empty(0)] * len(model.cardinalities)
    for variable, state in graph.states.items():
        result[variable] = np.zeros(model.cardinalities[variable])
        result[variable][state] = 1.0
    for number, distribution in enumerate(by_number):
        result[graph.free[order.variables[number]]] = distribution
    return result


def most_probable_explanation(
    model: DiscreteModel, evidence: Mapping[int, int] | None = None, limit: int = DEFAULT_LIMIT
) -> Explanation:
    """Return an assignment that agrees with the evidence and has the greatest weight; of several, any.

    Args:
        model: The model.
        evidence: The state of each observed variable.
        limit: The most entries of all tables together, since they are kept.

    Raises:
        InvalidInputError: Evidence that does not fit the model.
        ImpossibleEvidenceError: The evidence has probability zero.
        TooLargeError: The tables would be above the limit.
    """
    graph = _ReducedGraph(model, evidence or {})
    order = graph.order(EntryBudget(limit, together=True))
    conditionals, log_weight = _eliminated(graph, order, maximise=True, keep=True)
    chosen: dict[int, int] = {}
    for number, conditional in reversed(list(enumerate(conditionals))):
        place: tuple[slice | int, ...] = (slice(None), *(chosen[other] for other in conditional.scope[1:]))
        chosen[number] = int(conditional.values[place].argmax())
    states = dict(graph.states)
    states.update({graph.free[order.variables[number]]: state for number, state in chosen.items()})
    return Explanation(tuple(states[variable] for variable in range(len(model.cardinalities))), log_weight)


class _ReducedGraph:
    """A model without the variables whose state is known.

    Attributes:
        states: The state of each observed variable, and 0 for those with a single state.
        free: The other variables; below, a variable is its index here.
        sizes: Their cardinalities.
        tables: The factors on them: scope, and values that are not all zero.
        log_factors: ln of the greatest value of each table, those included that have become a plain number.
    """

    def __init__(self, model: DiscreteModel, evidence: Mapping[int, int]) -> None:
        model.check_evidence(evidence)
        single = {variable: 0 for variable, size in enumerate(model.cardinalities) if size == 1}
        self.states: dict[int, int] = {**single, **evidence}
        self.free = [variable for variable in range(len(model.cardinalities)) if variable not in self.states]
        self.sizes = [model.cardinalities[variable] for variable in self.free]
        self.tables: list[tuple[tuple[int, ...], FloatArray]] = []
        self.log_factors: list[float] = []
        index_of = {variable: index for index, variable in enumerate(self.free)}
        for scope, table in model.factors:
            reduced = table[tuple(self.states.get(variable, slice(None)) for variable in scope)]
            if not reduced.any():
                raise _impossible()
            self.log_factors.append(math.log(reduced.max()))
            if reduced.ndim:
                self.tables.append((tuple(index_of[variable] for variable in scope if variable in index_of), reduced))

    def order(self, budget: EntryBudget) -> EliminationOrder:
        """Return the order in which to eliminate the free variables."""
        if budget.limit < 1:
            raise InvalidInputError(f"limit: {budget.limit}; expected at least 1 entry")
        return best_order([scope for scope, _ in self.tables], self.sizes, budget)


def _eliminated(
    graph: _ReducedGraph, order: EliminationOrder, *, maximise: bool, keep: bool
) -> tuple[list[Table], float]:
    """Return each variable's weights given those eliminated after it (none if not ``keep``), and ln of the total."""
    waiting = _tables_by_variable(graph, order)
    logarithms = list(graph.log_factors)
    conditionals: list[Table] = []
    for number, variable in enumerate(order.variables):
        factors = waiting[number] or [tables.log_table((number,), np.ones(graph.sizes[variable]))]
        waiting[number] = []
        product = tables.product(factors)
        unscaled = tables.message(product, maximise=maximise)
        message, log_divisor = tables.scaled(unscaled)
        if log_divisor == -math.inf:
            raise _impossible()
        logarithms.append(log_divisor)
        if keep:
            conditionals.append(tables.conditional(product, unscaled))
        if message.scope:
            waiting[message.scope[0]].append(message)
    return conditionals, math.fsum(logarithms)


def _tables_by_variable(graph: _ReducedGraph, order: EliminationOrder) -> list[list[Table]]:
    """Return the tables of the graph, each with the variable of its scope that is eliminated first."""
    number_of = {variable: number for number, variable in enumerate(order.variables)}
    waiting: list[list[Table]] = [[] for _ in order.variables]
    for scope, values in graph.tables:
        numbers = [number_of[variable] for variable in scope]
        ascending = tuple(sorted(numbers))
        table = tables.log_table(ascending, values.transpose([numbers.index(number) for number in ascending]))
        waiting[ascending[0]].append(table)
    return waiting


def _distributions(conditionals: Sequence[Table]) -> list[FloatArray]:
    """Return the distribution of each variable, from the last eliminated to the first and in ascending order."""
    joints: dict[int, Table] = {}
    distributions: list[FloatArray] = []
    for number, joint in reversed(list(enumerate(conditionals))):
        others = joint.scope[1:]
        if others:
            joint = tables.joint(joint, tables.marginal(joints[others[0]], others))
        joints[number] = joint
        weights = tables.marginal(joint, (number,)).values
        distributions.append(weights / weights.sum())
    return distributions[::-1]


def _impossible() -> ImpossibleEvidenceError:
    return ImpossibleEvidenceError(
        "model: every assignment that agrees with the evidence has weight zero; expected evidence that is possible"
    )
