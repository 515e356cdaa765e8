"""A structure that is believed in, with what it says of the remembered objects."""

from __future__ import annotations

from typing import NamedTuple

from atg_fg.core.patterns import FloatArray
from atg_fg.learning.shared_structure import SharedStructure


class BelievedStructure(NamedTuple):
    """A structure with the weight it has, and what it says of the K remembered objects.

    Structures of one set are kinds beside each other: an object follows one of them or is plain. Sets exclude each
    other.

    Attributes:
        structure: The structure.
        weight: p(its set | all trials); with those of the other sets and of *no structure* it sums to one.
        followers: Probability of each object to follow it, shape [K].
        contents: What each object has in its registers, shape [K, P, S].
        share: Probability of an object that was never met to follow it.
        kinds: Number of its set.
    """

    structure: SharedStructure
    weight: float
    followers: FloatArray
    contents: FloatArray
    share: float
    kinds: int
