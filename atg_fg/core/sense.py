"""What turns readings of a camera or another sensor into evidence about patterns, for a memory that has one.

A memory without a sense takes what a world says for symbols.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol, Self, TypeAlias

from atg_fg.core.patterns import Detection, Evidence, SlotLikelihoods

#: What was measured in one slot, ``None`` where nothing was seen.
Reading: TypeAlias = tuple[float, ...] | None
#: What was measured in each slot at one look.
Readings: TypeAlias = tuple[Reading, ...]


class SensedLook(NamedTuple):
    """What a sense makes of one look.

    Attributes:
        evidence: The likelihood of each pattern; its detection is the most probable class in each slot, with its
            probability as confidence. Where none is probable enough, its ``slots`` have the likelihood of each.
        readings: What it was made from.
    """

    evidence: Evidence
    readings: Readings


class SenseTrial(Protocol):
    """A sense within one trial: classes that are met in it are known from then on."""

    def look(self, observation: Any) -> SensedLook:
        """Take in what a world says at a look."""


class SensedTrial(NamedTuple):
    """A trial as a sense keeps it.

    Attributes:
        owner: Name of the ATG that it went to.
        readings: Of each look, t + 1 of them.
        detections: What they were taken for.
        actions: Index of the action between each two looks, t of them.
    """

    owner: str
    readings: tuple[Readings, ...]
    detections: tuple[Detection, ...]
    actions: tuple[int, ...]


class Sense(Protocol):
    """What a memory knows of appearances, from the readings of all its trials.

    Attributes:
        trials: All that was learned from, in their order.
    """

    trials: list[SensedTrial]

    @property
    def features(self) -> str:
        """Name of what makes the readings."""

    def begin(self) -> SenseTrial:
        """Return a copy for one trial; the sense itself learns at its end."""

    def check_space(self, space: Any) -> None:
        """Raise ``InvalidInputError`` unless these are observations that the sense can read."""

    def learn(self, trial: SensedTrial) -> list[tuple[Detection, ...]] | None:
        """Learn from a trial that has ended.

        At milestones all readings are looked at again. Then what each trial's looks are taken for from now on is
        returned if that has changed.
        """

    def copy(self) -> Self:
        """Return a sense that can learn without touching this one."""

    def __eq__(self, other: object) -> bool: ...


def likelihoods_of(looks: Sequence[dict[str, Any]]) -> tuple[SlotLikelihoods, ...]:
    """Return the likelihoods of slots that a sense was not sure of, in the ``info`` of each look; empty if none."""
    found = tuple(
        tuple(None if slot is None else tuple(map(float, slot)) for slot in look.get("likelihoods") or ())
        for look in looks
    )
    return found if any(found) else ()


def readings_of(looks: Sequence[dict[str, Any]]) -> tuple[Readings, ...]:
    """Return the readings in the ``info`` of each look; empty unless all looks have some."""
    found = [look.get("readings") for look in looks]
    if any(each is None for each in found):
        return ()
    return tuple(
        tuple(None if slot is None else tuple(float(value) for value in slot) for slot in look)
        for look in found
        if look is not None
    )
