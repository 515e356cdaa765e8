"""A policy that tries what was never tried."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from atg_fg.inference.interface import Inference
from atg_fg.policies.base import Choice
from atg_fg.policies.expected_costs import ExpectedCosts, best_by_expectation, by_component
from atg_fg.policies.shortest_paths import exploration_costs


class ExplorationPolicy:
    """Goes to the nearest known aspect with an action that was never tried there, and tries it."""

    name: ClassVar[str] = "explore"

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the first action on the way to something new."""
        return Choice(best_by_expectation(exploration_costs_of(inference), inference.model.n_actions, rng), None)


def exploration_costs_of(inference: Inference) -> list[ExpectedCosts]:
    """Return what it costs, in each component of the belief, to try something new by each first action."""
    n_actions = inference.model.n_actions
    return by_component(inference, lambda graph: exploration_costs(graph, n_actions, "attempts"))
