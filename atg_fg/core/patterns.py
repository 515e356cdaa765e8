"""Patterns an aspect can show, and evidence about them.

A pattern has one symbol in each *slot* (for an ARcube: the tag in front and the tag on top), all
different. Evidence is a likelihood over the whole pattern alphabet 𝒵: complete, partial, none or soft.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atg_fg.core.errors import InvalidInputError

FloatArray: TypeAlias = NDArray[np.float64]


IntArray: TypeAlias = NDArray[np.int64]


Pattern: TypeAlias = tuple[int, ...]


Detection: TypeAlias = tuple[int | None, ...]


#: What stands in an array for the symbol of a slot where nothing was detected.
MISSING: Final = -1


MAX_PATTERNS: Final = 100_000


@dataclass(frozen=True)
class PatternAlphabet:
    """All ordered tuples of distinct symbols, one symbol a slot, in lexicographic order.

    Attributes:
        slots: Names of the slots, all different.
        n_symbols: Number of symbols; they are numbered from 0.

    Raises:
        InvalidInputError: No slots, repeated slots, fewer symbols than slots, or over
            ``MAX_PATTERNS`` patterns.
    """

    slots: tuple[str, ...]
    n_symbols: int

    def __post_init__(self) -> None:
        if not self.slots or len(set(self.slots)) != len(self.slots):
            raise InvalidInputError(f"slots: {list(self.slots)!r}; expected at least one name, all different")
        if isinstance(self.slots, str) or not all(isinstance(slot, str) for slot in self.slots):
            raise InvalidInputError(f"slots: {self.slots!r}; expected a tuple of names")
        if isinstance(self.n_symbols, bool) or not isinstance(self.n_symbols, int):
            raise InvalidInputError(f"n_symbols: {self.n_symbols!r}; expected a whole number")
        if self.n_symbols < len(self.slots):
            raise InvalidInputError(
                f"n_symbols: {self.n_symbols}; expected at least one symbol for each of {len(self.slots)} slots"
            )
        n_patterns = 1
        for slot in range(len(self.slots)):
            n_patterns *= self.n_symbols - slot
            if n_patterns > MAX_PATTERNS:
                raise InvalidInputError(
                    f"n_symbols: {self.n_symbols} symbols in {len(self.slots)} slots make too many patterns; "
                    f"expected at most {MAX_PATTERNS}"
                )

    def __len__(self) -> int:
        """|𝒵|, the number of patterns."""
        return math.perm(self.n_symbols, len(self.slots))

    @cached_property
    def patterns(self) -> tuple[Pattern, ...]:
        """Every pattern, in the order of its index."""
        return tuple(itertools.permutations(range(self.n_symbols), len(self.slots)))

    @cached_property
    def symbols(self) -> IntArray:
        """Symbols of every pattern, shape [|𝒵|, slots]."""
        return np.array(self.patterns, dtype=np.int64)

    @cached_property
    def _index_of(self) -> dict[Detection, int]:
        return {pattern: index for index, pattern in enumerate(self.patterns)}

    def index(self, pattern: Sequence[int]) -> int:
        """Return the index of a pattern.

        Raises:
            InvalidInputError: Not one symbol for each slot, out of range, or repeated.
        """
        return self._index_of[self.check_pattern(pattern)]

    def check_pattern(self, pattern: Sequence[int], place: str = "pattern") -> Pattern:
        """Return ``pattern`` as a tuple of integers, or raise ``InvalidInputError`` naming ``place``."""
        detection = self.check_detection(pattern, place)
        if None in detection:
            raise InvalidInputError(f"{place}: {list(pattern)!r} has a missing symbol; expected a complete pattern")
        return tuple(symbol for symbol in detection if symbol is not None)

    def check_detection(self, detection: Sequence[int | None], place: str = "detection") -> Detection:
        """Return ``detection`` as a tuple, or raise ``InvalidInputError`` naming ``place``."""
        if isinstance(detection, str) or not hasattr(detection, "__len__") or len(detection) != len(self.slots):
            raise InvalidInputError(
                f"{place}: {detection!r}; expected one entry for each of {len(self.slots)} slots: "
                f"{', '.join(self.slots)}"
            )
        symbols: list[int | None] = []
        for slot, symbol in zip(self.slots, detection, strict=True):
            if symbol is None:
                symbols.append(None)
                continue
            if isinstance(symbol, (bool, np.bool_)) or not isinstance(symbol, (int, np.integer)):
                raise InvalidInputError(f"{place}, slot {slot!r}: {symbol!r}; expected a whole number or null")
            if not 0 <= symbol < self.n_symbols:
                raise InvalidInputError(f"{place}, slot {slot!r}: symbol {symbol}; expected 0 to {self.n_symbols - 1}")
            if int(symbol) in symbols:
                raise InvalidInputError(f"{place}, slot {slot!r}: symbol {symbol} is repeated; expected all different")
            symbols.append(int(symbol))
        return tuple(symbols)


@dataclass(frozen=True, eq=False)
class Evidence:
    """What one look says about the pattern shown: a likelihood of each pattern.

    Attributes:
        likelihood: Non-negative weights, shape [|𝒵|]; 1 where a detection agrees, 0 where not.
        pattern: Index of the pattern if the detection was complete, else ``None``.
    """

    likelihood: FloatArray
    pattern: int | None = None

    @classmethod
    def of_detection(cls, alphabet: PatternAlphabet, detection: Sequence[int | None]) -> Evidence:
        """Evidence of a detection, ``None`` in each slot where nothing was seen.

        Raises:
            InvalidInputError: The detection does not fit the alphabet.
        """
        checked = alphabet.check_detection(detection)
        pattern = alphabet._index_of.get(checked)
        if pattern is not None:
            likelihood = np.zeros(len(alphabet))
            likelihood[pattern] = 1.0
            return cls(likelihood, pattern)
        agrees = np.ones(len(alphabet), dtype=bool)
        for slot, symbol in enumerate(checked):
            if symbol is not None:
                agrees &= alphabet.symbols[:, slot] == symbol
        return cls(agrees.astype(np.float64))

    @classmethod
    def of_likelihood(cls, alphabet: PatternAlphabet, likelihood: ArrayLike) -> Evidence:
        """Soft evidence: any finite non-negative vector of shape [|𝒵|] that is not all zero.

        Raises:
            InvalidInputError: Wrong shape, a negative or non-finite entry, or all zero.
        """
        try:
            evidence = cls(np.array(likelihood, dtype=np.float64))
        except (TypeError, ValueError) as error:
            raise InvalidInputError(f"evidence: {likelihood!r}; expected numbers") from error
        evidence.check(len(alphabet))
        if not evidence.likelihood.any():
            raise InvalidInputError("evidence: all zero; expected at least one pattern that it is possible under")
        return evidence

    def check(self, n_patterns: int) -> None:
        """Raise ``InvalidInputError`` if this is no likelihood over ``n_patterns`` patterns."""
        if self.likelihood.shape != (n_patterns,):
            raise InvalidInputError(f"evidence: shape {self.likelihood.shape}; expected ({n_patterns},)")
        total = self.likelihood.sum()
        if not (self.likelihood.min() >= 0 and total < np.inf):
            raise InvalidInputError(
                f"evidence: least {self.likelihood.min()}, sum {total}; expected non-negative numbers with a finite sum"
            )
