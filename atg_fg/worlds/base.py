"""What a world is: a gymnasium environment with one object in finitely many states."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, TypeAlias

import gymnasium
import numpy as np
from gymnasium import spaces

from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.patterns import MISSING, Detection, IntArray

World: TypeAlias = gymnasium.Env[IntArray, np.int64]


def detection_of(observation: IntArray) -> Detection:
    """Return an observation as a detection, with ``None`` for each missing symbol."""
    # Python's numbers are several times as quick to go through as NumPy's.
    return tuple(None if symbol == MISSING else int(symbol) for symbol in np.asarray(observation).tolist())


def looks_space(n_slots: int, n_symbols: int) -> spaces.Box:
    """Return the space of looks: in each slot a symbol's number, or ``MISSING``.

    It is a box of whole numbers: what trains on environments takes ``MultiDiscrete`` to begin at zero.
    """
    return spaces.Box(MISSING, n_symbols - 1, (n_slots,), np.int64)


def symbols_of(space: Any) -> list[int]:
    """Return how many symbols each slot may show in a space of looks; none if it is something else.

    A world of a user's own may have whole numbers in a ``Box``, or a ``MultiDiscrete`` that counts ``MISSING``.
    """
    if isinstance(space, spaces.MultiDiscrete) and space.nvec.ndim == 1:
        return [int(size) - 1 for size in space.nvec]
    if isinstance(space, spaces.Box) and len(space.shape) == 1 and np.issubdtype(space.dtype, np.integer):
        return [int(most) + 1 for most in space.high] if (space.low == MISSING).all() else []
    return []


def probability_option(name: str, value: float) -> float:
    """Return ``value`` if it is a probability, else raise ``InvalidInputError``."""
    if not isinstance(value, (int, float, np.number)) or not 0 <= value <= 1:
        raise InvalidInputError(f"{name}: {value!r}; expected a probability from 0 to 1")
    return float(value)


class FiniteStateWorld(gymnasium.Env[IntArray, np.int64], ABC):
    """One object in one of finitely many states: actions change it, and looks at it may fail.

    A subclass says which objects there are, where actions lead and what a state shows.

    Args:
        n_objects: Objects of this world.
        n_actions: Actions.
        n_slots: Slots of a pattern.
        n_symbols: Symbols that a slot can show.
        slip: Probability that an action fails and the object stays as it is.
        wrong: Probability that a look shows a pattern drawn uniformly from all patterns instead.
        missing: Probability, for each slot alone, that its symbol is not detected.

    ``reset(options={"object": i, "state": j})`` sets what is not to be drawn at random.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - gymnasium declares it so
    #: What a state is called in reset options and in ``info``.
    state_name: ClassVar[str] = "state"

    def __init__(
        self,
        n_objects: int,
        n_actions: int,
        n_slots: int,
        n_symbols: int,
        *,
        slip: float = 0.0,
        wrong: float = 0.0,
        missing: float = 0.0,
        render_mode: str | None = None,
    ) -> None:
        self.slip = probability_option("slip", slip)
        self.wrong = probability_option("wrong", wrong)
        self.missing = probability_option("missing", missing)
        self.render_mode = render_mode
        self.action_space = spaces.Discrete(n_actions)
        self.observation_space: Any = looks_space(n_slots, n_symbols)
        self.object = 0
        self.state = 0
        self._n_objects, self._n_actions = n_objects, n_actions
        self._n_slots, self._n_symbols = n_slots, n_symbols

    @abstractmethod
    def _n_states(self) -> int:
        """Return the number of states of the object that is presented."""

    @abstractmethod
    def _successor(self, action: int) -> int:
        """Return the state that an action leads to now, if it does not fail."""

    @abstractmethod
    def _pattern(self) -> tuple[int, ...]:
        """Return the pattern that the object shows now."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[IntArray, dict[str, Any]]:
        """Present an object in a state, both drawn at random unless ``options`` sets them."""
        super().reset(seed=seed)
        self._present(options or {})
        self._place()
        return self._look(), self._truth(slipped=False)

    def step(self, action: np.int64) -> tuple[IntArray, float, bool, bool, dict[str, Any]]:
        """Act and look. There is no reward, and the episode goes on for as long as one likes."""
        usual = type(action) is np.int64 and 0 <= action < self._n_actions  # quicker than to ask the space
        if not usual and not self.action_space.contains(action):
            raise InvalidInputError(f"action: {action!r}; expected 0 to {self._n_actions - 1}")
        slipped = self.slip > 0 and bool(self.np_random.random() < self.slip)
        if not slipped:
            self.state = self._successor(int(action))
        self._place()
        return self._look(), 0.0, False, False, self._truth(slipped=slipped)

    def _present(self, options: dict[str, Any]) -> None:
        """Choose what is presented, by the options of a reset or at random."""
        for name in options:
            if name not in ("object", self.state_name):
                raise unknown_name("reset option", name, ("object", self.state_name))
        self.object = self._chosen(options, "object", self._n_objects)
        self.state = self._chosen(options, self.state_name, self._n_states())

    def _chosen(self, options: dict[str, Any], name: str, n: int) -> int:
        if name not in options:
            return int(self.np_random.integers(n))
        chosen = options[name]
        if not isinstance(chosen, (int, np.integer)) or not 0 <= chosen < n:
            raise InvalidInputError(f"reset option {name!r}: {chosen!r}; expected 0 to {n - 1}")
        return int(chosen)

    def _place(self) -> None:
        """Put the object down in its new state (a hook for worlds that have a place to put it)."""

    def _look(self) -> Any:
        """Return what is detected now, shape [slots], or what else the observation space says."""
        observation = np.array(self._detect(), dtype=np.int64)
        if self.wrong and self.np_random.random() < self.wrong:
            observation = self.np_random.permutation(self._n_symbols)[: self._n_slots].astype(np.int64)
        if self.missing:
            observation[self.np_random.random(self._n_slots) < self.missing] = MISSING
        return observation

    def _detect(self) -> tuple[int, ...]:
        """Return the symbols, or ``MISSING``, before any noise of ``wrong`` and ``missing``."""
        return self._pattern()

    def _truth(self, *, slipped: bool) -> dict[str, Any]:
        return {"object": self.object, self.state_name: self.state, "pattern": self._pattern(), "slipped": slipped}
