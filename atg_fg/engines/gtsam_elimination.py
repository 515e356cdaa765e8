"""The factor graph of ``atg_fg.recognition``, eliminated with GTSAM as the trial goes.

Given O = i the graph falls apart into one small chain an object, so X_t is eliminated from the factors of each object
alone; the normaliser is what that object adds to the factor on O. For expected entropy the factors of the hypothetical
actions and observations are added: they are one factor on X_t and Z, where Z runs over actions and the patterns
that this object tells apart: each that it knows, and all others together.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from atg_fg import factors
from atg_fg.belief import x_log_x
from atg_fg.engines.base import FilterInference
from atg_fg.factors import HYPOTHETICAL_KEY, Factor
from atg_fg.memory import RobotMemory
from atg_fg.model import COLLECTION, Revelation
from atg_fg.parameters import ModelParameters
from atg_fg.patterns import FloatArray
from atg_fg.recognition import RecognitionGraph

_NOW, _NEXT = factors.aspect_key(0), factors.aspect_key(1)


class GtsamElimination(FilterInference):
    """Exact elimination with GTSAM decision-tree factors."""

    name: ClassVar[str] = "gtsam"
    exact: ClassVar[bool] = True

    def __init__(self, memory: RobotMemory, parameters: ModelParameters) -> None:
        super().__init__(memory, parameters)
        self._hypothetical: list[Factor] | None = None

    def graph(self) -> RecognitionGraph:
        """Return the whole factor graph of the trial so far, with O, X0 … Xt."""
        return RecognitionGraph(self.chain(), n_unseen=self.model.n_unseen)

    def smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s, from the graph given O."""
        graph = RecognitionGraph(self.chain(hypothesis), n_unseen=1)
        return [graph.aspect_marginal(time)[0] for time in range(graph.last + 1)]

    def _propagate(self, aspects: FloatArray, action: int) -> FloatArray:
        """Multiply each object's belief by its transition factor and sum X_t out."""
        transition = self.model.transition(action)
        eliminated = factors.ordering([_NOW])
        predicted = np.zeros_like(aspects)
        for hypothesis, n_states in enumerate(self._n_states()):
            belief = factors.factor([_NOW], aspects[hypothesis, :n_states])
            table = transition[hypothesis, :n_states, :n_states]
            product = belief * factors.factor([_NOW, _NEXT], table)
            predicted[hypothesis, :n_states] = factors.vector(product.sum(eliminated), n_states)
        return predicted

    def _correct(self, aspects: FloatArray, likelihood: FloatArray) -> FloatArray:
        """Multiply each object's prediction by its observation factor."""
        joint = np.zeros_like(aspects)
        for hypothesis, n_states in enumerate(self._n_states()):
            predicted = factors.factor([_NOW], aspects[hypothesis, :n_states])
            observation = factors.factor([_NOW], likelihood[hypothesis, :n_states])
            joint[hypothesis, :n_states] = factors.vector(predicted * observation, n_states)
        return joint

    def _n_states(self) -> list[int]:
        return [1 + int(n_known) for n_known in self.model.n_known]

    def _expected_entropies(self) -> FloatArray:
        """Return eq. 3 from p(O, z | a), which is read off the product of belief and hypothetical factors."""
        joint = self._next_pattern_joint()
        predictive = joint.sum(axis=1)
        unseen = joint[:, -1].sum(axis=1)
        entropies: FloatArray = (
            x_log_x(predictive).sum(axis=1) - x_log_x(joint).sum(axis=(1, 2)) + unseen * np.log(self.model.n_unseen)
        )
        return np.maximum(entropies, 0.0)

    def _next_pattern_joint(self) -> FloatArray:
        """p(O, z_{t+1} | a, z_0:t) of every action, shape [A, H, |𝒵|]."""
        model, mass = self.model, self.aspect_belief
        if self._hypothetical is None or model.parameters.learn_in_trial:
            # Tables that do not change within the trial are made into factors once.
            self._hypothetical = self.hypothetical_factors()
        eliminated = factors.ordering([_NOW])
        joint = np.empty((model.n_actions, model.n_hypotheses, model.n_patterns))
        for hypothesis, (n_states, hypothetical) in enumerate(zip(self._n_states(), self._hypothetical, strict=True)):
            belief = factors.factor([_NOW], mass[hypothesis, :n_states])
            product = (belief * hypothetical).sum(eliminated)
            by_class = factors.vector(product, model.n_actions * n_states).reshape(model.n_actions, n_states)
            by_class[:, COLLECTION] /= max(model.n_patterns - n_states + 1, 1)
            joint[:, hypothesis] = by_class[:, model.aspect_of[hypothesis]]
        return joint

    def hypothetical_factors(self) -> list[Factor]:
        """Return for each object the factor p(z | x, a) of all hypothetical actions and observations.

        It is the product of a transition and an observation factor with X_{t+1} eliminated, on X_t and Z. The states of
        Z are (action, pattern class): class 0 for all patterns the object does not know, class 1 + k for that of aspect k.
        """
        model = self.model
        delta = model.parameters.observation_noise / model.n_patterns
        transitions = [model.transition(action) for action in range(model.n_actions)]
        hypothetical = []
        for hypothesis, n_states in enumerate(self._n_states()):
            arriving = np.stack([table[hypothesis, :n_states, :n_states] for table in transitions], axis=1)
            shown = (1.0 - model.parameters.observation_noise) * arriving + delta
            n_unknown = model.n_patterns - (n_states - 1)
            shown[..., COLLECTION] += delta * (n_unknown - 1)
            table = shown.reshape(n_states, model.n_actions * n_states)
            hypothetical.append(factors.factor([_NOW, HYPOTHETICAL_KEY], table))
        return hypothetical

