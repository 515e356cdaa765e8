"""Worlds as tasks of ap_gym (Active Perception Gym): act, and say at each step which object is presented."""

from __future__ import annotations

from typing import Any

import numpy as np

from atg_fg.core.checks import whole_number
from atg_fg.core.errors import InvalidInputError, MissingDependencyError
from atg_fg.worlds.base import World
from atg_fg.worlds.registry import make_world_with

try:
    import ap_gym
except ImportError as error:
    raise MissingDependencyError(
        f'ap_gym: cannot be loaded ({error}); expected it from: pip install "atg-fg[ap-gym]"'
    ) from error


class ActiveClassificationWorld(ap_gym.ActiveClassificationEnv):  # type: ignore[misc]
    """The object of a world as the class that an agent is to tell.

    A step takes an action of the world, and a prediction, the logits of all objects, shape [n_objects]. Its reward is
    minus ap_gym's loss, cross-entropy over ln(n_objects), so that a blind guess costs 1. The world's ``info`` is left
    out, as it gives the object away.

    Args:
        world: Name of a world, whose objects are drawn by ``objects_seed``, or ``module:namespace/Id-v0``; or a world.
        n_objects: How many objects the world has, at least two.
        objects_seed: Of the objects.
        **options: The world's own.

    Raises:
        InvalidInputError: A number that is too small, or the world cannot be made so.
        UnknownNameError: There is no such world.

    Attributes:
        world: The world.
    """

    def __init__(
        self, world: str | World = "ideal", n_objects: int = 10, objects_seed: int = 0, **options: Any
    ) -> None:
        n_objects = whole_number(n_objects, "n_objects", 2)
        self.world = make_world_with(world, n_objects, objects_seed, **options) if isinstance(world, str) else world
        super().__init__(n_objects, self.world.action_space)
        self.observation_space = self.world.observation_space
        self.metadata, self.render_mode = self.world.metadata, self.world.render_mode
        self._target = np.int64(0)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Present an object; ``options`` go to the world."""
        super().reset(seed=seed)
        observation, truth = self.world.reset(seed=int(self.np_random.integers(2**31)), options=options)
        self._target = self._class_of(truth)
        return observation, {}

    def _step(self, action: Any, prediction: Any) -> tuple[Any, float, bool, bool, dict[str, Any], np.int64]:
        observation, reward, terminated, truncated, truth = self.world.step(action)
        lost = bool(truth.get("lost"))
        return observation, float(reward), terminated or lost, truncated, {}, self._target

    def render(self) -> Any:
        """Return what the world renders."""
        return self.world.render()

    def close(self) -> None:
        """Close the world."""
        self.world.close()

    def _class_of(self, truth: dict[str, Any]) -> np.int64:
        presented, n_objects = truth.get("object"), int(self.prediction_target_space.n)
        if not isinstance(presented, (int, np.integer)) or not 0 <= presented < n_objects:
            raise InvalidInputError(f"world: object {presented!r}; expected its number, 0 to {n_objects - 1}")
        return np.int64(presented)
