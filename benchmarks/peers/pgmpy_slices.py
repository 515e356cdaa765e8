"""Two time slices in pgmpy, answered by ``VariableElimination``."""

from __future__ import annotations

from typing import Any

import numpy as np
from pgmpy.factors.discrete import TabularCPD
from pgmpy.inference import VariableElimination
from pgmpy.models import DiscreteBayesianNetwork

from atg_fg.core.patterns import FloatArray
from benchmarks.dense_tables import DenseModel
from benchmarks.peers.slices import ARCS, SlicesContestant


class PgmpySlices(SlicesContestant):
    """Joint queries, which pgmpy contracts as one sum of products in a greedy order.

    Its ``DBNInference`` answers marginals, not the joint that eq. 3 is taken from.
    """

    name = "pgmpy"
    remark = "VariableElimination, greedy order, on two time slices"

    def __init__(self, model: DenseModel) -> None:
        super().__init__(model)
        uniform = np.full(model.n_actions, 1.0 / model.n_actions)
        self._net = DiscreteBayesianNetwork(ARCS)
        self._net.add_cpds(
            _table_of("O", model.prior),
            _table_of("X0", model.initial, "O"),
            _table_of("A", uniform),
            _table_of("X1", model.transition, "A", "O", "X0"),
            _table_of("Z", model.observation, "O", "X1"),
        )
        self._inference = VariableElimination(self._net)

    def _set_belief(self) -> None:
        identity, aspects = self._split_belief()
        self._net.get_cpds("O").values[:] = identity
        self._net.get_cpds("X0").values[:] = aspects.T
        self._inference = VariableElimination(self._net)

    def _next_belief(self, action: int, pattern: int) -> FloatArray:
        return self._query(["O", "X1"], {"A": action, "Z": pattern})

    def _next_patterns(self) -> FloatArray:
        return self._query(["A", "O", "Z"], {})

    def _query(self, names: list[str], evidence: dict[str, int]) -> FloatArray:
        answer: Any = self._inference.query(names, evidence=evidence, show_progress=False)
        table: FloatArray = answer.values.transpose([answer.variables.index(name) for name in names])
        return table


def _table_of(child: str, table: FloatArray, *parents: str) -> Any:
    """Return p(child | parents) from a table whose last axis is the child."""
    values = np.moveaxis(table, -1, 0).reshape(table.shape[-1], -1)
    return TabularCPD(child, table.shape[-1], values, list(parents) or None, list(table.shape[:-1]) or None)
