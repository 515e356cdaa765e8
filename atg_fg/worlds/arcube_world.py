"""The ideal ARcube as a world."""

from __future__ import annotations

from collections.abc import Sequence

from atg_fg.core.errors import InvalidInputError
from atg_fg.worlds.arcube import (
    ACTION_SOURCES,
    FACES,
    N_TAGS,
    ORIENTATIONS,
    SUCCESSORS,
    Cube,
    make_arcubes,
    shown_pattern,
)
from atg_fg.worlds.base import FiniteStateWorld


class ARcubeWorld(FiniteStateWorld):
    """One ARcube that three actions turn: flip, left, right; front and top are looked at.

    Args:
        cubes: The cubes of this world; ``make_arcubes(100, seed=0)`` if not given.
        slip: Probability that an action fails and the cube stays as it is.
        wrong: Probability that a look shows a pattern drawn uniformly from all patterns instead.
        missing: Probability, for each slot alone, that its symbol is not detected.

    ``reset(options={"object": i, "orientation": j})`` sets what is not to be drawn at random.
    """

    state_name = "orientation"

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
        noise = {"slip": slip, "wrong": wrong, "missing": missing}
        super().__init__(len(self.cubes), len(ACTION_SOURCES), 2, N_TAGS, render_mode=render_mode, **noise)

    @property
    def orientation(self) -> int:
        """The state of a cube, one of ``ORIENTATIONS``."""
        return self.state

    @orientation.setter
    def orientation(self, orientation: int) -> None:
        self.state = orientation

    def _n_states(self) -> int:
        return len(ORIENTATIONS)

    def _successor(self, action: int) -> int:
        return SUCCESSORS[self.orientation][action]

    def _pattern(self) -> tuple[int, ...]:
        return shown_pattern(self.cubes[self.object], self.orientation)
