"""The model's tables, made when they are first asked for: many an engine does without them as a rule."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Self

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import TooLargeError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.inference.recognition_model import RecognitionModel, Revelation

#: Objects times patterns, above which an engine for large memories refuses tables over both.
MAX_CELLS: Final = 5_000_000


class TablesOnDemand(RecognitionModel):
    """A ``RecognitionModel`` whose tables are made when one of them is asked for.

    Sizes and prior are there at once. Learning is put off until then: tables are laid aside when there is something to
    learn, so that of a model that nobody asks again they stay as they are.

    Args:
        memory: The robot memory when the trial begins.
        parameters: α, δ and whether to learn within the trial.
        prior: p(O) in place of the memory's.
        graphs: The ATGs of the memory as they are when the trial begins; if not given, it is asked for them later on.
        max_cells: Objects times patterns, above which tables over both are refused.

    Raises:
        InvalidInputError: ``prior`` is not a distribution over the objects of this memory.
        TooLargeError: On asking for a table, if there would be more than ``max_cells`` objects times patterns.
    """

    def __init__(
        self,
        memory: RobotMemory,
        parameters: ModelParameters,
        prior: IdentityBelief | None = None,
        *,
        graphs: Sequence[AspectTransitionGraph] | None = None,
        max_cells: int | None = None,
    ) -> None:
        self._set_sizes(memory, parameters, prior)
        self._graphs, self._max_cells = graphs, max_cells
        self._put_off: list[tuple[int | None, int | None, int | None]] | None = []
        self._laid_aside: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        """Make all tables if one of them is asked for."""
        put_off = self.__dict__.get("_put_off")
        if put_off is None or name.startswith("__"):
            raise AttributeError(name)
        self._make()
        return getattr(self, name)

    def _make(self) -> None:
        if self._put_off is None:
            return
        if self._max_cells is not None and self.n_hypotheses * self.n_patterns > self._max_cells:
            raise TooLargeError(
                f"tables over {self.n_hypotheses - 1} objects and {self.n_patterns} patterns; expected at most "
                f"{self._max_cells}: ask for identity, expected entropies or smoothed aspects, or another engine"
            )
        put_off, self._put_off = self._put_off, None
        if self._laid_aside:
            vars(self).update(self._laid_aside)
        else:
            there = set(vars(self))
            self._make_tables(list(self.memory) if self._graphs is None else self._graphs)
            self._laid_aside = dict.fromkeys(vars(self).keys() - there)  # their names
        for looked in put_off:
            super().learn(*looked)

    def __copy__(self) -> Self:
        """Return a model that what this one learns later does not reach."""
        self._make()
        twin = object.__new__(type(self))
        twin.__setstate__(vars(self))
        return twin

    def learn(self, previous: int | None, action: int | None, pattern: int | None) -> Revelation | None:
        """Put off to extend every hypothesis, as ``RecognitionModel.learn`` does, until tables are asked for.

        Returns:
            ``None``.
        """
        if self._put_off is None:
            self._laid_aside = {name: vars(self).pop(name) for name in self._laid_aside}
            self._put_off = []
        self._put_off.append((previous, action, pattern))
        return None
