"""The recogniser as an agent: from what a world shows to an action, in a loop of a user's own.

A loop over a world asks it as it asks a model of Stable-Baselines3, by ``predict``; its belief is its own business.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, IntArray
from atg_fg.engines import begin_trial, engine_for
from atg_fg.inference.interface import Inference
from atg_fg.policies import Policy, make_policy
from atg_fg.worlds.base import detection_of


class RecognitionAgent:
    """Takes in what a world shows, keeps a belief about the object, and chooses the next action.

    It works in one world, or in many at once: then observations have shape [worlds, slots], and there is a belief for
    each.

    Args:
        memory: The robot memory; it is not changed.
        parameters: α, δ and whether to learn within the trial.
        engine: Name of the inference engine.
        policy: Chooses the actions, or its name; it must not end trials.
        seed: Of the generators of all trials, from which ties are broken.

    Raises:
        UnknownNameError: There is no such engine or policy.
        InvalidInputError: The engine does not know what the parameters ask for.

    Attributes:
        trials: The engine of each world in its present trial.
    """

    def __init__(
        self,
        memory: RobotMemory,
        parameters: ModelParameters,
        *,
        engine: str = "bayes-filter",
        policy: str | Policy = "entropy",
        seed: int = 0,
    ) -> None:
        engine_for(engine, parameters)
        self.memory, self.parameters, self.engine = memory, parameters, engine
        self.policy: Policy = make_policy(policy) if isinstance(policy, str) else policy
        self._seeds = np.random.SeedSequence(seed)
        self.trials: list[Inference] = []
        self._generators: list[np.random.Generator] = []

    def reset(self) -> None:
        """Forget what was seen: the next observation is the first of a trial."""
        self.trials, self._generators = [], []

    @property
    def inference(self) -> Inference:
        """The engine in the present trial, or the first of them.

        Raises:
            InvalidInputError: Nothing has been seen since the last reset.
        """
        if not self.trials:
            raise InvalidInputError("agent: nothing seen yet; expected an observation first")
        return self.trials[0]

    @property
    def belief(self) -> IdentityBelief:
        """p(O | z, a) in the present trial, or the first of them."""
        return self.inference.identity()

    def __call__(self, observation: ArrayLike) -> int:
        """Return the action for an observation of one world."""
        action, _ = self.predict(observation)
        if action.ndim:
            raise InvalidInputError(f"agent: observations of {len(action)} worlds; expected that of one")
        return int(action)

    def predict(
        self,
        observation: ArrayLike,
        state: Any = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> tuple[IntArray, None]:
        """Take in what each world shows, and return the actions to take there.

        Args:
            observation: Symbols or ``MISSING``, shape [slots], or [worlds, slots].
            state: Ignored: the agent keeps its beliefs itself.
            episode_start: Whether this is the first observation of a trial, one or shape [worlds]; the very first is
                one in any case.
            deterministic: Ignored: only ties are broken at random, by the seed.

        Returns:
            The index of each action, shape [] or [worlds], and no state.

        Raises:
            InvalidInputError: An observation that is of another shape or not of the alphabet, or a policy that ends the
                trial.
        """
        rows = self._take_in(observation, episode_start)
        actions = [self._act(inference, rng) for inference, rng in zip(self.trials, self._generators, strict=True)]
        return np.array(actions if rows.ndim == 2 else actions[0], dtype=np.int64), None

    def observe(self, observation: ArrayLike, episode_start: ArrayLike | None = None) -> None:
        """Take in what each world shows without acting on it: the last look of a trial.

        Args:
            observation: As for ``predict``.
            episode_start: As for ``predict``.

        Raises:
            InvalidInputError: An observation that is of another shape, or not of the alphabet.
        """
        self._take_in(observation, episode_start)

    def _take_in(self, observation: ArrayLike, episode_start: ArrayLike | None) -> NDArray[Any]:
        rows = np.asarray(observation)
        alphabet = self.memory.assumptions.alphabet
        if rows.ndim not in (1, 2) or rows.shape[-1] != len(alphabet.slots) or not rows.size:
            raise InvalidInputError(
                f"agent: observation of shape {rows.shape}; expected ({len(alphabet.slots)},) for one world, or "
                f"(worlds, {len(alphabet.slots)})"
            )
        detections = [detection_of(row) for row in np.atleast_2d(rows)]
        evidence = [Evidence.of_detection(alphabet, detection) for detection in detections]
        self._begin_trials(len(evidence), episode_start)
        for inference, each in zip(self.trials, evidence, strict=True):
            inference.observe(each)
        return rows

    def _begin_trials(self, n_worlds: int, episode_start: ArrayLike | None) -> None:
        """Make an engine anew in each world where a trial begins."""
        if not self.trials:
            self.trials = [begin_trial(self.engine, self.memory, self.parameters) for _ in range(n_worlds)]
            self._generators = [self._generator() for _ in range(n_worlds)]
            return
        if len(self.trials) != n_worlds:
            raise InvalidInputError(f"agent: observations of {n_worlds} worlds; expected {len(self.trials)} as before")
        starts = np.broadcast_to(False if episode_start is None else np.asarray(episode_start, dtype=bool), n_worlds)
        for world in np.flatnonzero(starts):
            self.trials[world] = begin_trial(self.engine, self.memory, self.parameters)
            self._generators[world] = self._generator()

    def _generator(self) -> np.random.Generator:
        """Return the generator of the next trial."""
        return np.random.default_rng(self._seeds.spawn(1)[0])

    def _act(self, inference: Inference, rng: np.random.Generator) -> int:
        choice = self.policy.choose(inference, rng)
        if choice.action is None:
            raise InvalidInputError("agent: the policy ends the trial; expected one that always acts")
        inference.act(choice.action)
        return choice.action
