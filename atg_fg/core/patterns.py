"""Patterns an aspect can show, and evidence about them.

A pattern has one symbol in each *slot* (for an ARcube: the tag in front and the tag on top), all different unless the
alphabet says otherwise. Evidence is a likelihood over the whole pattern alphabet 𝒵: complete, partial, none or soft.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atg_fg.core.checks import brief, distinct_names, is_sequence, listed, plain_text, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.slot_checks import check_confidences, check_slots

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
Pattern: TypeAlias = tuple[int, ...]
Detection: TypeAlias = tuple[int | None, ...]
#: How sure a detector says it is of each slot's symbol, on a scale of its own; ``None`` where it does not say.
Confidences: TypeAlias = tuple[float | None, ...]
#: Likelihood of each symbol in each slot, ``None`` for a slot without one.
SlotLikelihoods: TypeAlias = tuple[tuple[float, ...] | None, ...]
#: Readings of the object as a whole, such as its weight, each with the name of its sense.
Measured: TypeAlias = tuple[tuple[str, float], ...]
Array = TypeVar("Array", bound=NDArray[Any])
#: What stands in an array for the symbol of a slot where nothing was detected.
MISSING: Final = -1
#: Least noise and concentration of a model besides zero, and least weight of evidence beside the greatest: products of
#: a few of them are still numbers.
LEAST_SHARE: Final = 1e-100

MAX_PATTERNS: Final = 100_000
MAX_SLOTS: Final = 16  # two symbols in more make more patterns

#: Patterns up to which evidence of each of them is kept: 8 MB of weights.
_MOST_KEPT: Final = 1000


def read_only(array: Array) -> Array:
    """Return an array after making it one that cannot be written to."""
    array.setflags(write=False)
    return array


def protect(values: Iterable[Any]) -> None:
    """Make the arrays among some values, and in tuples among them, such that they cannot be written to."""
    for value in values:
        if isinstance(value, np.ndarray):
            read_only(value)
        elif isinstance(value, tuple):
            protect(value)


@dataclass(frozen=True)
class PatternAlphabet:
    """All ordered tuples of symbols, one symbol a slot, in lexicographic order.

    Attributes:
        slots: Names of the slots, all different.
        n_symbols: Number of symbols; they are numbered from 0.
        exclusive: Whether a symbol is in one slot only, as a tag on a cube is; if not, patterns may repeat it.
        names: Of the symbols, by which they can be given wherever a number can; none if they have numbers only.
        is_open: Whether there may be symbols that were not met yet, which ``extended`` adds.

    Raises:
        InvalidInputError: No slots, repeated slots, fewer symbols than slots that exclude each other, other names than
            one a symbol, an open alphabet without names, or over ``MAX_PATTERNS`` patterns.
    """

    slots: tuple[str, ...]
    n_symbols: int
    exclusive: bool = True
    names: tuple[str, ...] = ()
    is_open: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "slots", distinct_names(self.slots, "slots"))
        object.__setattr__(self, "n_symbols", whole_number(self.n_symbols, "n_symbols"))
        for field in ("exclusive", "is_open"):
            if not isinstance(getattr(self, field), bool):
                raise InvalidInputError(f"{field}: {getattr(self, field)!r}; expected true or false")
        if self.names or self.is_open:
            object.__setattr__(self, "names", distinct_names(self.names, "names of symbols"))
            if len(self.names) != self.n_symbols:
                raise InvalidInputError(f"names of symbols: {len(self.names)}; expected {self.n_symbols}, one a symbol")
        least = len(self.slots) if self.exclusive else 1
        if self.n_symbols < least:
            raise InvalidInputError(
                f"n_symbols: {self.n_symbols}; expected at least one symbol for each of {least} slots"
            )
        n_patterns = 1
        for slot in range(len(self.slots)):
            n_patterns *= self.n_symbols - slot if self.exclusive else self.n_symbols
            if n_patterns > MAX_PATTERNS or slot == MAX_SLOTS:
                raise InvalidInputError(
                    f"n_symbols: {brief(self.n_symbols)} symbols in {len(self.slots)} slots make too many patterns; "
                    f"expected at most {MAX_PATTERNS}, and {MAX_SLOTS} slots"
                )

    @classmethod
    def named(
        cls, slots: Sequence[str], names: Sequence[str], *, exclusive: bool = True, is_open: bool = False
    ) -> PatternAlphabet:
        """Return the alphabet of the symbols with these names; for the rest see the class."""
        known = distinct_names(names, "names of symbols")
        return cls(distinct_names(slots, "slots"), len(known), exclusive, known, is_open)

    def extended(self, names: Iterable[str]) -> PatternAlphabet:
        """Return an open alphabet with those of the names that it lacks, after its own.

        Raises:
            InvalidInputError: The alphabet is not open, and lacks one; or one is no name.
        """
        if isinstance(names, (str, Mapping, Set)) or not isinstance(names, Iterable):  # a set has no order
            raise InvalidInputError(f"names of symbols: {brief(names)}; expected names")
        names = [plain_text(name, "name of a symbol") for name in names]
        new = [name for name in dict.fromkeys(names) if name not in self._number_of]
        if new and not self.is_open:
            raise InvalidInputError(f"symbol {brief(new[0])}; expected one of: {listed(self.names)}")
        return replace(self, n_symbols=self.n_symbols + len(new), names=(*self.names, *new)) if new else self

    @cached_property
    def _number_of(self) -> dict[str, int]:
        return {name: number for number, name in enumerate(self.names)}

    def name_of(self, symbol: int | None) -> str:
        """Return the name of a symbol, its number if it has none, or a dash where none was seen."""
        if symbol is None:
            return "–"
        return self.names[symbol] if self.names else str(symbol)

    def text(self, pattern: Sequence[int | None]) -> str:
        """Return the names of a pattern's symbols, or of what was seen of it, in brackets."""
        return f"({', '.join(map(self.name_of, pattern))})"

    def __len__(self) -> int:
        """|𝒵|, the number of patterns."""
        if self.exclusive:
            return math.perm(self.n_symbols, len(self.slots))
        return int(self.n_symbols ** len(self.slots))

    @cached_property
    def patterns(self) -> tuple[Pattern, ...]:
        """Every pattern, in the order of its index."""
        if self.exclusive:
            return tuple(itertools.permutations(range(self.n_symbols), len(self.slots)))
        return tuple(itertools.product(range(self.n_symbols), repeat=len(self.slots)))

    @cached_property
    def symbols(self) -> IntArray:
        """Symbols of every pattern, shape [|𝒵|, slots]."""
        return read_only(np.array(self.patterns, dtype=np.int64))

    @cached_property
    def _index_of(self) -> dict[Detection, int]:
        return {pattern: index for index, pattern in enumerate(self.patterns)}

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_whole_looks"}

    @cached_property
    def _whole_looks(self) -> dict[Detection, Evidence]:
        """Evidence of complete detections; it cannot be changed, and so serves many looks."""
        return {}

    def index(self, pattern: Sequence[int | str]) -> int:
        """Return the index of a pattern.

        Raises:
            InvalidInputError: Not one symbol for each slot, out of range, or repeated.
        """
        return self._index_of[self.check_pattern(pattern)]

    def slot_likelihoods(self, likelihood: FloatArray) -> FloatArray:
        """Return what a likelihood over 𝒵 says of each slot's symbol alone, summed over the others, shape [J, V].

        With one slot that is the likelihood itself; with more it is what slots that know nothing of each other keep.
        """
        sums = [np.bincount(symbols, likelihood, self.n_symbols) for symbols in self.symbols.T]
        scale = np.append(1.0, np.full(len(sums) - 1, 1.0 / max(likelihood.sum(), np.finfo(float).tiny)))
        result: FloatArray = np.array(sums) * scale[:, None]
        return result

    def check_pattern(self, pattern: Sequence[int | str], place: str = "pattern") -> Pattern:
        """Return ``pattern`` as a tuple of integers, or raise ``InvalidInputError`` naming ``place``."""
        detection = self.check_detection(pattern, place)
        if None in detection:
            raise InvalidInputError(f"{place}: {list(pattern)!r} has a missing symbol; expected a complete pattern")
        return tuple(symbol for symbol in detection if symbol is not None)

    def check_detection(self, detection: Sequence[int | str | None], place: str = "detection") -> Detection:
        """Return the numbers of the symbols of ``detection``, or raise ``InvalidInputError`` naming ``place``."""
        if not is_sequence(detection) or len(detection) != len(self.slots):
            raise InvalidInputError(
                f"{place}: {brief(detection)}; expected one entry for each of {len(self.slots)} slots: "
                f"{listed(self.slots)}"
            )
        symbols: list[int | None] = []
        for slot, symbol in zip(self.slots, detection, strict=True):
            if symbol is None:
                symbols.append(None)
                continue
            if isinstance(symbol, str) and self.names:
                if symbol not in self._number_of:
                    raise InvalidInputError(
                        f"{place}, slot {slot!r}: {brief(symbol)}; expected one of: {listed(self.names)}"
                    )
                symbol = self._number_of[symbol]
            if isinstance(symbol, (bool, np.bool_)) or not isinstance(symbol, (int, np.integer)):
                raise InvalidInputError(f"{place}, slot {slot!r}: {brief(symbol)}; expected a whole number or null")
            if not 0 <= symbol < self.n_symbols:
                found = brief(symbol)
                raise InvalidInputError(f"{place}, slot {slot!r}: symbol {found}; expected 0 to {self.n_symbols - 1}")
            if self.exclusive and int(symbol) in symbols:
                raise InvalidInputError(f"{place}, slot {slot!r}: symbol {symbol} is repeated; expected all different")
            symbols.append(int(symbol))
        return tuple(symbols)


@dataclass(frozen=True, eq=False)
class Evidence:
    """What one look says about the pattern shown: a likelihood of each pattern.

    Attributes:
        likelihood: Non-negative weights, shape [|𝒵|]; 1 where a detection agrees, 0 where not. A copy of its own, which
            cannot be written to.
        pattern: Index of the pattern if the detection was complete, else ``None``.
        detection: The symbol in each slot as it was seen, if the evidence is of a detection.
        confidences: Of each of these symbols; empty if the detector says nothing of it.
        slots: Likelihood of each symbol in each slot, ``None`` for a slot without one; empty if not given slot by
            slot.
        measured: Readings of the object as a whole; they say nothing of the pattern.
    """

    likelihood: FloatArray
    pattern: int | None = None
    detection: Detection | None = None
    confidences: Confidences = ()
    slots: SlotLikelihoods = ()
    measured: Measured = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "likelihood", read_only(np.array(self.likelihood, dtype=np.float64)))

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        given = (self.likelihood, self.pattern, self.detection, self.confidences, self.slots, self.measured)
        return Evidence, given  # so that no copy can be written to, either

    @classmethod
    def of_detection(
        cls, alphabet: PatternAlphabet, detection: Sequence[int | str | None], confidences: Sequence[float | None] = ()
    ) -> Evidence:
        """Evidence of a detection, ``None`` in each slot where nothing was seen.

        Args:
            alphabet: The patterns.
            detection: The symbol in each slot, its number or its name.
            confidences: Of each symbol, for models that learn what they mean; the likelihood takes no notice of them.

        Raises:
            InvalidInputError: The detection does not fit the alphabet, or the confidences do not fit the detection.
        """
        # Most looks are whole, without confidences, and not the first of their kind. True and 1.0 are no symbols.
        if type(detection) is type(confidences) is tuple and not confidences and set(map(type, detection)) == {int}:
            found = alphabet._whole_looks.get(detection)
            if found is not None:
                return found
        checked = alphabet.check_detection(detection)
        stated = check_confidences(confidences, len(checked))
        pattern = alphabet._index_of.get(checked)
        if pattern is not None:
            likelihood = np.zeros(len(alphabet))
            likelihood[pattern] = 1.0
            evidence = cls(likelihood, pattern, checked, stated)
            vars(evidence)["_range"] = (0.0, 1.0, 1.0)  # spares looking for it: most looks are such
            if not stated and len(alphabet) <= _MOST_KEPT:
                alphabet._whole_looks[checked] = evidence
            return evidence
        agrees = np.ones(len(alphabet), dtype=bool)
        for slot, symbol in enumerate(checked):
            if symbol is not None:
                agrees &= alphabet.symbols[:, slot] == symbol
        return cls(agrees.astype(np.float64), None, checked, stated)

    @classmethod
    def of_slots(
        cls,
        alphabet: PatternAlphabet,
        likelihoods: Sequence[ArrayLike | None],
        detection: Sequence[int | str | None] = (),
        confidences: Sequence[float | None] = (),
    ) -> Evidence:
        """Evidence that is a likelihood of the symbols of some slots, and of a detection in the others.

        The likelihood of a pattern is the product over slots; slots are independent of each other given the pattern.

        Args:
            alphabet: The patterns.
            likelihoods: Of each symbol in each slot, non-negative and not all zero, shape [V]; ``None`` of a slot for
                which the detection counts.
            detection: The symbol in each slot; ``None`` where nothing was seen, and where there is a likelihood.
            confidences: As for ``of_detection``.

        Raises:
            InvalidInputError: Anything does not fit the alphabet, or no pattern is possible.
        """
        hard = cls.of_detection(alphabet, detection or (None,) * len(alphabet.slots), confidences)
        slots = check_slots(likelihoods, alphabet.slots, alphabet.n_symbols)
        product = hard.likelihood.copy()
        for slot, weights in enumerate(slots):
            if weights is not None:
                if hard.detection is not None and hard.detection[slot] is not None:
                    raise InvalidInputError(
                        f"evidence, slot {alphabet.slots[slot]!r}: a symbol and a likelihood; expected one of them"
                    )
                product *= np.array(weights)[alphabet.symbols[:, slot]]
        if not product.any():
            raise InvalidInputError("evidence: all zero; expected at least one pattern that it is possible under")
        if not any(slots):
            return hard
        return cls(product, None, hard.detection, hard.confidences, slots)

    @classmethod
    def of_likelihood(cls, alphabet: PatternAlphabet, likelihood: ArrayLike) -> Evidence:
        """Soft evidence: any finite non-negative vector of shape [|𝒵|] that is not all zero.

        Raises:
            InvalidInputError: Wrong shape, a negative or non-finite entry, or all zero.
        """
        try:
            evidence = cls(np.array(likelihood, dtype=np.float64))
        except (TypeError, ValueError, OverflowError) as error:
            raise InvalidInputError(f"evidence: {brief(likelihood)}; expected numbers") from error
        evidence.check(len(alphabet))
        if not evidence.likelihood.any():
            raise InvalidInputError("evidence: all zero; expected at least one pattern that it is possible under")
        return evidence

    def with_readings(self, measured: Measured) -> Evidence:
        """Return this evidence with these readings of the object as a whole; itself if there are none."""
        return replace(self, measured=measured) if measured or self.measured else self

    @cached_property
    def _range(self) -> tuple[float, float, float]:
        """The least weight, the least above zero (∞ if there is none), and the greatest; NaN if one of them is."""
        weights = self.likelihood
        return float(weights.min()), float(weights.min(where=weights > 0, initial=np.inf)), float(weights.max())

    def check(self, n_patterns: int) -> None:
        """Raise ``InvalidInputError`` if this is no likelihood over ``n_patterns`` patterns."""
        if self.likelihood.shape != (n_patterns,):
            raise InvalidInputError(f"evidence: shape {self.likelihood.shape}; expected ({n_patterns},)")
        least, _, greatest = self._range
        if not (least >= 0 and greatest < np.inf):  # a NaN is neither
            raise InvalidInputError(f"evidence: weights from {least} to {greatest}; expected finite ones of at least 0")
        if self.pattern is not None:
            whole_number(self.pattern, "evidence: pattern", 0, n_patterns - 1)

    def scaled(self) -> tuple[Evidence, float]:
        """Return this evidence as engines take it, and ln of what it was divided by.

        Weights below ``LEAST_SHARE`` of the greatest count as zero: no engine could tell what becomes of them. If the
        greatest is below ``LEAST_SHARE`` or above its inverse, all are divided by it.
        """
        weights, (_, least_above_zero, greatest) = self.likelihood, self._range
        if least_above_zero < LEAST_SHARE * greatest:
            weights = np.where(weights < LEAST_SHARE * greatest, 0.0, weights)
        if greatest and not LEAST_SHARE <= greatest <= 1 / LEAST_SHARE:
            return replace(self, likelihood=weights / greatest), math.log(greatest)
        return (self if weights is self.likelihood else replace(self, likelihood=weights)), 0.0
