"""The factor graph of ``atg_fg.inference.factor_graph``, eliminated with GTSAM as the trial goes.

The belief p(O, X_t | z_0:t) is carried forward: an action adds a factor p(X_{t+1} | X_t, a, O), and X_t is eliminated.
For expected entropy (eq. 3) the factors of all hypothetical actions and observations are added at once. The
hypothetical observation is a pattern *relative to the object*, since an object does not tell apart the patterns that it
does not know, nor the known ones that no edge leads to.

X_t is eliminated from all objects and actions at once. Given O = i and an action, what comes next depends on X_t in few
ways. So all things that may come next, of any object by any action, are the states of one variable: the *cells*. X_t is
eliminated from two factors on X_t and cell,

    p(cell) = Σ_x belief(x, cell) · weight(x, cell)

in which states of X_t with the same weights are one state, numbered anew for each object and action. Which these are
follows from the form of a transition row, ``prior_weight · base_row`` plus a few counted edges (see
``atg_fg.inference.recognition_model``). As far as the base goes, they are the aspects from which the action was counted
as often (``RowKinds``). As far as edges go, they are the sources of the edges into a cell (``EdgesInto``). What is left
of X_t by both is added up.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from atg_fg.core.errors import ImpossibleEvidenceError
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.engines.bayes_filter import FilterInference
from atg_fg.inference import gtsam_factors as factors
from atg_fg.inference.expected_entropy import NextPatternJoint, expected_entropies
from atg_fg.inference.factor_graph import RecognitionGraph
from atg_fg.inference.gtsam_factors import HYPOTHETICAL_KEY, Factor
from atg_fg.inference.interface import TrialSetup
from atg_fg.inference.recognition_model import RecognitionModel

_NOW, _CELL = factors.aspect_key(0), HYPOTHETICAL_KEY


class CellFactor:
    """weight(x, cell) as a factor, from whose product with a belief X_t is eliminated.

    Args:
        weights: Shape [S, C], for S states of X_t and C cells, neither of them none.
    """

    def __init__(self, weights: FloatArray) -> None:
        self._n_cells = weights.shape[1]
        self._factor = belief_factor(weights)

    def without_aspect(self, belief: Factor) -> FloatArray:
        """Return p(cell), shape [C]: the product with a belief, with X_t summed out."""
        return factors.vector((belief * self._factor).sum(factors.ordering([_NOW])), self._n_cells)


def belief_factor(belief: FloatArray) -> Factor:
    """Return belief(x, cell), shape [S, C], as a factor."""
    return factors.factor([_NOW, _CELL], belief)


class RowKinds:
    """The states of X_t as far as a row is its base: one for each value of ``prior_weight`` in (action, object).

    Args:
        prior_weight: Share of the base in each row, shape [A, H, W].

    Attributes:
        prior_weight: The same of each state, shape [S, A · H]; zero where an action and object has fewer.
    """

    def __init__(self, prior_weight: FloatArray) -> None:
        ascending = np.argsort(prior_weight, axis=-1)
        found = np.take_along_axis(prior_weight, ascending, axis=-1)
        ranks = np.zeros(prior_weight.shape, dtype=np.int64)
        np.cumsum(found[..., 1:] != found[..., :-1], axis=-1, out=ranks[..., 1:])
        states = np.empty_like(ranks)
        np.put_along_axis(states, ascending, ranks, axis=-1)
        n_cells = prior_weight.shape[0] * prior_weight.shape[1]
        self._places = states * n_cells + np.arange(n_cells).reshape(*prior_weight.shape[:2], 1)
        self.prior_weight = np.zeros((int(states.max()) + 1, n_cells))
        self.prior_weight.ravel()[self._places] = prior_weight

    def belief(self, mass: FloatArray) -> Factor:
        """Return the belief ``mass`` [H, W] over these states in each cell (action, object), as a factor."""
        everywhere = np.broadcast_to(mass, self._places.shape)
        # Sums, not differences of sums: what is left may be tiny and must prior_weight exact.
        lumped = np.bincount(self._places.ravel(), weights=everywhere.ravel(), minlength=self.prior_weight.size)
        return belief_factor(lumped.reshape(self.prior_weight.shape).astype(np.float64))


class EdgesInto:
    """p(cell) = Σ_x belief(x) · weight(x, cell) over the edges into each cell, where x is the source of an edge.

    Where one edge leads to a cell there is one such x, and nothing to sum out.

    Args:
        cells: The cell that each edge leads to, shape [E].
        n_cells: C.
        weights: Of each edge, shape [E].
    """

    def __init__(self, cells: IntArray, n_cells: int, weights: FloatArray) -> None:
        shared = np.bincount(cells, minlength=n_cells) > 1
        several = shared[cells]
        self._alone, self._together = np.flatnonzero(~several), np.flatnonzero(several)
        self._cells, self._n_cells, self._weights = cells, n_cells, weights
        self._shared = np.flatnonzero(shared)
        number = (np.cumsum(shared) - 1)[cells[self._together]]
        order = np.argsort(number, kind="stable")
        states = np.empty_like(number)
        states[order] = np.arange(len(number)) - np.searchsorted(number[order], number[order])
        self._places = states * len(self._shared) + number
        self._shape = (1 + int(states.max(initial=0)), len(self._shared))
        self._factor = CellFactor(self.table(weights)) if len(self._shared) else None

    def table(self, values: FloatArray) -> FloatArray:
        """Return values of edges, shape [E], by state and cell, shape [S, C'], of cells that several lead to."""
        table = np.zeros(self._shape)
        table.ravel()[self._places] = values[self._together]
        return table

    def arrivals(self, belief: FloatArray) -> FloatArray:
        """Return p(cell), shape [C], from the belief in the source of each edge, shape [E]."""
        arrived = np.zeros(self._n_cells)
        arrived[self._cells[self._alone]] = (belief * self._weights)[self._alone]
        if self._factor is not None:
            arrived[self._shared] = self._factor.without_aspect(belief_factor(self.table(belief)))
        return arrived


_STATE = factors.aspect_key(0)


class GtsamElimination(FilterInference):
    """Exact elimination with GTSAM decision-tree factors."""

    name: ClassVar[str] = "gtsam"
    exact: ClassVar[bool] = True

    def __init__(self, setup: TrialSetup) -> None:
        super().__init__(setup)
        self._transitions: dict[int, TransitionFactors] = {}
        self._hypothetical: HypotheticalFactors | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**vars(self), "_transitions": {}, "_hypothetical": None}  # GTSAM's factors cannot be pickled

    def graph(self) -> RecognitionGraph:
        """Return the whole factor graph of the trial so far, with O, X0 … Xt."""
        return RecognitionGraph(self.chain(), n_unseen=self.model.n_unseen)

    def compute_smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s, from the graph given O."""
        graph = RecognitionGraph(self.chain(hypothesis), n_unseen=1)
        try:
            return [graph.aspect_marginal(time)[0] for time in range(graph.last + 1)]
        except ImpossibleEvidenceError:
            return [np.zeros(width) for width in graph.chain.widths]

    # Tables that do not change within the trial are made into factors once.

    def propagate(self, aspects: FloatArray, action: int) -> FloatArray:
        """Multiply the belief by the transition factor and sum X_t out."""
        if action not in self._transitions or self.parameters.learn_in_trial:
            self._transitions[action] = TransitionFactors(self.model, action)
        return self._transitions[action].next_aspects(aspects)

    def correct(self, aspects: FloatArray, likelihood: FloatArray) -> FloatArray:
        """Multiply the prediction by the observation factor; (O, X_t) is one variable, since neither is summed out."""
        states = self.model.states
        predicted = factors.factor([_STATE], aspects.ravel()[states])
        observation = factors.factor([_STATE], likelihood.ravel()[states])
        joint = np.zeros(aspects.shape)
        joint.ravel()[states] = factors.vector(predicted * observation, len(states))
        return joint

    def compute_expected_entropies(self) -> FloatArray:
        """Return eq. 3, with p(O, z | a) as it is left by eliminating X_t."""
        if self._hypothetical is None or self.parameters.learn_in_trial:
            self._hypothetical = HypotheticalFactors(self.model)
        mass = self.aspect_belief
        return expected_entropies(self.model, self._hypothetical.next_patterns(mass), float(mass[-1].sum()))


class TransitionFactors:
    """The factors p(X_{t+1} | X_t, a, O) of an action; cells are the states of O and X_{t+1}.

    Args:
        model: The tables in force.
        action: Index of the action.
    """

    def __init__(self, model: RecognitionModel, action: int) -> None:
        chosen = model.edges.of_action(action)
        edges = model.edges.chosen(chosen)
        self._rows = RowKinds(model.prior_weight[[action]])
        self._base = CellFactor(self._rows.prior_weight)
        self._base_row = model.base_row
        cells = edges.hypothesis * model.n_states + edges.target
        self._edges = EdgesInto(cells, model.base_row.size, model.edge_probability[chosen])
        self._sources = model.edge_source[chosen]

    def next_aspects(self, mass: FloatArray) -> FloatArray:
        """Return Σ_x mass(i, x) p(x' | x, a, i), shape [H, W], from ``mass`` [H, W]."""
        kept = self._base.without_aspect(self._rows.belief(mass))
        arrived = self._edges.arrivals(mass.ravel()[self._sources]).reshape(mass.shape)
        predicted: FloatArray = kept[:, None] * self._base_row + arrived
        return predicted


class HypotheticalFactors:
    """The factors p(z | X_t, a, O) of all actions and patterns; cells are actions, objects and relative patterns.

    Args:
        model: The tables in force.
    """

    def __init__(self, model: RecognitionModel) -> None:
        self._model = model
        self._rows = RowKinds(model.prior_weight)
        self._base = CellFactor(self._rows.prior_weight)
        self._edges = EdgesInto(model.edge_target, len(model.targets.row), model.edge_probability)

    def next_patterns(self, mass: FloatArray) -> NextPatternJoint:
        """Return p(O, z | a) for each kind of pattern from p(O, X_t), shape [H, W]."""
        model = self._model
        kept = self._base.without_aspect(self._rows.belief(mass)).reshape(model.n_actions, model.n_hypotheses)
        arrived = self._edges.arrivals(mass.ravel()[model.edge_source])
        return NextPatternJoint.of(model, mass.sum(axis=1), kept, arrived)
