"""A structure in words: the names of its registers, and what each action makes of what they hold."""

from __future__ import annotations

from collections.abc import Sequence

from atg_fg.learning.shared_structure import SharedStructure


def register_names(structure: SharedStructure, slots: Sequence[str]) -> tuple[str, ...]:
    """Return the name of each register: that of its slot, or "c3" for the third one, which is hidden."""
    hidden = range(structure.n_slots, structure.n_registers)
    return (*slots, *(f"c{register + 1}" for register in hidden))


def action_text(sources: Sequence[int], names: Sequence[str]) -> str:
    """Return what an action does, such as "front ← top, top ← c3, …": what each register takes its content from.

    What is lost is said too: "top ← c6; lost: top".

    Args:
        sources: The register that each register takes its content from, P of them.
        names: Of the registers.
    """
    moved = [f"{names[register]} ← {names[source]}" for register, source in enumerate(sources) if source != register]
    gone = [names[register] for register in lost(sources)]
    return (", ".join(moved) or "nothing moves") + (f"; lost: {', '.join(gone)}" if gone else "")


def lost(sources: Sequence[int]) -> list[int]:
    """Return the registers whose content no register has after an action; none if it is a permutation."""
    return sorted(set(range(len(sources))) - set(sources))


def cycles(sources: Sequence[int]) -> list[list[int]]:
    """Return the ways that contents go round, each from register to register and back to its first, longest first."""
    found, left = [], set(range(len(sources)))
    for first in range(len(sources)):
        way = [first]  # against the arrows, as each register has one source
        while sources[way[-1]] in left - set(way):
            way.append(sources[way[-1]])
        if first in left and sources[way[-1]] == first:
            left -= set(way)
            found.append([first, *reversed(way[1:])])
    return sorted((way for way in found if len(way) > 1), key=len, reverse=True)


def copies(sources: Sequence[int]) -> list[tuple[int, int]]:
    """Return the pairs (from, to) of registers between which contents go without ever going round."""
    round_about = {register for way in cycles(sources) for register in way}
    pairs = ((source, register) for register, source in enumerate(sources) if source != register)
    return [(source, register) for source, register in pairs if register not in round_about]
