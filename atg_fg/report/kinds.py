"""What a page says of the kinds of objects that a memory knows of."""

from __future__ import annotations

from typing import Final

from atg_fg.core.memory import RobotMemory
from atg_fg.learning.object_kinds import PLAIN_WORDS, kinds_of

#: Members of a kind that are named.
MOST_NAMED: Final = 20


def told_kinds(memory: RobotMemory | None) -> tuple[str, ...]:
    """Return in words which kinds of objects a memory knows of, and who is of them; nothing if there is but one."""
    kinds = [] if memory is None else [kind for kind in kinds_of(memory) if kind.members]
    if not any(kind.words != PLAIN_WORDS for kind in kinds):
        return ()
    return tuple(
        f"A kind of {len(kind.members)} object{'' if len(kind.members) == 1 else 's'}, {kind.words}: "
        f"{', '.join(kind.members[:MOST_NAMED])}{' …' if len(kind.members) > MOST_NAMED else ''}."
        for kind in kinds
    )


def told_kind(memory: RobotMemory | None, name: str | None) -> tuple[str, ...]:
    """Return in words what kind of thing an object is; nothing if the memory does not know of kinds."""
    if memory is None or name is None or name not in memory.names:
        return ()
    kinds, position = kinds_of(memory), memory.names.index(name)
    if len(kinds) == 1:
        return ()
    kind = max(kinds, key=lambda each: float(each.probabilities[position]))
    return (f"{name} is {kind}, with probability {kind.probabilities[position]:.2f}.",)
