"""The model of ``atg_fg.inference.recognition_model`` as plain dense tables: what a general library is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel


@dataclass(frozen=True)
class DenseModel:
    """H hypotheses, W states of each with padding, A actions, |𝒵| patterns.

    Attributes:
        prior: p(O), shape [H].
        initial: p(X₀ | O), shape [H, W].
        transition: p(x' | x, a, O), shape [A, H, W, W].
        observation: p(z | x, O), shape [H, W, |𝒵|]; padding, which has probability zero, shows all patterns alike.
        there: Which states are no padding, shape [H, W].
        state_of: The state of each hypothesis that shows a pattern without noise, shape [H, |𝒵|].
        noise: δ/|𝒵|.
        n_unseen: U.
    """

    prior: FloatArray
    initial: FloatArray
    transition: FloatArray
    observation: FloatArray
    there: NDArray[np.bool_]
    state_of: IntArray
    noise: float
    n_unseen: int

    @property
    def n_actions(self) -> int:
        """A, the number of actions."""
        return len(self.transition)


def table_bytes(memory: RobotMemory) -> int:
    """Return the bytes of the two largest tables of ``dense_model``, before they are made."""
    n_states = 1 + max((graph.n_known for graph in memory), default=0)
    n_patterns, n_actions = len(memory.assumptions.alphabet), len(memory.assumptions.actions)
    return 8 * (len(memory) + 1) * n_states * (n_patterns + n_actions * n_states)


def dense_model(memory: RobotMemory, parameters: ModelParameters) -> DenseModel:
    """Return the tables at the beginning of a trial; without learning in the trial they hold throughout."""
    model = RecognitionModel(memory, parameters)
    there = model.pattern_of >= 0
    there[:, COLLECTION] = True
    observation = np.stack([model.likelihood(Evidence(pattern)) for pattern in np.eye(model.n_patterns)], axis=-1)
    observation[~there] = 1.0 / model.n_patterns
    # Libraries check that distributions sum to one; rounding and an empty collection node must not trip them.
    observation /= observation.sum(axis=-1, keepdims=True)
    return DenseModel(
        prior=model.prior,
        initial=model.base_row,
        transition=np.stack([model.transition(action) for action in range(model.n_actions)]),
        observation=observation,
        there=there,
        state_of=model.aspect_of,
        noise=parameters.observation_noise / model.n_patterns,
        n_unseen=model.n_unseen,
    )
