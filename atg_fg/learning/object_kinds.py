"""The kinds of objects that a memory knows of, as a person is told of them."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import FloatArray
from atg_fg.learning.plain_evidence import PlainNoise
from atg_fg.learning.shared_structure import SharedStructure
from atg_fg.learning.structured_memory import StructuredMemory

#: What a plain ATG is like.
PLAIN_WORDS: Final = "a graph of its own"


class ObjectKind(NamedTuple):
    """One kind of object.

    Attributes:
        words: What such objects are like, such as "6 places, 24 poses".
        members: Names of the remembered objects that are probably of it.
        probabilities: Of each remembered object to be of it, shape [K].
        share: The same of an object that was never met.
        structure: That they follow; ``None`` of plain ATGs.
    """

    words: str
    members: tuple[str, ...]
    probabilities: FloatArray
    share: float
    structure: SharedStructure | None

    def __str__(self) -> str:
        like = "that one" if len(self.members) == 1 else f"these {len(self.members)}"
        return f"a thing like {like}: {self.words}" if self.members else f"a thing like none yet: {self.words}"


def kinds_of(memory: RobotMemory) -> list[ObjectKind]:
    """Return the kinds that a memory knows of: those with a structure, best first, then the plain ones.

    Where nothing was learned of kinds, all objects are plain.
    """
    kinds: list[ObjectKind] = []
    left = np.ones(len(memory) + 1)

    def add(words: str, of: FloatArray, structure: SharedStructure | None) -> None:
        is_one = (of[:-1] > 0.5).tolist()
        members = tuple(name for name, member in zip(memory.names, is_one, strict=True) if member)
        kinds.append(ObjectKind(words, members, of[:-1], float(of[-1]), structure))

    if isinstance(memory, StructuredMemory):
        for each in memory.learner.believed(memory.names):
            of = each.weight * np.append(each.followers, each.share)
            left = left - of
            add(words_of_structure(each.structure), of, each.structure)
        uncertain = memory.learner.uncertain(memory.names)
        if uncertain is not None:
            of = np.append(uncertain.members, uncertain.share)
            left = left - of
            add(words_of_noise(uncertain.noise), of, None)
    add(PLAIN_WORDS, np.maximum(left, 0.0), None)
    return kinds


def words_of_structure(structure: SharedStructure) -> str:
    """Return what objects that follow a structure are like."""
    modes = f" in {structure.n_modes} modes" if structure.n_modes > 1 else ""
    return f"{structure.n_registers} places, {len(structure.poses().registers)} poses{modes}"


def words_of_noise(noise: PlainNoise) -> str:
    """Return what objects whose actions are uncertain are like."""
    return f"{PLAIN_WORDS} with uncertain actions, α = {noise.concentration:g}"
