"""The factor graph of ``atg_fg.inference.factor_graph``, eliminated with GTSAM as the trial goes.

The belief p(O, X_t | z_0:t) is carried forward: an action adds a factor p(X_{t+1} | X_t, a, O), and X_t is eliminated.
For expected entropy (eq. 3) the factors of all hypothetical actions and observations are added at once. The
hypothetical observation is a pattern *relative to the object*, since an object does not tell apart the patterns that it
does not know, nor the known ones that no edge leads to. ``atg_fg.engines.gtsam_cells`` says how X_t is eliminated.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from atg_fg.core.errors import ImpossibleEvidenceError
from atg_fg.core.patterns import FloatArray
from atg_fg.engines.filtering import FilterInference
from atg_fg.engines.gtsam_cells import CellFactor, EdgesInto, RowKinds
from atg_fg.inference import gtsam_factors as factors
from atg_fg.inference.expected_entropy import NextPatternJoint, expected_entropies
from atg_fg.inference.factor_graph import RecognitionGraph
from atg_fg.inference.interface import TrialSetup
from atg_fg.inference.recognition_model import RecognitionModel

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
