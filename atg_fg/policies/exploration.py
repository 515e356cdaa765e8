"""A policy that tries what was never tried."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Final

import numpy as np

from atg_fg.engines.base import Inference
from atg_fg.goal_planning import TransitionGraph, exploration_costs
from atg_fg.model import COLLECTION
from atg_fg.patterns import FloatArray
from atg_fg.policies.base import Choice, one_of_the_best

#: What an action costs of which no known path leads on; in expectations it must not drown what is probable.
_NO_PATH_COST: Final = 24.0
#: Objects less probable than this do not sway a plan.
_LEAST_PROBABILITY: Final = 1e-3


class ExplorationPolicy:
    """Tries what was never tried: goes to the nearest aspect with such an action, on what is believed of the object."""

    name: ClassVar[str] = "explore"

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the first action on the way to something new."""
        return Choice(best_by_expectation(inference.aspect_belief, costs_of_exploring(inference), rng), None)


def costs_of_exploring(inference: Inference) -> FloatArray:
    """Return what it costs to try something new by each first action, shape [A, H, W].

    Of a collection node nothing is known, so any action there is new.
    """
    n_actions = inference.model.n_actions
    costs = costs_per_state(inference, lambda graph: exploration_costs(graph, n_actions, "attempts"))
    costs[:, :, COLLECTION] = 1.0
    return costs


def costs_per_state(inference: Inference, costs_of: Callable[[TransitionGraph], dict[int, FloatArray]]) -> FloatArray:
    """Return the costs of each first action, shape [A, H, W]: ∞ where no path is known, nan for improbable objects.

    Args:
        inference: At a look.
        costs_of: Returns the costs of each action, shape [A], for each state of a transition graph.
    """
    identity = inference.identity()
    probabilities = np.append(identity.objects, identity.unseen)
    costs = np.full((inference.model.n_actions, *inference.aspect_belief.shape), np.nan)
    for hypothesis in np.flatnonzero(probabilities >= _LEAST_PROBABILITY):
        costs[:, hypothesis] = np.inf
        for state, by_action in costs_of(inference.transition_graph(int(hypothesis))).items():
            costs[:, hypothesis, state] = by_action
    return costs


def best_by_expectation(belief: FloatArray, costs: FloatArray, rng: np.random.Generator) -> int:
    """Return an action of least expected cost.

    Args:
        belief: p(O, X_t | z_0:t), shape [H, W].
        costs: Of each first action, shape [A, H, W], as ``costs_per_state`` returns them.
        rng: Breaks ties.
    """
    bounded = np.minimum(np.nan_to_num(costs, nan=0.0, posinf=_NO_PATH_COST), _NO_PATH_COST)
    return one_of_the_best((belief * bounded).sum(axis=(1, 2)), rng)
