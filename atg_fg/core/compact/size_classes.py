"""Objects that have the same number of known aspects, as counts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atg_fg.core.compact.columns import AnyIntArray
from atg_fg.core.patterns import FloatArray, IntArray


class SizeClasses:
    """For each number n of known aspects, how many objects have as many, and how many of these show each pattern.

    Args:
        n_patterns: |𝒵|.
        n_known: n of each object, shape [K].
        patterns: Pattern of each known aspect, object by object, shape [Σ n].
    """

    def __init__(self, n_patterns: int, n_known: AnyIntArray, patterns: AnyIntArray) -> None:
        lengths = n_known.astype(np.int64)
        sizes, number = np.unique(lengths, return_inverse=True)
        cells = np.repeat(number, lengths) * n_patterns + patterns
        showing = np.bincount(cells, minlength=len(sizes) * n_patterns).reshape(len(sizes), n_patterns)
        self._n_patterns = n_patterns
        self._row_of = {int(size): row for row, size in enumerate(sizes)}
        self._members = np.bincount(number, minlength=len(sizes)).astype(np.int64)
        self._showing = showing.astype(np.int32)

    @property
    def sizes(self) -> IntArray:
        """Each n that some object has or had, shape [C]."""
        return np.array(list(self._row_of), dtype=np.int64)

    @property
    def members(self) -> IntArray:
        """Number of objects of each n, shape [C]."""
        return self._members.copy()

    @property
    def showing(self) -> FloatArray:
        """Number of these that show each pattern, shape [C, |𝒵|]."""
        return self._showing.astype(np.float64)

    @property
    def nbytes(self) -> int:
        """Bytes that the counts take."""
        return self._showing.nbytes + self._members.nbytes

    def row_of_each(self, n_known: AnyIntArray) -> IntArray:
        """Return the row of each of some objects with n known aspects, of the shape of ``n_known``."""
        table = np.zeros(1 + max(self._row_of, default=0), dtype=np.int64)
        table[self.sizes] = np.arange(len(self._row_of))
        rows: IntArray = table[n_known]
        return rows

    def add(self, patterns: Sequence[int]) -> None:
        """Count an object that shows these patterns."""
        size = len(patterns)
        if size not in self._row_of:
            self._row_of[size] = len(self._row_of)
            self._members = np.append(self._members, 0)
            self._showing = np.vstack((self._showing, np.zeros((1, self._n_patterns), dtype=np.int32)))
        self._count(patterns, 1)

    def remove(self, patterns: Sequence[int]) -> None:
        """Stop counting an object that showed these patterns."""
        self._count(patterns, -1)

    def _count(self, patterns: Sequence[int], change: int) -> None:
        row = self._row_of[len(patterns)]
        self._members[row] += change
        self._showing[row, list(patterns)] += change
