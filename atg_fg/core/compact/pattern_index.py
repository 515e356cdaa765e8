"""Which objects show a pattern, and in which of their aspects."""

from __future__ import annotations

import numpy as np

from atg_fg.core.compact.columns import AnyIntArray, least_type
from atg_fg.core.patterns import IntArray

#: New entries are sorted in when they are more than this share of the others.
_SHARE = 0.25
_FEW = 256


class PatternIndex:
    """An inverted index from pattern to the (object, aspect) pairs that show it.

    Entries are sorted by pattern; new ones wait in short lists until there are enough of them to sort all anew, so that
    one costs O(1) on average.

    Args:
        n_patterns: |𝒵|.
        patterns: Pattern of each known aspect of all objects, shape [P].
        objects: Its object, shape [P].
        aspects: Its index in the object, shape [P].
        n_aspects: |G|; an object has at most as many.
    """

    def __init__(
        self, n_patterns: int, patterns: AnyIntArray, objects: AnyIntArray, aspects: AnyIntArray, n_aspects: int
    ) -> None:
        self._n_patterns = n_patterns
        self._n_aspects = n_aspects
        self._recent: dict[int, list[tuple[int, int]]] = {}
        self._n_recent = 0
        self._sort(patterns, objects, aspects)

    def _sort(self, patterns: AnyIntArray, objects: AnyIntArray, aspects: AnyIntArray) -> None:
        order = np.argsort(patterns, kind="stable")
        counts = np.bincount(patterns, minlength=self._n_patterns)
        self._starts = np.concatenate(([0], np.cumsum(counts)))
        self._objects = objects[order].astype(np.int32)
        self._aspects = aspects[order].astype(least_type(self._n_aspects))

    def __len__(self) -> int:
        return len(self._objects) + self._n_recent

    @property
    def nbytes(self) -> int:
        """Bytes that the sorted entries take."""
        return self._starts.nbytes + self._objects.nbytes + self._aspects.nbytes

    def add(self, pattern: int, shown_by: int, aspect: int) -> None:
        """Add an aspect of the object with index ``shown_by``."""
        self._recent.setdefault(pattern, []).append((shown_by, aspect))
        self._n_recent += 1
        if self._n_recent > _FEW + _SHARE * len(self._objects):
            recent = [(z, *pair) for z, pairs in self._recent.items() for pair in pairs]
            patterns, objects, aspects = np.array(recent, dtype=np.int64).T
            old = np.repeat(np.arange(self._n_patterns), np.diff(self._starts))
            self._recent, self._n_recent = {}, 0
            self._sort(
                np.concatenate((old, patterns)),
                np.concatenate((self._objects, objects)),
                np.concatenate((self._aspects, aspects)),
            )

    def showing(self, pattern: int) -> tuple[IntArray, IntArray]:
        """Return the objects that show a pattern and the aspects in which they do, both of shape [M]."""
        part = slice(self._starts[pattern], self._starts[pattern + 1])
        objects, aspects = self._objects[part].astype(np.int64), self._aspects[part].astype(np.int64)
        recent = self._recent.get(pattern)
        if recent:
            more = np.array(recent, dtype=np.int64)
            objects, aspects = np.append(objects, more[:, 0]), np.append(aspects, more[:, 1])
        return objects, aspects

    def showing_any(self, patterns: IntArray) -> IntArray:
        """Return the objects that show at least one of some patterns, ascending and each once, shape [M]."""
        found = [self.showing(int(pattern))[0] for pattern in patterns]
        return np.unique(np.concatenate(found)) if found else np.zeros(0, dtype=np.int64)

    def copy(self) -> PatternIndex:
        """Return an index that can be added to without touching this one."""
        twin = PatternIndex.__new__(PatternIndex)
        twin.__dict__.update(self.__dict__)
        twin._recent = {pattern: list(pairs) for pattern, pairs in self._recent.items()}
        return twin
