"""A policy that tries what was never tried."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from atg_fg.inference.interface import Inference
from atg_fg.policies.base import Choice
from atg_fg.policies.expected_costs import Outlook, best_by_expectation
from atg_fg.policies.shortest_paths import exploration_costs


class ExplorationPolicy:
    """Tries what was never tried: goes to the nearest aspect with such an action, on what is believed of the object."""

    name: ClassVar[str] = "explore"

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the first action on the way to something new."""
        return Choice(best_by_expectation(outlooks_on_the_new(inference), inference.model.n_actions, rng), None)


def outlooks_on_the_new(inference: Inference) -> list[Outlook]:
    """Return what it costs, in each situation, to try something new by each first action."""
    n_actions = inference.model.n_actions
    return [
        Outlook.on(situation, exploration_costs(situation.graph, n_actions, "attempts"))
        for situation in inference.situations()
    ]
