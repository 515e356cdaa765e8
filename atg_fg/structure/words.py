"""A structure in words: the names of its registers, and what each action makes of what they hold."""

from __future__ import annotations

from collections.abc import Sequence

from atg_fg.structure.shared_structure import SharedStructure


def register_names(structure: SharedStructure, slots: Sequence[str]) -> tuple[str, ...]:
    """Return the name of each register: that of its slot, or "c3" for the third one, which is hidden."""
    hidden = range(structure.n_slots, structure.n_registers)
    return (*slots, *(f"c{register + 1}" for register in hidden))


def permutation_text(sources: Sequence[int], names: Sequence[str]) -> str:
    """Return what an action does, such as "front ← top, top ← c3, …": what each register takes its content from.

    Args:
        sources: The register that each register takes its content from, P of them.
        names: Of the registers.
    """
    moved = [f"{names[register]} ← {names[source]}" for register, source in enumerate(sources) if source != register]
    return ", ".join(moved) or "nothing moves"


def cycles(sources: Sequence[int]) -> list[list[int]]:
    """Return the ways that contents go, each from register to register and back to its first, longest first."""
    goes_to = {source: register for register, source in enumerate(sources)}
    found, left = [], set(goes_to)
    for first in range(len(sources)):
        if first in left:
            way = [first]
            while goes_to[way[-1]] != first:
                way.append(goes_to[way[-1]])
            left -= set(way)
            found.append(way)
    return sorted((way for way in found if len(way) > 1), key=len, reverse=True)
