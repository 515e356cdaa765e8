"""Which dictionary the tags in an image are of."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.senses.tags import DICTIONARIES, DetectedTag, TagDetector, Tags, n_tags, tag_cells


def _families() -> dict[str, list[str]]:
    """Return the dictionaries whose tags are the first ones of a larger one, smallest first, by the largest."""
    families: dict[str, list[str]] = {}
    for name in sorted(DICTIONARIES, key=n_tags):
        families.setdefault(name.rsplit("_", 1)[0] if name[0].isdigit() else name, []).append(name)
    return {names[-1]: names for names in families.values()}


_FAMILIES: Final = _families()


def find_dictionary(image: NDArray[np.uint8]) -> str | None:
    """Return the smallest dictionary that has all tags in an image; ``None`` if there are no tags.

    The one with the most cells read without an error is taken: chance finds few tags, and finds those of few cells.
    """
    best: tuple[int, str, list[DetectedTag]] = (0, "", [])
    for name in _FAMILIES:
        found = [tag for tag in TagDetector(Tags(name, 1.0)).detect(image) if tag.distance == 0]
        cells = len(found) * (len(tag_cells(name, 0)) - 2) ** 2
        best = max(best, (cells, name, found), key=lambda each: each[0])
    _, name, found = best
    if not found:
        return None
    most = max(tag.id for tag in found)
    return next(small for small in _FAMILIES[name] if most < n_tags(small))
