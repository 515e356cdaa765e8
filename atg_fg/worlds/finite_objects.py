"""What an object is: its states, where each action leads from each of them, and the pattern that each shows."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias, TypeVar

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray, IntArray, Pattern, PatternAlphabet

#: A pattern, an action, and the patterns that it can lead to, each with its probability.
ShownTransition: TypeAlias = tuple[Pattern, int, frozenset[tuple[Pattern, float]]]
_State = TypeVar("_State", bound=Hashable)


@dataclass(frozen=True, eq=False)
class Mechanism:
    """Where actions lead: S states, A actions, B branches each. Objects of one kind share theirs.

    Attributes:
        successors: States that an action can lead to, shape [S, A, B].
        probabilities: Of each of them, shape [S, A, B]; they sum to one over the branches.

    Raises:
        InvalidInputError: Other shapes, a state that is not there, or no probabilities.
    """

    successors: IntArray
    probabilities: FloatArray

    def __post_init__(self) -> None:
        shape = self.successors.shape
        if len(shape) != 3 or 0 in shape or self.probabilities.shape != shape:
            raise InvalidInputError(
                f"mechanism: successors of shape {shape}, probabilities of shape {self.probabilities.shape}; "
                "expected [states, actions, branches] of both, at least one each"
            )
        if self.successors.min() < 0 or self.successors.max() >= shape[0]:
            raise InvalidInputError(
                f"mechanism: successors from {self.successors.min()} to {self.successors.max()}; "
                f"expected states from 0 to {shape[0] - 1}"
            )
        if not (self.probabilities.min() >= 0 and np.allclose(self.probabilities.sum(axis=2), 1.0)):
            raise InvalidInputError(
                f"mechanism: probabilities from {self.probabilities.min()}; "
                "expected none below zero, and a sum of one over the branches"
            )

    @classmethod
    def deterministic(cls, successors: Sequence[Sequence[int]]) -> Mechanism:
        """Return the mechanism in which ``successors[state][action]`` always follows."""
        table = np.array(successors, dtype=np.int64)[..., np.newaxis]
        return cls(table, np.ones(table.shape))

    @property
    def n_states(self) -> int:
        """S, the number of states."""
        return len(self.successors)

    @property
    def n_actions(self) -> int:
        """A, the number of actions."""
        return len(self.successors[0])

    def next_state(self, state: int, action: int, rng: np.random.Generator) -> int:
        """Return the state that an action leads to; ``rng`` is asked only if there is more than one branch."""
        branches = self.successors[state, action]
        if len(branches) == 1:
            return int(branches[0])
        return int(rng.choice(branches, p=self.probabilities[state, action]))


@dataclass(frozen=True, eq=False)
class FiniteObject:
    """One object.

    Several states may show the same pattern. The robot knows an aspect by its pattern, so that they are one aspect to
    it, from which an action leads now here, now there.

    Attributes:
        mechanism: Where actions lead.
        patterns: The pattern that each state shows, length S.

    Raises:
        InvalidInputError: Not one pattern a state.
    """

    mechanism: Mechanism
    patterns: tuple[Pattern, ...]

    def __post_init__(self) -> None:
        if len(self.patterns) != self.mechanism.n_states:
            raise InvalidInputError(
                f"object: {len(self.patterns)} patterns; expected one for each of {self.mechanism.n_states} states"
            )

    @property
    def n_aspects(self) -> int:
        """The number of different patterns that the object shows."""
        return len(set(self.patterns))

    @cached_property
    def appearance(self) -> frozenset[ShownTransition]:
        """What the robot could learn of the object: from which pattern an action leads to which.

        Two objects with unique patterns are the same up to the numbering of their states if and only if this is the
        same; objects in which it differs are different ones in any case.
        """
        mechanism = self.mechanism
        return frozenset(
            (pattern, action, self._outcomes(state, action))
            for state, pattern in enumerate(self.patterns)
            for action in range(mechanism.n_actions)
        )

    def _outcomes(self, state: int, action: int) -> frozenset[tuple[Pattern, float]]:
        outcomes: dict[Pattern, float] = {}
        branches = self.mechanism.successors[state, action].tolist()
        for successor, probability in zip(branches, self.mechanism.probabilities[state, action].tolist(), strict=True):
            pattern = self.patterns[successor]
            outcomes[pattern] = outcomes.get(pattern, 0.0) + probability
        return frozenset(outcomes.items())


@dataclass(frozen=True, eq=False)
class ObjectFamily:
    """Objects that the same actions act on, and that show patterns of one alphabet.

    Attributes:
        actions: Names of the actions.
        alphabet: The patterns.
        objects: At least one.

    Raises:
        InvalidInputError: No objects, one with other actions or with a pattern that is not in the alphabet.
    """

    actions: tuple[str, ...]
    alphabet: PatternAlphabet
    objects: tuple[FiniteObject, ...]

    def __post_init__(self) -> None:
        if not self.objects:
            raise InvalidInputError("objects: none given; expected at least one")
        for number, each in enumerate(self.objects):
            if each.mechanism.n_actions != len(self.actions):
                raise InvalidInputError(
                    f"objects[{number}]: {each.mechanism.n_actions} actions; expected {', '.join(self.actions)}"
                )
            for state, pattern in enumerate(each.patterns):
                self.alphabet.check_pattern(pattern, f"objects[{number}], state {state}")

    @cached_property
    def assumptions(self) -> Assumptions:
        """What the robot takes for granted: |G| is the most different patterns that any of the objects shows."""
        n_aspects = max(each.n_aspects for each in self.objects)
        return Assumptions(len(self.objects), n_aspects, self.actions, self.alphabet)


def closed_mechanism(
    start: _State, actions: Sequence[Callable[[_State], _State]]
) -> tuple[tuple[_State, ...], Mechanism]:
    """Return the states reached from ``start`` by any actions, breadth first, and the mechanism on them."""
    states = [start]
    number_of = {start: 0}
    successors = []
    for state in states:  # grows while it is walked
        row = []
        for act in actions:
            successor = act(state)
            if successor not in number_of:
                number_of[successor] = len(states)
                states.append(successor)
            row.append(number_of[successor])
        successors.append(row)
    return tuple(states), Mechanism.deterministic(successors)
