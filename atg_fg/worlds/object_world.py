"""Worlds of objects other than ARcubes as gymnasium environments."""

from __future__ import annotations

from typing import Any

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import unknown_name
from atg_fg.worlds.base import FiniteStateWorld
from atg_fg.worlds.families import FAMILIES
from atg_fg.worlds.finite_objects import ObjectFamily


class ObjectWorld(FiniteStateWorld):
    """One object of a family, in any of its states; a reset draws object and state uniformly.

    Args:
        family: The objects, their actions and their alphabet.
        slip: Probability that an action fails and the object stays as it is.
        wrong: Probability that a look shows a pattern drawn uniformly from all patterns instead.
        missing: Probability, for each slot alone, that its symbol is not detected.

    ``reset(options={"object": i, "state": j})`` sets what is not to be drawn at random.
    """

    def __init__(
        self,
        family: ObjectFamily,
        *,
        slip: float = 0.0,
        wrong: float = 0.0,
        missing: float = 0.0,
        render_mode: str | None = None,
    ) -> None:
        self.family = family
        alphabet = family.alphabet
        sizes = (len(family.objects), len(family.actions), len(alphabet.slots), alphabet.n_symbols)
        super().__init__(*sizes, slip=slip, wrong=wrong, missing=missing, render_mode=render_mode)

    @property
    def assumptions(self) -> Assumptions:
        """What a robot in this world takes for granted."""
        return self.family.assumptions

    def _n_states(self) -> int:
        return self.family.objects[self.object].mechanism.n_states

    def _successor(self, action: int) -> int:
        return self.family.objects[self.object].mechanism.next_state(self.state, action, self.np_random)

    def _pattern(self) -> tuple[int, ...]:
        return self.family.objects[self.object].patterns[self.state]


def make_object_world(
    family: str,
    n_objects: int = 100,
    objects_seed: int = 0,
    *,
    slip: float = 0.0,
    wrong: float = 0.0,
    missing: float = 0.0,
    render_mode: str | None = None,
    **options: Any,
) -> ObjectWorld:
    """Return a world of ``n_objects`` objects of the family with this name, drawn by ``objects_seed``.

    Args:
        family: Name in ``FAMILIES``.
        n_objects: How many objects there are.
        objects_seed: Seed that they are drawn by.
        slip: As for ``ObjectWorld``.
        wrong: As for ``ObjectWorld``.
        missing: As for ``ObjectWorld``.
        render_mode: There is none but ``None``.
        options: Of the family.

    Raises:
        UnknownNameError: No family has this name.
        InvalidInputError: An option out of its range.
    """
    if family not in FAMILIES:
        raise unknown_name("family of objects", family, FAMILIES)
    objects = FAMILIES[family](n_objects, objects_seed, **options)
    return ObjectWorld(objects, slip=slip, wrong=wrong, missing=missing, render_mode=render_mode)
