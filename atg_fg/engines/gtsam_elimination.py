"""The factor graph of ``atg_fg.recognition``, eliminated with GTSAM as the trial goes.

Given O = i the graph falls apart into one small chain an object, so X_t is eliminated from the factors of each object
alone, and the normaliser is what that object adds to the factor on O. For expected entropy (eq. 3) the factors of all
hypothetical actions and observations are added at once, as one factor on X_t and Z. States of X_t with the same row,
and states of Z with the same column, are one state each: aspects from which nothing was counted behave like the
collection node, and an object does not tell apart the patterns that it does not know.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from atg_fg import factors
from atg_fg.belief import IdentityBelief
from atg_fg.engines.base import FilterInference
from atg_fg.expected_entropy import NextPatternJoint, Targets, expected_entropies
from atg_fg.factors import HYPOTHETICAL_KEY, Factor
from atg_fg.memory import RobotMemory
from atg_fg.model import COLLECTION, RecognitionModel
from atg_fg.parameters import ModelParameters
from atg_fg.patterns import FloatArray
from atg_fg.recognition import RecognitionGraph

_NOW, _NEXT = factors.aspect_key(0), factors.aspect_key(1)


class GtsamElimination(FilterInference):
    """Exact elimination with GTSAM decision-tree factors."""

    name: ClassVar[str] = "gtsam"
    exact: ClassVar[bool] = True

    def __init__(self, memory: RobotMemory, parameters: ModelParameters, prior: IdentityBelief | None = None) -> None:
        super().__init__(memory, parameters, prior)
        self._hypothetical: tuple[Targets, list[Factor]] | None = None

    def graph(self) -> RecognitionGraph:
        """Return the whole factor graph of the trial so far, with O, X0 … Xt."""
        return RecognitionGraph(self.chain(), n_unseen=self.model.n_unseen)

    def _smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s, from the graph given O."""
        graph = RecognitionGraph(self.chain(hypothesis), n_unseen=1)
        return [graph.aspect_marginal(time)[0] for time in range(graph.last + 1)]

    def _propagate(self, aspects: FloatArray, action: int) -> FloatArray:
        """Multiply each object's belief by its transition factor and sum X_t out."""
        model = self.model
        transition = model.transition(action)
        apart: NDArray[np.bool_] = model.counted[action]
        eliminated = factors.ordering([_NOW])
        predicted = np.zeros_like(aspects)
        beliefs = lumped_beliefs(aspects, apart)
        for hypothesis, (n_states, belief) in enumerate(zip(self._n_states(), beliefs, strict=True)):
            rows = transition[hypothesis, [COLLECTION, *np.flatnonzero(apart[hypothesis])], :n_states]
            product = belief * factors.factor([_NOW, _NEXT], rows)
            predicted[hypothesis, :n_states] = factors.vector(product.sum(eliminated), n_states)
        return predicted

    def _correct(self, aspects: FloatArray, likelihood: FloatArray) -> FloatArray:
        """Multiply the prediction by the observation factor; (O, X_t) is one variable, since neither is summed out."""
        predicted = factors.factor([_NOW], aspects.ravel())
        observation = factors.factor([_NOW], likelihood.ravel())
        return factors.vector(predicted * observation, aspects.size).reshape(aspects.shape)

    def _n_states(self) -> list[int]:
        return [1 + int(n_known) for n_known in self.model.n_known]

    def _expected_entropies(self) -> FloatArray:
        """Return eq. 3, with p(O, z | a) read off the product of belief and hypothetical factors."""
        model, mass = self.model, self.aspect_belief
        if self._hypothetical is None or model.parameters.learn_in_trial:
            # Tables that do not change within the trial are made into factors once.
            self._hypothetical = hypothetical_factors(model)
        targets, hypotheticals = self._hypothetical
        eliminated = factors.ordering([_NOW])
        unknown = np.empty((model.n_actions, model.n_hypotheses))
        unreached = np.empty_like(unknown)
        reached: list[FloatArray] = []
        beliefs = lumped_beliefs(mass, np.any(model.counted, axis=0))
        for hypothesis, (belief, factor) in enumerate(zip(beliefs, hypotheticals, strict=True)):
            n_kinds = factor.cardinality(HYPOTHETICAL_KEY)
            joint = factors.vector((belief * factor).sum(eliminated), n_kinds)
            unknown[:, hypothesis], unreached[:, hypothesis] = joint[: 2 * model.n_actions].reshape(2, -1)
            reached.append(joint[2 * model.n_actions :])
        pattern_joint = NextPatternJoint(unknown, unreached, targets, np.concatenate(reached))
        return expected_entropies(model, pattern_joint, float(mass[-1].sum()))


def lumped_beliefs(mass: FloatArray, apart: NDArray[np.bool_]) -> list[Factor]:
    """Return each object's belief as a factor on X_t, with all states but those ``apart`` as one.

    Args:
        mass: Belief, shape [H, W].
        apart: Which states stay apart, shape [H, W]; never the collection node, which is the first of the others.
    """
    # A sum of the others, not a difference of sums: what is left may be tiny and must stay exact.
    others = np.where(apart, 0.0, mass).sum(axis=1)
    return [
        factors.factor([_NOW], np.append(rest, own[kept])) for rest, own, kept in zip(others, mass, apart, strict=True)
    ]


def hypothetical_factors(model: RecognitionModel) -> tuple[Targets, list[Factor]]:
    """Return the targets of counted edges, by hypothesis, and the factor p(z | x, a) of each hypothesis.

    It is for all hypothetical actions and observations at once. The states of X_t are all aspects without counted edges
    together, then each of the others. The states of Z are, for each action, one of the unknown patterns and one of
    the known unreached ones, then that of each target.
    """
    edges, n_actions = model.edges, model.n_actions
    leads_to = np.zeros((model.n_hypotheses, n_actions, model.n_states), dtype=bool)
    leads_to[edges.hypothesis, edges.action, edges.target] = True
    hypothesis_of, action_of, state_of = np.nonzero(leads_to)
    target_number = np.cumsum(leads_to).reshape(leads_to.shape) - 1
    first_target = np.searchsorted(hypothesis_of, np.arange(model.n_hypotheses + 1))
    by_hypothesis = np.argsort(edges.hypothesis, kind="stable")
    first_edge = np.searchsorted(edges.hypothesis[by_hypothesis], np.arange(model.n_hypotheses + 1))

    observed = 1.0 - model.parameters.observation_noise
    noise = model.parameters.observation_noise / model.n_patterns
    unknown = model.stay * (model.base[:, COLLECTION] * model.unknown_rate)[:, None] + noise
    unreached = model.stay * (observed / model.n_aspects) + noise
    hypotheticals = []
    for hypothesis in range(model.n_hypotheses):
        sources = np.flatnonzero(model.counted[:, hypothesis].any(axis=0))
        rows = np.concatenate(([COLLECTION], sources))
        own = slice(first_target[hypothesis], first_target[hypothesis + 1])
        reached = unreached[:, hypothesis, rows][action_of[own]]
        own_edges = by_hypothesis[first_edge[hypothesis] : first_edge[hypothesis + 1]]
        source, target = edges.source[own_edges], edges.target[own_edges]
        column = target_number[hypothesis, edges.action[own_edges], target] - first_target[hypothesis]
        row = np.searchsorted(rows, source)
        np.add.at(reached, (column, row), observed * model.edge_probability[own_edges])
        table = np.concatenate((unknown[:, hypothesis, rows], unreached[:, hypothesis, rows], reached)).T
        hypotheticals.append(factors.factor([_NOW, HYPOTHETICAL_KEY], table))
    return Targets(action_of, hypothesis_of, state_of), hypotheticals
