"""A forward filter on dense tables in JAX, compiled for this shape."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import xlogy

from atg_fg.core.patterns import Evidence, FloatArray
from benchmarks.contestants import Contestant
from benchmarks.dense_tables import DenseModel


class JaxFilter(Contestant):
    """Prediction, correction and expected entropy, each one compiled function, in 64 bits; actions are mapped over.

    An object shows a pattern in one of its states, or by noise, so p(O, z | a) is gathered, not multiplied out: this is
    quicker here than a product with the table p(z | x, O).
    """

    name = "JAX"
    preset = "paper"
    remark = "dense filter, jit and vmap, 64 bits; compiled before"

    def __init__(self, model: DenseModel) -> None:
        jax.config.update("jax_enable_x64", True)
        self._prior: Any = jnp.asarray(model.prior[:, None] * model.initial)
        self._observation = jnp.asarray(model.observation)
        self._transition = jnp.asarray(model.transition)
        state_of = jnp.asarray(model.state_of)
        shown = jnp.take_along_axis(self._observation, state_of[:, None, :], axis=1)[:, 0, :] - model.noise
        self._tables = (self._transition, state_of, shown, model.noise, float(np.log(model.n_unseen)))
        # Tables are arguments: those that a compiled function holds as constants are folded, which takes long.
        self._look, self._act, self._decide = jax.jit(_look), jax.jit(_act), jax.jit(_expected_entropies)
        self._belief = self._prior

    def begin(self) -> None:
        """Begin a trial."""
        self._belief = self._prior

    def look(self, evidence: Evidence) -> None:
        """Take in a look at a whole pattern."""
        # JAX returns before it has computed; a robot would wait for the belief.
        self._belief = self._look(self._belief, self._observation, evidence.pattern).block_until_ready()

    def act(self, action: int) -> None:
        """Predict what an action does."""
        self._belief = self._act(self._belief, self._transition, action)

    def decide(self) -> FloatArray:
        """Return the expected entropy of each action in nats, shape [A]."""
        return np.asarray(self._decide(self._belief, *self._tables))

    def identity(self) -> FloatArray:
        """Return p(O | z_0:t, a_1:t), shape [H]."""
        return np.asarray(self._belief.sum(axis=1))


def _look(belief: Any, observation: Any, pattern: Any) -> Any:
    joint = belief * observation[:, :, pattern]
    return joint / joint.sum()


def _act(belief: Any, transition: Any, action: Any) -> Any:
    return jnp.einsum("hx,hxy->hy", belief, transition[action])


def _expected_entropies(belief: Any, transition: Any, state_of: Any, shown: Any, noise: Any, log_unseen: Any) -> Any:
    def expected_entropy(table: Any) -> Any:
        predicted = jnp.einsum("hx,hxy->hy", belief, table)
        joint = jnp.take_along_axis(predicted, state_of, axis=1) * shown
        joint += noise * predicted.sum(axis=1, keepdims=True)
        predictive = joint.sum(axis=0)
        return xlogy(predictive, predictive).sum() - xlogy(joint, joint).sum() + belief[-1].sum() * log_unseen

    return jax.vmap(expected_entropy)(transition)
