"""A policy that recognises an object and then drives it to a goal aspect (section 5 of the paper)."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Final, TypeAlias

import numpy as np

from atg_fg.engines.base import Inference
from atg_fg.errors import InvalidInputError, unknown_name
from atg_fg.goal_planning import COSTS, action_costs, goal_aspects
from atg_fg.goals import Goal
from atg_fg.model import COLLECTION
from atg_fg.patterns import FloatArray
from atg_fg.policies.base import Choice, Policy
from atg_fg.policies.exploration import best_by_expectation, costs_of_exploring, costs_per_state
from atg_fg.policies.recognition import EntropyPolicy
from atg_fg.value_iteration import action_values

#: What may be done about a goal that no known path leads to.
UNREACHABLE: Final = ("declare", "explore")

#: Entropy of O below which an object is recognised, nats: then, if the belief is right, about one in 750 is another.
SETTLED: Final = 0.01

#: Costs of reaching a goal by each first action, shape [A, H, W]: ∞ where none is known, nan where nobody looked.
Planner: TypeAlias = Callable[[Inference, Goal], FloatArray]


class ShortestPaths:
    """Costs of the shortest known paths to the goal (``atg_fg.goal_planning``).

    Args:
        cost: Name of what an edge costs.
    """

    def __init__(self, cost: str = "attempts") -> None:
        if cost not in COSTS:
            raise unknown_name("cost of a path", cost, COSTS)
        self.cost = cost

    def __call__(self, inference: Inference, goal: Goal) -> FloatArray:
        """Return the cost of each first action, shape [A, H, W]."""
        n_actions = inference.model.n_actions
        return costs_per_state(
            inference, lambda graph: action_costs(graph, goal_aspects(graph, goal), n_actions, self.cost)
        )


def value_iteration(inference: Inference, goal: Goal) -> FloatArray:
    """Return QMDP's values of each first action, shape [A, H, W]; never infinite, since it counts on the unknown."""
    return action_values(inference.model, goal)


#: Planners by name.
PLANNERS: Final[dict[str, Callable[[], Planner]]] = {
    "attempts": ShortestPaths,
    "surprise": lambda: ShortestPaths("surprise"),
    "value-iteration": lambda: value_iteration,
}


class GoalPolicy:
    """Recognises until the identity is settled, then goes the way of least expected cost, looking after each action.

    Nothing is kept from one look to the next but the inference's own belief: a slip is replanned from, and a belief
    that falls apart makes it recognise again. The policy ends the trial when the goal is shown, and when it cannot be
    reached.

    Args:
        goal: What the object is to show.
        planner: Name in ``PLANNERS``.
        unreachable: Whether a goal that no known path leads to ends the trial, or is looked for by trying what was
            never tried.
        settled: Entropy of O, with *unseen* as one state, below which the object is recognised, nats.
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
        settled: float = SETTLED,
        confidence: float = 0.95,
    ) -> None:
        if planner not in PLANNERS:
            raise unknown_name("planner", planner, PLANNERS)
        if unreachable not in UNREACHABLE:
            raise unknown_name("unreachable", unreachable, UNREACHABLE)
        if not settled > 0:
            raise InvalidInputError(f"settled: {settled!r}; expected an entropy above 0 nats")
        if not 0.5 < confidence < 1:
            raise InvalidInputError(f"confidence: {confidence!r}; expected a probability from above 0.5 to below 1")
        self.goal = goal
        self.unreachable = unreachable
        self.settled = settled
        self.confidence = confidence
        self._planner = PLANNERS[planner]()
        self._recognition: Policy = EntropyPolicy()

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the next action, or none with purpose ``reached`` or ``unreachable``."""
        belief = inference.aspect_belief
        if self.is_reached(inference):
            return Choice(None, None, "reached")
        if inference.identity().entropy_of_verdict > self.settled:
            return self._recognition.choose(inference, rng)._replace(purpose="recognise")
        costs = self._planner(inference, self.goal)
        if _share_with_a_path(belief, costs) > 0.5:
            return Choice(best_by_expectation(belief, costs, rng), None, "approach")
        if self.unreachable == "declare":
            return Choice(None, None, "unreachable")
        return Choice(best_by_expectation(belief, costs_of_exploring(inference), rng), None, "explore")

    def is_reached(self, inference: Inference) -> bool:
        """Whether the goal is shown now, with the confidence asked for."""
        return probability_shown(inference, self.goal) >= self.confidence


def probability_shown(inference: Inference, goal: Goal) -> float:
    """Return the probability that an inference, after a look, gives to the goal's being shown now."""
    model, belief = inference.model, inference.aspect_belief
    known = belief[(model.pattern_of >= 0) & goal.patterns[model.pattern_of]].sum()
    # In a collection node the pattern is one that the object was not known to show, as far as the evidence agrees.
    seen = inference.history.evidence[-1].likelihood
    agrees = (1 - model.parameters.observation_noise) * seen
    agrees = agrees + model.parameters.observation_noise * seen.mean()
    unknown = model.unknown @ agrees
    share = np.divide(model.unknown @ (agrees * goal.patterns), unknown, out=np.zeros_like(unknown), where=unknown > 0)
    return float(known + belief[:, COLLECTION] @ share)


def _share_with_a_path(belief: FloatArray, costs: FloatArray) -> float:
    """Return the share of the belief, where anybody looked, from which some action leads on to the goal."""
    looked = ~np.isnan(costs).any(axis=0)
    leads_on = looked & np.isfinite(costs).any(axis=0)
    total = float(belief[looked].sum())
    return float(belief[leads_on].sum()) / total if total > 0 else 0.0
