"""A belief over identity with the names of the objects."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from atg_fg.errors import InvalidInputError, unknown_name
from atg_fg.html_table import Bar, Cell, HtmlTable

if TYPE_CHECKING:
    from atg_fg.belief import IdentityBelief

#: Objects that a table shows one by one.
SHOWN: Final = 5


class BeliefTable:
    """p(O | z, a) by name, the most probable objects first; shows itself in a notebook.

    Args:
        belief: Over as many remembered objects as there are names.
        names: Of the remembered objects, in the order of their index.
        shown: How many objects are shown one by one.

    Raises:
        InvalidInputError: Another number of names, or ``shown`` is below one.

    Attributes:
        belief: The belief.
        names: The names.
    """

    def __init__(self, belief: IdentityBelief, names: Sequence[str], shown: int = SHOWN) -> None:
        if len(names) != len(belief.objects):
            raise InvalidInputError(f"names: {len(names)}; expected one for each of {len(belief.objects)} objects")
        if shown < 1:
            raise InvalidInputError(f"shown: {shown!r}; expected a whole number of at least 1")
        self.belief, self.names, self.shown = belief, tuple(names), shown

    @property
    def unseen(self) -> float:
        """Probability that the object was never met."""
        return self.belief.unseen

    def __getitem__(self, name: str) -> float:
        """Return the probability of the remembered object of this name.

        Raises:
            UnknownNameError: None has this name.
        """
        if name not in self.names:
            raise unknown_name("belief", name, self.names)
        return float(self.belief.objects[self.names.index(name)])

    def __len__(self) -> int:
        """K, the number of remembered objects."""
        return len(self.names)

    def __iter__(self) -> Iterator[tuple[str, float]]:
        """Yield name and probability of every remembered object, the most probable first."""
        for index in np.argsort(-self.belief.objects, kind="stable"):
            yield self.names[index], float(self.belief.objects[index])

    def table(self) -> HtmlTable:
        """Return the table that is shown: the best objects, all others together, and *unseen*."""
        best = [pair for _, pair in zip(range(self.shown), self, strict=False)]
        rows: list[tuple[Cell, ...]] = [(name, _probability(value)) for name, value in best]
        others = len(self) - len(best)
        if others:
            rest = max(0.0, 1.0 - self.unseen - sum(value for _, value in best))
            rows.append((f"{others} {'other' if others == 1 else 'others'}", _probability(rest)))
        rows.append((f"unseen ({self.belief.n_unseen} never met)", _probability(self.unseen)))
        note = f"entropy {self.belief.entropy:.3f} nats; judged {self._verdict()}"
        return HtmlTable("Belief over identity", ("object", "probability"), tuple(rows), note)

    def _verdict(self) -> str:
        best = self.belief.most_probable_object
        return "novel" if self.belief.is_novel or best is None else f"known, {self.names[best]}"

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()

    def __repr__(self) -> str:
        return repr(self.table())


def _probability(value: float) -> Bar:
    return Bar(value, f"{value:.3f}")
