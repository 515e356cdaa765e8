"""What the robot takes for granted before it meets any object (section 3 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass

from atg_fg.core.checks import brief, distinct_names, listed, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import ObjectSense, check_object_senses
from atg_fg.core.patterns import PatternAlphabet

#: Whole numbers up to here are exact as floating-point numbers.
MAX_NUMBER = 2**53


@dataclass(frozen=True)
class Assumptions:
    """How many objects and aspects there are, what the robot can do and what it can see.

    Attributes:
        n_objects: |O|, the objects that exist in the environment.
        n_aspects: |G|, the aspects of each object; at most |𝒵|.
        actions: Names of the actions, all different.
        alphabet: The patterns one aspect can show.
        object_senses: What the robot can feel of an object as a whole, such as its weight.

    Raises:
        InvalidInputError: A number below one, no or repeated actions, |G| > |𝒵|, or senses of the object that do not
            fit.
    """

    n_objects: int
    n_aspects: int
    actions: tuple[str, ...]
    alphabet: PatternAlphabet
    object_senses: tuple[ObjectSense, ...] = ()

    def __post_init__(self) -> None:
        for field in ("n_objects", "n_aspects"):
            object.__setattr__(self, field, whole_number(getattr(self, field), field, 1, MAX_NUMBER))
        object.__setattr__(self, "actions", distinct_names(self.actions, "actions"))
        if not isinstance(self.alphabet, PatternAlphabet):
            raise InvalidInputError(f"alphabet: {brief(self.alphabet)}; expected a PatternAlphabet")
        if self.n_aspects > len(self.alphabet):
            raise InvalidInputError(
                f"n_aspects: {self.n_aspects}; expected at most the {len(self.alphabet)} patterns there are, "
                "since the aspects of one object are unique"
            )
        senses = check_object_senses(self.object_senses, self.actions, self.alphabet.slots)
        object.__setattr__(self, "object_senses", senses)

    def extends(self, other: Assumptions) -> bool:
        """Return whether these are the other assumptions, perhaps with labels added to their open alphabet."""
        ours, theirs = (
            (
                each.n_objects,
                each.n_aspects,
                each.actions,
                each.object_senses,
                each.alphabet.slots,
                each.alphabet.exclusive,
            )
            for each in (self, other)
        )
        both_are_open = self.alphabet.is_open and other.alphabet.is_open
        known = other.alphabet.names
        return self == other or (both_are_open and ours == theirs and self.alphabet.names[: len(known)] == known)

    def action_of(self, action: int | str, place: str = "action") -> int:
        """Return the index of an action given by index or name, or raise ``InvalidInputError`` naming ``place``."""
        if isinstance(action, str):
            return self.action_index(action, place)
        return whole_number(action, place, 0, len(self.actions) - 1)

    def action_index(self, name: str, place: str = "action") -> int:
        """Return the index of an action, or raise ``InvalidInputError`` naming ``place``."""
        if not isinstance(name, str) or name not in self.actions:
            raise InvalidInputError(f"{place}: {brief(name)}; expected one of: {listed(self.actions)}")
        return self.actions.index(name)


def arcube_assumptions(n_objects: int = 100) -> Assumptions:
    """Return the paper's assumptions: ARcubes with 24 aspects, 12 tags, three actions (section 5)."""
    return Assumptions(
        n_objects=n_objects,
        n_aspects=24,
        actions=("flip", "left", "right"),
        alphabet=PatternAlphabet(slots=("front", "top"), n_symbols=12),
    )
