"""Goals: what the robot is to make an object show, a whole pattern or a part of one ("tag 7 in front")."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.checks import brief, instance
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.patterns import Detection, PatternAlphabet, read_only


@dataclass(frozen=True)
class Goal:
    """A pattern that an object is to show, or a part of one.

    Attributes:
        alphabet: The patterns there are.
        symbols: The symbol wanted in each slot, ``None`` where any will do.

    Raises:
        InvalidInputError: Not one entry a slot, not a symbol, a repeated one, or nothing wanted at all.
    """

    alphabet: PatternAlphabet
    symbols: Detection

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "symbols", instance(self.alphabet, "alphabet", PatternAlphabet).check_detection(self.symbols, "goal")
        )
        if not any(symbol is not None for symbol in self.symbols):
            raise InvalidInputError(f"goal: {list(self.symbols)!r}; expected a symbol in at least one slot")

    @classmethod
    def of_slots(cls, alphabet: PatternAlphabet, wanted: Mapping[str, int]) -> Goal:
        """Return the goal with the symbols ``wanted`` by the names of their slots, such as ``{"front": 7}``."""
        for slot in instance(wanted, "wanted", Mapping):
            if slot not in alphabet.slots:
                raise unknown_name("slot of a goal", slot, alphabet.slots)
        return cls(alphabet, tuple(wanted.get(slot) for slot in alphabet.slots))

    @classmethod
    def parse(cls, alphabet: PatternAlphabet, text: str) -> Goal:
        """Return the goal written as ``front=7`` or ``front=7,top=3``.

        Raises:
            InvalidInputError: Not of this form, or as for ``Goal``.
        """
        wanted: dict[str, int] = {}
        for part in instance(text, "goal", str).split(","):
            slot, separator, symbol = (piece.strip() for piece in part.partition("="))
            if not separator or not symbol.isdecimal() or len(symbol) > 20 or slot in wanted:
                raise InvalidInputError(f"goal: {brief(text)}; expected slot=symbol, such as front=7 or front=7,top=3")
            wanted[slot] = int(symbol)
        return cls.of_slots(alphabet, wanted)

    @cached_property
    def patterns(self) -> NDArray[np.bool_]:
        """Which patterns show the goal, shape [|𝒵|]."""
        shows = np.ones(len(self.alphabet), dtype=bool)
        for slot, symbol in enumerate(self.symbols):
            if symbol is not None:
                shows &= self.alphabet.symbols[:, slot] == symbol
        return read_only(shows)

    def likeness(self, pattern: int) -> int:
        """Return in how many of the slots that matter the pattern with this index is as wanted."""
        shown = self.alphabet.patterns[pattern]
        return sum(wanted is not None and wanted == symbol for wanted, symbol in zip(self.symbols, shown, strict=True))

    def __str__(self) -> str:
        wanted = zip(self.alphabet.slots, self.symbols, strict=True)
        return ",".join(f"{slot}={symbol}" for slot, symbol in wanted if symbol is not None)
