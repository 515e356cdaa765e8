"""Two time slices in pyAgrum, answered by ``LazyPropagation``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyagrum

from atg_fg.core.patterns import FloatArray
from benchmarks.dense_tables import DenseModel
from benchmarks.peers.slices import ARCS, SlicesContestant


class PyAgrumSlices(SlicesContestant):
    """Joint posteriors from a junction tree.

    Its inference hears of new evidence, not of new tables. So the query after a look, whose evidence is new, goes on
    with the same object; that of a decision is made anew.
    """

    name = "pyAgrum"
    remark = "LazyPropagation, joint targets, on two time slices"

    def __init__(self, model: DenseModel) -> None:
        super().__init__(model)
        n_hypotheses, n_states, n_patterns = model.observation.shape
        sizes = {"O": n_hypotheses, "X0": n_states, "A": model.n_actions, "X1": n_states, "Z": n_patterns}
        self._net: Any = pyagrum.BayesNet()
        for name, size in sizes.items():
            self._net.add(pyagrum.RangeVariable(name, "", 0, size - 1))
        for parent, child in ARCS:
            self._net.addArc(parent, child)
        self._set_table("A", np.full(model.n_actions, 1.0 / model.n_actions), "A")
        self._set_table("X1", model.transition, "A", "O", "X0", "X1")
        self._set_table("Z", model.observation, "O", "X1", "Z")
        self._set_belief()
        self._filter = self._inference("O", "X1")

    def _inference(self, *targets: str) -> Any:
        inference = pyagrum.LazyPropagation(self._net)
        inference.addJointTarget(set(targets))
        return inference

    def _set_table(self, child: str, table: FloatArray, *names: str) -> None:
        # pyAgrum's own order of the axes follows from the order in which arcs were added.
        own = list(reversed(self._net.cpt(child).names))
        self._net.cpt(child)[:] = np.ascontiguousarray(table.transpose([names.index(name) for name in own]))

    def _set_belief(self) -> None:
        identity, aspects = self._split_belief()
        self._set_table("O", identity, "O")
        self._set_table("X0", aspects, "O", "X0")

    def _next_belief(self, action: int, pattern: int) -> FloatArray:
        self._filter.setEvidence({"A": action, "Z": pattern})
        return _table(self._filter.jointPosterior({"O", "X1"}), ("O", "X1"))

    def _next_patterns(self) -> FloatArray:
        return _table(self._inference("A", "O", "Z").jointPosterior({"A", "O", "Z"}), ("A", "O", "Z"))


def _table(tensor: Any, names: Sequence[str]) -> FloatArray:
    own = list(reversed(tensor.names))
    table: FloatArray = tensor.toarray().transpose([own.index(name) for name in names])
    return table
