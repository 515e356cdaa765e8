"""Readings of the object as a whole in what a world shows: a number for each sense, and which were measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import ObjectSense, check_measured
from atg_fg.core.patterns import Measured

#: Name of what an observation has of which senses measured something, and of its look where that is no mapping itself.
MEASURED, LOOK = "measured", "look"


def with_readings(space: spaces.Space[Any], senses: Sequence[ObjectSense]) -> spaces.Space[Any]:
    """Return the space of observations that also have a reading of each sense, and which of them were measured."""
    if not senses:
        return space
    readings = {
        sense.name: spaces.Box(0.0 if sense.relative else -np.inf, np.inf, (1,), np.float64) for sense in senses
    }
    look = space.spaces if isinstance(space, spaces.Dict) else {LOOK: space}
    return spaces.Dict({**look, **readings, MEASURED: spaces.MultiBinary(len(senses))})


def without_readings(space: Any, senses: Sequence[ObjectSense]) -> Any:
    """Return the space of all else, or raise ``InvalidInputError`` if readings of these senses are not in it."""
    if not senses:
        return space
    names = [*(sense.name for sense in senses), MEASURED]
    if not isinstance(space, spaces.Dict) or any(name not in space.spaces for name in names):
        raise InvalidInputError(f"world: observations {space}; expected readings of it, too: {', '.join(names)}")
    look = {name: part for name, part in space.spaces.items() if name not in names}
    return look[LOOK] if list(look) == [LOOK] else spaces.Dict(look)


def look_of(observation: Any) -> Any:
    """Return what an observation has of the look: all of it, but where that stands beside readings."""
    return observation[LOOK] if isinstance(observation, Mapping) and LOOK in observation else observation


def observed_readings(senses: Sequence[ObjectSense], readings: Mapping[str, float]) -> dict[str, Any]:
    """Return the part of an observation that has these readings; nothing was measured of other senses."""
    if not senses:
        return {}
    there = np.array([sense.name in readings for sense in senses], dtype=np.int8)
    return {**{sense.name: np.array([readings.get(sense.name, 0.0)]) for sense in senses}, MEASURED: there}


def readings_in(senses: Sequence[ObjectSense], observation: Any) -> Measured:
    """Return the readings in an observation of ``with_readings``.

    Raises:
        InvalidInputError: They are not there, or none of their sense.
    """
    if not senses:
        return ()
    try:
        there = np.asarray(observation[MEASURED])
        values = [np.asarray(observation[sense.name]) for sense in senses]
    except (KeyError, TypeError, IndexError) as error:
        names = ", ".join(sense.name for sense in senses)
        raise InvalidInputError(f"observation: {observation!r:.60}; expected {MEASURED!r} and {names}") from error
    if there.shape != (len(senses),) or any(value.shape != (1,) for value in values):
        raise InvalidInputError(
            f"observation: shapes {there.shape}, {[value.shape for value in values]}; expected one number a sense"
        )
    found = {sense.name: value[0] for sense, value, is_there in zip(senses, values, there, strict=True) if is_there}
    return check_measured(senses, found, "observation")
