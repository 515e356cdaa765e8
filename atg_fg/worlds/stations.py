"""Several objects before the robot, each at a station of its own; the robot serves one at a time (section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import gymnasium
import numpy as np
from gymnasium import spaces

from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.patterns import IntArray
from atg_fg.worlds.arcube import Cube
from atg_fg.worlds.base import World
from atg_fg.worlds.registry import make_world

#: Worlds that show all stations in one scene. Of any other world there is one at each station.
TABLES: Final[dict[str, str]] = {"robonaut": "sim:sim/RobonautTable-v0"}


class StationsWorld(gymnasium.Env[IntArray, np.int64]):
    """A world of one object at each station.

    The first A actions are those of the worlds and act on the object at the station where the robot is; action A + k
    takes the robot to station k. After each action the robot looks at the object before it. An object that is lost
    stays so until the next reset, and ends the episode only when all are.

    Args:
        worlds: The worlds, one a station, with the same spaces.

    ``reset(options={"objects": […], "orientations": […]})`` sets what is not to be drawn at random, one entry a
    station. Objects that are drawn are all different. The robot begins at station 0.

    ``info`` is that of the station's world, with the number of the ``station``.
    """

    def __init__(self, worlds: Sequence[World]) -> None:
        if not worlds:
            raise InvalidInputError("stations: none; expected at least one")
        self.worlds = tuple(worlds)
        self.n_stations = len(worlds)
        self.n_turns = int(getattr(worlds[0].action_space, "n", 0))
        for world in worlds:
            if (world.action_space, world.observation_space) != (worlds[0].action_space, worlds[0].observation_space):
                raise InvalidInputError("stations: worlds with different spaces; expected the same at each station")
        self.action_space = spaces.Discrete(self.n_turns + len(worlds))
        self.observation_space = worlds[0].observation_space
        self.metadata = worlds[0].metadata
        self.render_mode = worlds[0].render_mode
        self.station = 0
        self._shown: list[tuple[IntArray, dict[str, Any]]] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[IntArray, dict[str, Any]]:
        """Present an object at each station, and look at the first."""
        super().reset(seed=seed)
        options = dict(options or {})
        n_objects = len(getattr(self.worlds[0].unwrapped, "cubes", ())) or None
        objects = drawn_objects(options.pop("objects", None), len(self.worlds), n_objects, self.np_random)
        placed: list[dict[str, Any]] = [{"object": each} for each in objects]
        orientations = options.pop("orientations", None)
        if orientations is not None:
            check_one_a_station("orientations", orientations, len(self.worlds))
            for each, orientation in zip(placed, orientations, strict=True):
                each["orientation"] = orientation
        for name in options:
            raise unknown_name("reset option", name, ("objects", "orientations"))
        self._shown = [
            world.reset(seed=int(self.np_random.integers(2**31)), options=each)
            for world, each in zip(self.worlds, placed, strict=True)
        ]
        self.station = 0
        return self._look()

    def step(self, action: np.int64) -> tuple[IntArray, float, bool, bool, dict[str, Any]]:
        """Act on the object before the robot, or go to another.

        Raises:
            InvalidInputError: Not an action, or the object here is lost.
        """
        if not self.action_space.contains(action):
            raise InvalidInputError(f"action: {action!r}; expected 0 to {self.n_turns + self.n_stations - 1}")
        truncated = False
        if action >= self.n_turns:
            self.station = int(action) - self.n_turns
        else:
            observation, _, _, truncated, info = self.worlds[self.station].step(action)
            self._shown[self.station] = observation, info
        observation, info = self._look()
        return observation, 0.0, all(shown.get("lost", False) for _, shown in self._shown), truncated, info

    def render(self) -> Any:
        """Return what the world at this station renders."""
        return self.worlds[self.station].render()

    def close(self) -> None:
        """Close the worlds of all stations."""
        for world in self.worlds:
            world.close()

    def _look(self) -> tuple[IntArray, dict[str, Any]]:
        observation, info = self._shown[self.station]
        return observation.copy(), {**info, "station": self.station}


class AtStation(gymnasium.Env[IntArray, np.int64]):
    """One station of a world with several, as a world of one object; a reset is to go there and look.

    Args:
        world: Such as ``make_stations`` returns, already reset.
        station: Number of the station.
    """

    def __init__(self, world: gymnasium.Env[IntArray, np.int64], station: int) -> None:
        self.world = world
        self.station = station
        n_stations = int(world.get_wrapper_attr("n_stations"))
        if not 0 <= station < n_stations:
            raise InvalidInputError(f"station: {station}; expected 0 to {n_stations - 1}")
        self._n_turns = int(getattr(world.action_space, "n", 0)) - n_stations
        self.action_space = spaces.Discrete(self._n_turns)
        self.observation_space = world.observation_space
        self.metadata, self.render_mode = world.metadata, world.render_mode

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[IntArray, dict[str, Any]]:
        """Go to this station and look at what is there, as it is; ``seed`` and ``options`` are of no use here."""
        super().reset(seed=seed)
        observation, _, _, _, info = self.world.step(np.int64(self._n_turns + self.station))
        return observation, info

    def step(self, action: np.int64) -> tuple[IntArray, float, bool, bool, dict[str, Any]]:
        """Act on the object here; the episode ends when it is lost."""
        if not self.action_space.contains(action):
            raise InvalidInputError(f"action: {action!r}; expected 0 to {self._n_turns - 1}")
        observation, reward, _, truncated, info = self.world.step(action)
        return observation, float(reward), bool(info.get("lost", False)), truncated, info

    def render(self) -> Any:
        """Return what the world renders."""
        return self.world.render()


def make_stations(
    name: str, n_stations: int, cubes: Sequence[Cube] | None = None, **options: Any
) -> gymnasium.Env[IntArray, np.int64]:
    """Return a world with stations: one scene where the world named ``name`` has one, else a world at each.

    Raises:
        InvalidInputError: Fewer than one station, or the world cannot be made.
    """
    if n_stations < 1:
        raise InvalidInputError(f"stations: {n_stations}; expected a whole number of at least 1")
    given = options if cubes is None else {**options, "cubes": cubes}
    if name in TABLES:
        return make_world(TABLES[name], n_stations=n_stations, **given)
    return StationsWorld([make_world(name, **given) for _ in range(n_stations)])


def drawn_objects(
    chosen: Sequence[int] | None, n_stations: int, n_objects: int | None, rng: np.random.Generator
) -> list[int]:
    """Return an object for each station: those chosen, or different ones drawn at random.

    Raises:
        InvalidInputError: Not one a station, or fewer objects than stations.
    """
    if chosen is not None:
        check_one_a_station("objects", chosen, n_stations)
        return [int(each) for each in chosen]
    if n_objects is None or n_objects < n_stations:
        raise InvalidInputError(
            f"objects: {n_objects or 'none'} to draw from; expected at least {n_stations}, all different"
        )
    return [int(each) for each in rng.permutation(n_objects)[:n_stations]]


def check_one_a_station(name: str, chosen: Any, n_stations: int) -> None:
    """Raise ``InvalidInputError`` unless reset option ``name`` has one entry a station."""
    if isinstance(chosen, str) or not hasattr(chosen, "__len__") or len(chosen) != n_stations:
        raise InvalidInputError(
            f"reset option {name!r}: {chosen!r}; expected one entry for each of {n_stations} stations"
        )
