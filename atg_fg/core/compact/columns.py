"""Arrays that grow at their end, as lists do, without an object for each number."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import IntArray

#: An array of whole numbers of any width.
AnyIntArray = NDArray[np.integer[Any]]


class Column:
    """An array of whole numbers that is appended to at an amortised cost of O(1) an entry.

    Args:
        values: What it begins with; kept as it is, of their type.
    """

    def __init__(self, values: AnyIntArray) -> None:
        self._values = values
        self._length = len(values)

    @property
    def values(self) -> AnyIntArray:
        """The entries, as a view."""
        return self._values[: self._length]

    def __len__(self) -> int:
        return self._length

    @property
    def nbytes(self) -> int:
        """Bytes that the entries take."""
        return self.values.nbytes

    def extend(self, values: AnyIntArray | list[int]) -> None:
        """Append entries; numbers too large for the type widen it."""
        added = np.asarray(values, dtype=np.int64)
        if len(added) and int(added.max()) > np.iinfo(self._values.dtype).max:
            self._values = self.values.astype(np.int64)
        length = self._length + len(added)
        if length > len(self._values):
            grown = np.empty(max(length, 2 * len(self._values)), dtype=self._values.dtype)
            grown[: self._length] = self.values
            self._values = grown
        self._values[self._length : length] = added
        self._length = length

    def set(self, place: int, value: int) -> None:
        """Change one entry; a number too large for the type widens it."""
        if value > np.iinfo(self._values.dtype).max:
            self._values = self.values.astype(np.int64)
        self._values[place] = value

    def copy(self) -> Column:
        """Return a column that can grow without touching this one."""
        return Column(self.values.copy())


def least_type(greatest: int) -> type[np.integer[Any]]:
    """Return the least unsigned type that holds ``greatest``, int64 above 2^32 − 1."""
    for kind in (np.uint8, np.uint16, np.uint32):
        if greatest <= np.iinfo(kind).max:
            return kind
    return np.int64


def positions(starts: IntArray, lengths: IntArray) -> IntArray:
    """Return start, start + 1, … of each of some pieces [P], one piece after the other, shape [Σ lengths]."""
    total = int(lengths.sum())
    first = np.cumsum(lengths) - lengths
    places: IntArray = np.arange(total) + np.repeat(starts - first, lengths)
    return places
