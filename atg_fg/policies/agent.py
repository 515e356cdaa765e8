"""Agents of other libraries as policies, and policies of a user's own by name."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

import gymnasium
import numpy as np

from atg_fg.core.checks import brief
from atg_fg.core.errors import InvalidInputError
from atg_fg.inference.interface import Inference
from atg_fg.policies.base import Choice, Policy
from atg_fg.policies.belief_features import BeliefFeatures


class Agent(Protocol):
    """The part of a model of Stable-Baselines3 that is needed here."""

    def predict(self, observation: Any, *, deterministic: bool) -> tuple[Any, Any]:
        """Return the action for an observation, and a state, which is ``None`` for an agent without one."""


class AgentPolicy:
    """Lets an agent choose, by the features of the belief; it always takes the action that the agent thinks best.

    Args:
        agent: Anything with ``predict(observation, deterministic=True)``, such as a model of Stable-Baselines3 that
            was trained on a ``RecognitionEnv``. It must keep no state of its own from look to look.
        summary: What the agent sees; a plain ``BeliefFeatures`` of the memory's assumptions if not given.

    Raises:
        InvalidInputError: The agent has no ``predict``.
    """

    name: ClassVar[str] = "agent"

    def __init__(self, agent: Agent, summary: BeliefFeatures | None = None) -> None:
        if not callable(getattr(agent, "predict", None)):
            raise InvalidInputError(
                f"agent: {brief(agent)}; expected an object with predict(observation, deterministic)"
            )
        self.agent, self.summary = agent, summary

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return the agent's action.

        Raises:
            InvalidInputError: The agent expects other observations, keeps a state, or chooses what is no action.
        """
        summary = self._summary_for(inference)
        action, state = self.agent.predict(summary.of(inference), deterministic=True)
        if state is not None:
            raise InvalidInputError(f"agent: {self.agent!r} keeps a state; expected one that goes by what it sees")
        return Choice(_action(action, inference.model.n_actions), None)

    def _summary_for(self, inference: Inference) -> BeliefFeatures:
        summary = self.summary or BeliefFeatures(inference.memory.assumptions)
        expected = getattr(getattr(self.agent, "observation_space", None), "shape", None)
        if expected is not None and tuple(expected) != summary.space.shape:
            raise InvalidInputError(
                f"agent: observations of shape {tuple(expected)}; expected the summary's {summary.space.shape}"
            )
        return summary


class SampledPolicy:
    """Takes the actions that a gymnasium space samples, seeded by the trial's generator.

    Args:
        space: Of the actions, such as ``world.action_space``.
    """

    name: ClassVar[str] = "sampled"

    def __init__(self, space: gymnasium.Space[Any]) -> None:
        self.space = space

    def choose(self, inference: Inference, rng: np.random.Generator) -> Choice:
        """Return a sampled action.

        Raises:
            InvalidInputError: The space has samples that are no actions.
        """
        self.space.seed(int(rng.integers(2**31)))
        return Choice(_action(self.space.sample(), inference.model.n_actions), None)


def as_policy(given: Any, place: str = "policy") -> Policy:
    """Return a policy, an agent, a space of actions, or a class of one of these, as a policy.

    Raises:
        InvalidInputError: It is none of these; the message begins with ``place``.
    """
    try:
        made = given() if isinstance(given, type) else given
    except TypeError as error:
        raise InvalidInputError(f"{place}: cannot be made without arguments: {error}; expected an object") from error
    if callable(getattr(made, "choose", None)):
        policy: Policy = made
        return policy
    if callable(getattr(made, "predict", None)):
        return AgentPolicy(made)
    if isinstance(made, gymnasium.Space):
        return SampledPolicy(made)
    raise InvalidInputError(
        f"{place}: {brief(made)}; expected an object with choose(inference, rng), one with "
        "predict(observation, deterministic), or a gymnasium space"
    )


def _action(value: Any, n_actions: int) -> int:
    """Return what an agent chose as the index of an action."""
    array = np.asarray(value)
    if array.size != 1 or not np.issubdtype(array.dtype, np.integer) or not 0 <= array.item() < n_actions:
        raise InvalidInputError(f"agent: action {value!r}; expected 0 to {n_actions - 1}")
    return int(array.item())
