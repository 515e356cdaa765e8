"""Worlds as gymnasium environments: the ideal ARcube, and the registry of world names.

A world has a ``Discrete`` action space and a ``MultiDiscrete`` observation space with one entry a slot:
the symbol detected there, or ``MISSING``. ``info`` carries the truth, for scoring only.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, TypeAlias

import gymnasium
import numpy as np
from gymnasium import spaces

from atg_fg.arcube import ACTION_SOURCES, FACES, N_TAGS, ORIENTATIONS, SUCCESSORS, Cube, make_arcubes, shown_pattern
from atg_fg.errors import InvalidInputError, unknown_name
from atg_fg.patterns import Detection, IntArray

#: Entry of an observation for a slot where nothing was detected.
MISSING: Final = -1

World: TypeAlias = gymnasium.Env[IntArray, np.int64]

#: Names on the command line. The part before the colon is imported first, so that it can register the id.
WORLDS: Final[dict[str, str]] = {
    "ideal": "atg_fg:atg_fg/ARcube-v0",
    "rendered": "sim:sim/RenderedARcube-v0",
    "robonaut": "sim:sim/RobonautARcube-v0",
}


def make_world(name: str, **options: Any) -> World:
    """Return the world registered as ``name`` (or any ``module:namespace/Id-v0`` of a user's own).

    Raises:
        UnknownNameError: No world has this name.
        MissingDependencyError: The world needs an extra that is not installed.
    """
    if name not in WORLDS and ":" not in name:
        raise unknown_name("world", name, WORLDS)
    try:
        return gymnasium.make(WORLDS.get(name, name), disable_env_checker=True, **options)
    except (gymnasium.error.Error, ModuleNotFoundError, TypeError) as error:
        if isinstance(error, TypeError) and "unexpected keyword argument" not in str(error):
            raise  # a fault of the world's own
        raise InvalidInputError(f"world {name!r}: cannot be made: {error}") from error


def detection_of(observation: IntArray) -> Detection:
    """Return an observation as a detection, with ``None`` for each missing symbol."""
    return tuple(None if symbol == MISSING else int(symbol) for symbol in observation)


def probability_option(name: str, value: float) -> float:
    """Return ``value`` if it is a probability, else raise ``InvalidInputError``."""
    if not 0 <= value <= 1:
        raise InvalidInputError(f"{name}: {value!r}; expected a probability from 0 to 1")
    return float(value)


class ARcubeWorld(gymnasium.Env[IntArray, np.int64]):
    """One ARcube that three actions turn: flip, left, right; front and top are looked at.

    Args:
        cubes: The cubes of this world; ``make_arcubes(100, seed=0)`` if not given.
        slip: Probability that an action fails and the cube stays as it is.
        wrong: Probability that a look shows a pattern drawn uniformly from all patterns instead.
        missing: Probability, for each slot alone, that its symbol is not detected.

    ``reset(options={"object": i, "orientation": j})`` sets what is not to be drawn at random.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - gymnasium declares it so

    def __init__(
        self,
        cubes: Sequence[Cube] | None = None,
        *,
        slip: float = 0.0,
        wrong: float = 0.0,
        missing: float = 0.0,
        render_mode: str | None = None,
    ) -> None:
        self.cubes = tuple(cubes) if cubes is not None else make_arcubes(100, seed=0)
        if not self.cubes:
            raise InvalidInputError("cubes: none given; expected at least one")
        for cube in self.cubes:
            if len(set(cube)) != len(FACES) or len(cube) != len(FACES) or not all(0 <= tag < N_TAGS for tag in cube):
                raise InvalidInputError(f"cubes: {cube!r}; expected {len(FACES)} different tags from 0 to {N_TAGS - 1}")
        self.slip = probability_option("slip", slip)
        self.wrong = probability_option("wrong", wrong)
        self.missing = probability_option("missing", missing)
        self.render_mode = render_mode
        self.action_space = spaces.Discrete(len(ACTION_SOURCES))
        self.observation_space = spaces.MultiDiscrete([N_TAGS + 1] * 2, start=[MISSING] * 2)
        self.object = 0
        self.orientation = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[IntArray, dict[str, Any]]:
        """Present an object in an orientation, both drawn at random unless ``options`` sets them."""
        super().reset(seed=seed)
        self._present(options or {})
        self._place()
        return self._look(), self._truth(slipped=False)

    def step(self, action: np.int64) -> tuple[IntArray, float, bool, bool, dict[str, Any]]:
        """Turn the cube and look. There is no reward, and the episode goes on for as long as one likes."""
        if not self.action_space.contains(action):
            raise InvalidInputError(f"action: {action!r}; expected 0 to {len(ACTION_SOURCES) - 1}")
        slipped = self.slip > 0 and bool(self.np_random.random() < self.slip)
        if not slipped:
            self.orientation = SUCCESSORS[self.orientation][int(action)]
        self._place()
        return self._look(), 0.0, False, False, self._truth(slipped=slipped)

    def _present(self, options: dict[str, Any]) -> None:
        """Choose what is presented, by the options of a reset or at random."""
        for name in options:
            if name not in ("object", "orientation"):
                raise unknown_name("reset option", name, ("object", "orientation"))
        self.object = self._chosen(options, "object", len(self.cubes))
        self.orientation = self._chosen(options, "orientation", len(ORIENTATIONS))

    def _chosen(self, options: dict[str, Any], name: str, n: int) -> int:
        if name not in options:
            return int(self.np_random.integers(n))
        chosen = options[name]
        if not isinstance(chosen, (int, np.integer)) or not 0 <= chosen < n:
            raise InvalidInputError(f"reset option {name!r}: {chosen!r}; expected 0 to {n - 1}")
        return int(chosen)

    def _place(self) -> None:
        """Put the cube down in its new orientation (a hook for worlds that have a place to put it)."""

    def _look(self) -> IntArray:
        """Return what is detected now, shape [2]."""
        observation = np.array(self._detect(), dtype=np.int64)
        if self.wrong and self.np_random.random() < self.wrong:
            observation = self.np_random.permutation(N_TAGS)[:2].astype(np.int64)
        if self.missing:
            observation[self.np_random.random(2) < self.missing] = MISSING
        return observation

    def _detect(self) -> tuple[int, int]:
        """Return the symbols (front, top), or ``MISSING``, before any noise of ``wrong`` and ``missing``."""
        return shown_pattern(self.cubes[self.object], self.orientation)

    def _truth(self, *, slipped: bool) -> dict[str, Any]:
        return {
            "object": self.object,
            "orientation": self.orientation,
            "pattern": shown_pattern(self.cubes[self.object], self.orientation),
            "slipped": slipped,
        }


gymnasium.register(id="atg_fg/ARcube-v0", entry_point="atg_fg.worlds:ARcubeWorld")
