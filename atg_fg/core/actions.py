"""What was done between two looks: an action, or only how probable each is; perhaps nothing happened."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from atg_fg.core.checks import number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray

if TYPE_CHECKING:
    from atg_fg.core.assumptions import Assumptions


class UncertainAction(NamedTuple):
    """One of several actions was done, or nothing happened.

    Attributes:
        chances: (index, probability) of each action that may have been done.
        stays: Probability that nothing happened, so that the object is as it was; all sum to one.
    """

    chances: tuple[tuple[int, float], ...]
    stays: float


#: Nothing happened: the next look is at the same aspect.
NOTHING = UncertainAction((), 1.0)

#: The index of an action, or what is known of it.
AnyAction: TypeAlias = int | UncertainAction
#: The same as a person writes it: index or name, ``None`` if nothing happened, or the probability of each.
GivenAction: TypeAlias = AnyAction | str | Mapping[int | str | None, float] | None


def action_from(given: GivenAction, assumptions: Assumptions, place: str = "action") -> AnyAction:
    """Return what was done, as engines take it.

    Args:
        given: Index or name of an action; ``None`` if nothing happened; or the probability of each of these.
        assumptions: Say which actions there are.
        place: For error messages.

    Raises:
        InvalidInputError: There is no such action, or the probabilities do not sum to one.
    """
    if isinstance(given, UncertainAction):
        for index, _ in given.chances:
            assumptions.action_of(index, place)
        return given
    if given is None:
        return NOTHING
    if not isinstance(given, Mapping):
        return assumptions.action_of(given, place)
    weights: dict[int | None, float] = {}
    for key, value in given.items():
        done: int | None = None if key is None else assumptions.action_of(key, place)
        weights[done] = weights.get(done, 0.0) + number(value, f"{place}: {key}", 0.0)
    total = math.fsum(weights.values())
    if not math.isclose(total, 1.0, abs_tol=1e-6):
        raise InvalidInputError(f"{place}: {dict(given)!r:.200}; expected probabilities that sum to one")
    stays = weights.pop(None, 0.0) / total
    chances = tuple((number_, weight / total) for number_, weight in weights.items() if number_ is not None and weight)
    return chances[0][0] if not stays and len(chances) == 1 else UncertainAction(chances, stays)


def told(action: AnyAction, assumptions: Assumptions) -> str:
    """Return in words what was done."""
    if not isinstance(action, UncertainAction):
        return assumptions.actions[action]
    shares = [(assumptions.actions[index], chance) for index, chance in action.chances]
    shares += [("nothing", action.stays)] if action.stays else []
    return ", ".join(f"{name} {chance:.0%}" if chance < 1 else name for name, chance in shares)


def mixed(action: AnyAction, move: Callable[[int], FloatArray], stayed: FloatArray) -> FloatArray:
    """Return what an action makes of something linear, such as a belief over aspects.

    Args:
        action: What was done.
        move: Returns what a sure action makes of it.
        stayed: What it is if nothing happens.
    """
    if not isinstance(action, UncertainAction):
        return move(action)
    result: FloatArray = np.multiply(action.stays, stayed)
    for index, chance in action.chances:
        result = result + chance * move(index)
    return result
