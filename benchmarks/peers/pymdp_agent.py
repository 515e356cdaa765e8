"""An agent of pymdp, which chooses actions by expected free energy."""

from __future__ import annotations

from typing import Any

import equinox
import jax
import jax.numpy as jnp
import numpy as np
from pymdp.agent import Agent

from atg_fg.core.patterns import Evidence, FloatArray
from benchmarks.contestants import Contestant
from benchmarks.dense_tables import DenseModel


class PymdpAgent(Contestant):
    """Exact inference over one hidden factor whose states are all (O, X); its functions compiled.

    Object and aspect as two factors would be quicker, but pymdp takes hidden factors to be independent given what was
    seen, which they are not here. What it scores actions by is the information that the next look gives about all
    hidden states, the aspect too; that is not eq. 3, so its decisions may be others.
    """

    name = "pymdp"
    preset = "paper"
    remark = "Agent, exact; scores by information on object and aspect, not by eq. 3; compiled before"

    def __init__(self, model: DenseModel) -> None:
        jax.config.update("jax_enable_x64", True)
        self._hypotheses, states = np.nonzero(model.there)
        self._n_hypotheses = len(model.prior)
        same = self._hypotheses[:, None] == self._hypotheses
        transition = model.transition[:, self._hypotheses[None, :], states[None, :], states[:, None]]
        self._agent = Agent(
            A=[jnp.asarray(model.observation[self._hypotheses, states].T)],
            B=[jnp.asarray(np.moveaxis(np.where(same, transition, 0.0), 0, -1))],
            C=[jnp.zeros(model.observation.shape[-1])],
            D=[jnp.asarray((model.prior[:, None] * model.initial)[self._hypotheses, states])],
            inference_algo="exact",
            use_utility=False,
        )
        self._infer = equinox.filter_jit(lambda agent, look, prior: agent.infer_states(look, prior))
        self._predict = equinox.filter_jit(lambda agent, action, states: agent.update_empirical_prior(action, states))
        self._score = equinox.filter_jit(lambda agent, states: agent.infer_policies(states)[1])
        self._prior: Any = self._agent.D
        self._states: Any = None
        self.begin()

    def begin(self) -> None:
        """Begin a trial."""
        self._prior = self._agent.D
        self._states = [jnp.asarray(self._agent.D[0])[:, None]]

    def look(self, evidence: Evidence) -> None:
        """Take in a look at a whole pattern."""
        self._states = self._infer(self._agent, [jnp.array([evidence.pattern])], self._prior)
        self._states[0].block_until_ready()

    def act(self, action: int) -> None:
        """Predict what an action does."""
        self._prior = self._predict(self._agent, jnp.array([[action]]), self._states)

    def decide(self) -> None:
        """Score the actions; expected entropy is not what pymdp computes."""
        self.information_gains()

    def information_gains(self) -> FloatArray:
        """Return I(O, X; z | a) of each action in nats, shape [A]."""
        gains: FloatArray = np.asarray(self._score(self._agent, self._states))[0]
        return gains

    def identity(self) -> FloatArray:
        """Return p(O | z_0:t, a_1:t), shape [H]."""
        belief = np.asarray(self._states[0]).ravel()
        return np.bincount(self._hypotheses, belief, self._n_hypotheses).astype(np.float64)
