"""Value iteration on the recognition model given the object: the exact reference for small models (QMDP's values).

Unlike a shortest path it counts on the unknown, too: an action never tried may lead to the goal, and so may whatever is
in the collection node.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from atg_fg.core.goals import Goal
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel

#: Costs above this many actions are not told apart.
HORIZON: Final = 500


_TOLERANCE: Final = 1e-9


def action_values(model: RecognitionModel, goal: Goal, horizon: int = HORIZON) -> FloatArray:
    """Return the expected number of actions to the goal by each first action, if the state is known from then on.

    That is Q(a, i, x) = 1 + Σ_y p(y | x, a, i) V_i(y) with V = 0 where the goal is shown and min_a Q elsewhere, up to
    ``horizon``, shape [A, H, W].

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
