"""The objects that matched, one by one, in compiled loops. This module loads Numba."""

from __future__ import annotations

import math

import numpy as np

from atg_fg.core.actions import AnyAction
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.compact.compact_memory import GraphArrays
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.engines.large_memory.decision import NextLooks
from atg_fg.inference.kernels import decision_kernels
from atg_fg.inference.kernels.compiled_filter import CompiledRows, LookedAt
from atg_fg.inference.kernels.memory_tables import ROOM, TrialArrays, tables_of
from atg_fg.inference.kernels.table_kernels import Tables


class MatchedRows(CompiledRows):
    """R hypotheses that are some of all.

    Args:
        assumptions: |G|, actions and alphabet.
        parameters: α, δ and whether to learn within the trial.
        graphs: The known aspects and transitions of each row.
        prior: Prior weight of each row, shape [R].
    """

    def __init__(
        self, assumptions: Assumptions, parameters: ModelParameters, graphs: GraphArrays, prior: FloatArray
    ) -> None:
        counts = np.stack((graphs.source, graphs.action, graphs.target, graphs.counts), axis=1).astype(np.int64)
        n_known, patterns, n_edges = (
            each.astype(np.int64) for each in (graphs.n_known, graphs.patterns, graphs.n_edges)
        )
        rows = n_known, patterns, n_edges, counts
        tables = tables_of(assumptions, rows, ROOM, float(parameters.transition_concentration))
        super().__init__(assumptions, parameters, TrialArrays(tables, np.zeros(tables.pattern.shape)), prior)
        #: ln of what all rows weigh; before the first look that is in ``log_identity``
        self._log_total = 0.0

    @property
    def log_weight(self) -> FloatArray:
        """Ln p(row, z_0:t), shape [R]."""
        weights: FloatArray = self.log_identity + self._log_total
        return weights

    @property
    def mass(self) -> FloatArray:
        """p(X_t | row), shape [R, W]."""
        return self.state()[1]

    def predict(self, action: AnyAction) -> None:
        """Take in an action that is sure, or that nothing happened."""
        self.act(action)

    def take_in(self, evidence: Evidence, seen: LookedAt) -> float:
        """Take in a look and learn from it; return ln p(one of the rows, z_0:t), or −∞ with nothing changed."""
        log_probability = self.look(evidence.likelihood, seen)
        if log_probability == -math.inf:
            return log_probability
        self._log_total += log_probability
        return self._log_total

    def rule_out(self) -> None:
        """Let all rows be impossible from here on."""
        self.log_identity[:], self.identity[:] = -np.inf, 0.0

    def absorb(self, other: MatchedRows) -> None:
        """Add the rows of a filter that has gone through the same trial."""
        width = max(self._aspects.shape[1], other._aspects.shape[1])
        log_total = float(np.logaddexp(self._log_total, other._log_total))
        pairs = []
        for each in (self, other):
            each.log_identity += each._log_total - log_total
            more = ((0, 0), (0, width - each._aspects.shape[1]))
            each._aspects = np.pad(each._aspects, more)
            pairs.append(each._tables._replace(pattern=np.pad(each._tables.pattern, more)))
        moved = pairs[1]._replace(begins=pairs[1].begins + len(pairs[0].counted))
        self._tables = Tables(*(np.concatenate(pair) for pair in zip(pairs[0], moved, strict=True)))
        self._arrays = tuple(self._tables)
        for name in ("_aspects", "log_identity", "_shown"):
            setattr(self, name, np.concatenate((getattr(self, name), getattr(other, name))))
        self._log_total = log_total
        self._shown_pattern = max(self._shown_pattern, other._shown_pattern)
        self.identity = np.exp(self.log_identity)

    def next_looks(self, weights: FloatArray) -> NextLooks:
        """Return what may be seen after each action, exactly.

        Args:
            weights: p(O | z_0:t) of each row, shape [R].
        """
        self._move()
        predictive, terms = np.empty((self._n_actions, self._n_patterns)), np.empty(self._n_actions)
        decision_kernels.next_looks(self._arrays, self._constants, self._aspects, weights, predictive, terms)
        return NextLooks(predictive, terms, 0.0)
