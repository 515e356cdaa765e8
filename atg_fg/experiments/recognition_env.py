"""Recognition as a task for reinforcement learning: a ``gymnasium.Env`` in which an agent chooses the robot's actions.

An episode is a trial. What the agent sees is a summary of the belief; what the robot sees goes to the engine.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal, TypeAlias

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from atg_fg.core.checks import instance, whole_number
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.records import TrialRecord, TrialStep, TrialSummary
from atg_fg.engines import begin_trial, engine_for
from atg_fg.experiments.scores import Score
from atg_fg.experiments.trial import check_world_fits, learn_from, sensed_look
from atg_fg.inference.interface import Inference
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies.belief_features import BeliefFeatures
from atg_fg.storage.presets import preset as preset_named
from atg_fg.worlds.base import World
from atg_fg.worlds.registry import assumptions_of, make_world_with, sense_of

Summary: TypeAlias = NDArray[np.float32]
#: What an agent is rewarded for.
Reward: TypeAlias = Literal["success", "entropy"]
_REWARDS: Final = ("success", "entropy")


class RecognitionEnv(gymnasium.Env[Summary, np.int64]):
    """Trials in a world, one an episode, in the order of a test of the paper.

    As in a test, the memory learns from each trial, and after ``n_trials`` of them it is again as it was at first. A
    reset with a seed begins such a test, too.

    The reward is one of

    - ``success``: 1 at the end of a trial that is a success in the sense of Table 1, else 0;
    - ``entropy``: by how much each action has lowered the entropy of identity, in nats.

    ``info`` has the world's truth, and at the end of a trial under ``record`` its ``TrialRecord``, under ``success``
    whether it was one.

    Args:
        world: A world whose spaces fit the memory's assumptions. Closing this closes it.
        memory: What is remembered at first; it is not changed.
        parameters: α, δ and whether to learn within the trial.
        engine: Name of the inference engine.
        n_actions: Actions a trial.
        reward: What the agent is rewarded for.
        summary: What the agent sees; a plain ``BeliefFeatures`` if not given.
        learns: Whether the memory learns from each trial.
        n_trials: Trials after which the memory is as at first.
        made_from: The object that each ATG in ``memory`` was made from, by its name: what the world's ``info`` calls
            ``object``. An object that is not named has not been met.

    Raises:
        InvalidInputError: The world does not fit, a number is below one, or an ATG is not in ``made_from``.
        UnknownNameError: There is no such engine or reward.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - gymnasium declares it so

    def __init__(
        self,
        world: World,
        memory: RobotMemory,
        parameters: ModelParameters,
        *,
        engine: str = "bayes-filter",
        n_actions: int = 10,
        reward: Reward = "success",
        summary: BeliefFeatures | None = None,
        learns: bool = True,
        n_trials: int = 100,
        made_from: Mapping[str, object] | None = None,
    ) -> None:
        instance(world, "world", gymnasium.Env)
        instance(memory, "memory", RobotMemory)
        engine_for(engine, instance(parameters, "parameters", ModelParameters))
        if not isinstance(reward, str) or reward not in _REWARDS:
            raise unknown_name("reward", reward, _REWARDS)
        for name, number in (("n_actions", n_actions), ("n_trials", n_trials)):
            whole_number(number, name, least=1)
        self._made_from = dict(instance(made_from or {}, "made_from", Mapping))
        if set(self._made_from) != set(memory.names):
            raise InvalidInputError(
                f"made_from: {', '.join(self._made_from) or 'nothing'}; expected the object of each of "
                f"the {len(memory)} ATGs in memory"
            )
        check_world_fits(world, memory.assumptions, memory.sense)
        self.world, self.parameters, self.engine = world, parameters, engine
        self.n_actions, self.reward, self.learns, self.n_trials = n_actions, reward, learns, n_trials
        self.summary = summary or BeliefFeatures(memory.assumptions)
        self.observation_space = self.summary.space
        self._n_actions = len(memory.assumptions.actions)
        self.action_space = spaces.Discrete(self._n_actions)
        self._first_memory = memory_for(parameters, memory)
        self._begin_test()

    def _begin_test(self) -> None:
        """Make the memory as it was at first."""
        self.memory = self._first_memory.copy()
        self._score = Score(self._made_from)
        self._inference: Inference | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Summary, dict[str, Any]]:
        """Begin a trial, with its first look; ``options`` go to the world."""
        super().reset(seed=seed)
        if seed is not None or self._score.n_trials >= self.n_trials:
            self._begin_test()
        if not self.learns:
            self._score = Score(self._made_from)
        self._inference = begin_trial(self.engine, self.memory, self.parameters)
        self._record = TrialRecord(self.memory.names, self.memory.assumptions)
        observation, truth = self.world.reset(seed=int(self.np_random.integers(2**31)), options=options)
        self._senses = None if self.memory.sense is None else self.memory.sense.begin()
        self._look(self._inference, observation, truth)
        self._entropy = self._inference.identity().entropy
        self._seen = self.summary.of(self._inference)
        return self._seen, dict(truth)

    def step(self, action: np.int64) -> tuple[Summary, float, bool, bool, dict[str, Any]]:
        """Act and look; the last look ends the trial.

        Raises:
            InvalidInputError: There is no such action, or no trial that goes on.
        """
        if self._inference is None:
            raise InvalidInputError("recognition: no trial goes on; expected a reset first")
        if not self.action_space.contains(action):
            raise InvalidInputError(f"action: {action!r}; expected 0 to {self._n_actions - 1}")
        inference, chosen = self._inference, int(action)
        self._keep(inference, chosen)
        inference.act(chosen)
        observation, _, terminated, truncated, truth = self.world.step(np.int64(chosen))
        self._truth = truth
        if truth.get("lost"):
            self._record.lost_truth = truth
            return self._end(0.0)
        self._look(inference, observation, truth)
        self._seen = self.summary.of(inference)
        before, self._entropy = self._entropy, inference.identity().entropy
        gain = before - self._entropy
        if terminated or truncated or len(self._record.steps) == self.n_actions:
            self._keep(inference, None)
            return self._end(gain)
        return self._seen, gain if self.reward == "entropy" else 0.0, False, False, dict(truth)

    def _look(self, inference: Inference, observation: Any, truth: dict[str, Any]) -> None:
        self._evidence, self._truth = sensed_look(self._senses, self.memory.assumptions, observation, truth)
        inference.observe(self._evidence)

    def _keep(self, inference: Inference, action: int | None) -> None:
        """Add the last look to the record, and the action chosen after it."""
        pattern, belief = self._evidence.pattern, inference.identity()
        detection = self._evidence.detection or ()
        step = TrialStep(detection, pattern, belief, inference.log_evidence, self._truth, action=action)
        self._record.steps.append(step)

    def _end(self, gain: float) -> tuple[Summary, float, bool, bool, dict[str, Any]]:
        """Score the trial, let the memory learn from it, and return the last step of the episode."""
        learned = learn_from(self._record, self.memory) if self.learns else None
        success = self._score.add(TrialSummary.of(self._record), learned, self.memory)
        self._inference = None
        info = {**self._truth, "record": self._record, "success": success}
        return self._seen, gain if self.reward == "entropy" else float(success), True, False, info

    def close(self) -> None:
        """Close the world."""
        self.world.close()


def make_recognition_env(
    world: str = "ideal",
    preset: str = "default",
    n_objects: int = 100,
    objects_seed: int = 0,
    world_options: Mapping[str, Any] | None = None,
    render_mode: str | None = None,
    **options: Any,
) -> RecognitionEnv:
    """Return the task of recognition in a world by name, from an empty memory: ``atg_fg/Recognition-v0``.

    Args:
        world: Name of the world.
        preset: Name of the model's parameters.
        n_objects: |O|, unless it is a user's own world.
        objects_seed: Seed that the objects are drawn by.
        world_options: Passed on to the world.
        render_mode: There is none but ``None``.
        options: Keyword arguments of ``RecognitionEnv``.

    Raises:
        UnknownNameError: No world or preset has this name.
        InvalidInputError: As for ``RecognitionEnv``.
    """
    made = make_world_with(world, n_objects, objects_seed, **dict(world_options or {}))
    memory = RobotMemory(assumptions_of(made, n_objects), sense=sense_of(made))
    return RecognitionEnv(made, memory, preset_named(preset), **options)
