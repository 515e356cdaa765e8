"""A policy that recognises an object and then drives it to a goal aspect (section 5 of the paper)."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Final, TypeAlias

import numpy as np

from atg_fg.core.checks import instance, number
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.goals import Goal
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.belief_components import LEAST_PROBABILITY
from atg_fg.inference.interface import Inference
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel
from atg_fg.policies.base import Choice
from atg_fg.policies.expected_costs import ExpectedCosts, best_by_expectation, by_component, share_with_a_path
from atg_fg.policies.exploration import exploration_costs_of
from atg_fg.policies.information_gain import EntropyPolicy
from atg_fg.policies.shortest_paths import COSTS, action_costs, goal_aspects
from atg_fg.policies.stopping import check_entropy_threshold

#: Costs above this many actions are not told apart.
HORIZON: Final = 500
_TOLERANCE: Final = 1e-9


def action_values(model: RecognitionModel, goal: Goal, horizon: int = HORIZON) -> FloatArray:
    """Return the expected number of actions to the goal by each first action, if the state is known from then on.

    That is Q(a, i, x) = 1 + Σ_y p(y | x, a, i) V_i(y) with V = 0 where the goal is shown and min_a Q elsewhere, up to
    ``horizon``, shape [A, H, W].

    These are QMDP's values, the exact reference for small models. Unlike a shortest path they count on the unknown,
    too: an action never tried may lead to the goal, and so may whatever is in the collection node.

    Args:
        model: The tables in force.
        goal: What is to be shown.
        horizon: Iterations at most; a state from which the goal is farther costs this much.
    """
    ahead = _probability_ahead(model, goal)
    values = np.zeros(model.base_row.shape)
    for _ in range(horizon):
        costs = 1.0 + _expected(model, values)
        updated = ahead * costs.min(axis=0)
        converged = np.abs(updated - values).max() < _TOLERANCE
        values = updated
        if converged:
            break
    return 1.0 + _expected(model, values)


def _expected(model: RecognitionModel, values: FloatArray) -> FloatArray:
    """Return Σ_y p(y | x, a, i) V_i(y), shape [A, H, W]."""
    edges = model.edges
    expected: FloatArray = model.prior_weight * (model.base_row * values).sum(axis=1)[None, :, None]
    gained = model.edge_probability * values[edges.hypothesis, edges.target]
    np.add.at(expected, (edges.action, edges.hypothesis, edges.source), gained)
    return expected


def _probability_ahead(model: RecognitionModel, goal: Goal) -> FloatArray:
    """Return the probability that the goal is not shown yet in each state, shape [H, W]."""
    shown = np.where(model.pattern_of >= 0, goal.patterns[model.pattern_of], False)
    ahead = np.where(shown, 0.0, 1.0)
    n_unknown = np.maximum(model.n_patterns - model.n_known, 1)
    ahead[:, COLLECTION] = 1.0 - (model.lacks @ goal.patterns) / n_unknown
    return ahead


#: What may be done about a goal that no known path leads to.
UNREACHABLE: Final = ("declare", "explore")

#: Entropy of O below which an object is recognised, nats: then, if the belief is right, about one in 750 is another.
ENTROPY_THRESHOLD: Final = 0.01

#: Where no action is expected to lower the entropy of identity by this much, nats, there is nothing to recognise by.
LEAST_GAIN: Final = 1e-4

#: Returns the costs of reaching a goal by each first action, in each component of the belief.
Planner: TypeAlias = Callable[[Inference, Goal], list[ExpectedCosts]]


class ShortestPaths:
    """Costs of the shortest known paths to the goal (``atg_fg.policies.shortest_paths``).

    Args:
        cost: Name of what an edge costs.
    """

    def __init__(self, cost: str = "attempts") -> None:
        if cost not in COSTS:
            raise unknown_name("cost of a path", cost, COSTS)
        self.cost = cost

    def __call__(self, inference: Inference, goal: Goal) -> list[ExpectedCosts]:
        """Return the costs in each component of the belief."""
        n_actions = inference.model.n_actions
        return by_component(
            inference, lambda graph: action_costs(graph, goal_aspects(graph, goal), n_actions, self.cost)
        )


def value_iteration(inference: Inference, goal: Goal) -> list[ExpectedCosts]:
    """Return QMDP's values; none is infinite, since it counts on the unknown. It knows plain ATGs only."""
    values, belief = action_values(inference.model, goal), inference.aspect_belief
    probabilities = belief.sum(axis=1)
    return [
        ExpectedCosts(
            float(probabilities[hypothesis]),
            dict(enumerate((belief[hypothesis] / probabilities[hypothesis]).tolist())),
            dict(enumerate(values[:, hypothesis].T)),
        )
        for hypothesis in np.flatnonzero(probabilities >= LEAST_PROBABILITY)
    ]


#: Planners by name.
PLANNERS: Final[dict[str, Callable[[], Planner]]] = {
    "attempts": ShortestPaths,
    "surprise": lambda: ShortestPaths("surprise"),
    "value-iteration": lambda: value_iteration,
}


class GoalPolicy:
    """Recognises until the identity is settled, then takes the action of least expected cost after each look.

    The policy keeps nothing from one look to the next but the belief of the inference. So it plans anew after a slip,
    and it recognises again when the belief becomes uncertain. The policy ends the trial when the goal is shown, and
    when it cannot be reached.

    Args:
        goal: What the object is to show.
        planner: Name in ``PLANNERS``.
        unreachable: Whether a goal that no known path leads to ends the trial, or is looked for by trying what was
            never tried.
        entropy_threshold: Entropy of O, with *unseen* as one state, below which the object is recognised, nats.
        confidence: Probability with which the goal must be shown for the trial to end.

    Raises:
        InvalidInputError: No such planner, or a value out of its range.
    """

    name: ClassVar[str] = "goal"

    def __init__(
        self,
        goal: Goal,
        planner: str = "attempts",
        unreachable: str = "declare",
        entropy_threshold: float = ENTROPY_THRESHOLD,
        confidence: float = 0.95,
    ) -> None:
        if not isinstance(planner, str) or planner not in PLANNERS:
            raise unknown_name("planner", planner, PLANNERS)
        if not isinstance(unreachable, str) or unreachable not in UNREACHABLE:
            raise unknown_name("unreachable", unreachable, UNREACHABLE)
        if not number(confidence, "confidence", below=1) > 0.5:
            raise InvalidInputError(f"confidence: {confidence!r}; expected a probability from above 0.5 to below 1")
        self.goal = instance(goal, "goal", Goal)
        self.unreachable = unreachable
        self.entropy_threshold = check_entropy_threshold(entropy_threshold, "entropy_threshold")
        self.confidence = confidence
        self._planner = PLANNERS[planner]()
        self._recognition = EntropyPolicy()

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the next action, or none with purpose ``reached`` or ``unreachable``."""
        if self.is_reached(inference):
            return Choice(None, None, "reached")
        if inference.identity().entropy_of_verdict > self.entropy_threshold:
            informative = self._recognition.choose(inference, rng)
            if expected_gain(inference, informative) > LEAST_GAIN:
                return informative._replace(purpose="recognise")
        n_actions = inference.model.n_actions
        components = self._planner(inference, self.goal)
        if share_with_a_path(components) > 0.5:
            return Choice(best_by_expectation(components, n_actions, rng), None, "approach")
        if self.unreachable == "declare":
            return Choice(None, None, "unreachable")
        return Choice(best_by_expectation(exploration_costs_of(inference), n_actions, rng), None, "explore")

    def is_reached(self, inference: Inference) -> bool:
        """Whether the goal is shown now, with the confidence asked for."""
        return float(inference.shown_patterns()[self.goal.patterns].sum()) >= self.confidence


def expected_gain(inference: Inference, choice: Choice) -> float:
    """Return by how many nats the most informative action is expected to lower the entropy of identity."""
    if choice.expected_entropies is None:
        return np.inf
    return float(inference.identity().entropy - choice.expected_entropies.min())
