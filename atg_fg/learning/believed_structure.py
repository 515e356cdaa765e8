"""What is believed of the kinds of objects: structures, and actions that are uncertain."""

from __future__ import annotations

from typing import NamedTuple

from atg_fg.core.patterns import FloatArray
from atg_fg.learning.plain_evidence import PlainNoise
from atg_fg.learning.shared_structure import SharedStructure


class BelievedStructure(NamedTuple):
    """A structure with the weight it has, and what it says of the K remembered objects.

    An object follows one of the structures, or is plain. Sets of structures exclude each other.

    Attributes:
        structure: The structure.
        weight: p(the sets that it is in | all trials).
        followers: Probability of each object to follow it, given that weight, shape [K].
        contents: What each object has in its registers, shape [K, P, S].
        share: Probability of an object that was never met to follow it, given that weight.
    """

    structure: SharedStructure
    weight: float
    followers: FloatArray
    contents: FloatArray
    share: float


class UncertainObjects(NamedTuple):
    """What is believed of plain objects whose actions are uncertain.

    Attributes:
        noise: α and δ of their ATGs.
        members: Probability of each remembered object to be one, shape [K].
        share: The same of an object that was never met.
    """

    noise: PlainNoise
    members: FloatArray
    share: float
