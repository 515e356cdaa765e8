"""Whether a world is one: what gymnasium's ``check_env`` says, and what trials in it need besides."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from copy import deepcopy
from typing import Any, Final, NamedTuple

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env, data_equivalence

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import AtgError
from atg_fg.core.promises import require, shared_generators
from atg_fg.core.sense import Sense
from atg_fg.senses.object_readings import look_of, readings_in, without_readings
from atg_fg.worlds.base import World, detection_of, symbols_of
from atg_fg.worlds.registry import assumptions_of, make_world, sense_of

#: Objects of ARcubes that a world is taken to have if it does not say what it assumes; of no consequence here.
_N_OBJECTS: Final = 100


class _Look(NamedTuple):
    """What a world said at one look: a copy of it."""

    observation: Any
    info: Any
    ends: tuple[bool, bool]


def check_world(world: str | World, *, trials: int = 4, steps: int = 20, seed: int = 0, **options: Any) -> int:
    """Raise ``AssertionError`` if a world is none that trials can be run in; return how many looks were looked at.

    It must be what gymnasium's ``check_env`` takes; have numbered actions and looks with a whole number a slot, or
    readings for its ``sense``, and readings of each sense of the object; and say ``assumptions`` that fit these, if
    any. Every look must be a detection under them, and say in ``info`` which object is presented, always the same in a
    trial, with no more different patterns than aspects, where it says the pattern. The same seed must give the same
    trial, whatever was done before; no generator that others share is used; and a look that was given does not change
    later.

    Args:
        world: An instance, a name in ``WORLDS``, or ``module:namespace/Id-v0``.
        trials: Trials of random actions.
        steps: Actions of each.
        seed: Of the trials.
        **options: The world's own, if it is made here.

    Raises:
        AssertionError: The world breaks a promise; the message says which, in which trial, and after which action.
        InvalidInputError: There is no such world.
    """
    made = make_world(world, **options) if isinstance(world, str) else world
    require(isinstance(made, gymnasium.Env), f"{made!r}; expected a gymnasium.Env")
    assumptions, sense = _taken_for_granted(made)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # they are of style
        try:
            check_env(made.unwrapped, skip_render_check=True)
        except AssertionError:
            raise
        except Exception as error:
            raise AssertionError(f"check_env: {type(error).__name__}: {error}") from error
    trial, n_looks = _Trial(made, assumptions, sense), 0
    for number in range(trials):
        place = f"trial {number}"
        first = trial.looks((seed, number), steps, place)
        made.reset(seed=seed + 1000 + number)  # another trial in between
        again = trial.looks((seed, number), steps, place)
        for look, (one, other) in enumerate(zip(first, again, strict=False)):
            same = data_equivalence(tuple(one), tuple(other))
            require(same, f"{place}, look {look}: {one}, then {other}; expected the same of the same seed")
        n_looks += len(first)
    return n_looks


def _taken_for_granted(world: World) -> tuple[Assumptions, Sense | None]:
    """Return what a world assumes and its sense, once its spaces fit them."""
    try:
        assumptions, sense = assumptions_of(world, _N_OBJECTS), sense_of(world)
        space = without_readings(world.observation_space, assumptions.object_senses)
        if sense is not None:
            sense.check_space(space)
    except AtgError as error:
        raise AssertionError(str(error)) from error
    alphabet, actions = assumptions.alphabet, world.action_space
    n_actions = len(assumptions.actions)
    require(
        isinstance(actions, gymnasium.spaces.Discrete) and actions.start == 0 and int(actions.n) == n_actions,
        f"action space {actions}; expected Discrete({n_actions}): {', '.join(assumptions.actions)}",
    )
    slots, greatest = alphabet.slots, alphabet.n_symbols - 1
    require(
        sense is not None or symbols_of(space) == [alphabet.n_symbols] * len(slots),
        f"observation space {space}; expected whole numbers from -1 to {greatest} in each of "
        f"{len(slots)} slots: {', '.join(slots)}",
    )
    return assumptions, sense


class _Trial:
    """Trials of random actions, each look checked.

    Args:
        world: To act in.
        assumptions: That every look must fit.
        sense: That reads the looks, if they are no symbols.
    """

    def __init__(self, world: World, assumptions: Assumptions, sense: Sense | None) -> None:
        self._world, self._assumptions, self._sense = world, assumptions, sense
        self._patterns: dict[object, set[tuple[int, ...]]] = {}

    def looks(self, seed: tuple[int, int], steps: int, place: str) -> list[_Look]:
        """Act at random and return what was seen."""
        rng, looks, given = np.random.default_rng(seed), list[_Look](), []
        shared = shared_generators()
        observation, info = self._world.reset(seed=int(rng.integers(2**31)))
        presented, ends = None, (False, False)
        for number in range(steps + 1):
            where = f"{place}, look {number}"
            self._check_look(observation, info, where)
            if not info.get("lost"):
                presented = info.get("object") if presented is None else presented
                self._check_object(presented, info, where)
            looks.append(_Look(*deepcopy((observation, info)), ends))
            given.append(observation)
            if any(ends) or info.get("lost") or number == steps:
                break
            action = np.int64(rng.integers(len(self._assumptions.actions)))
            observation, reward, terminated, truncated, info = self._world.step(action)
            require(math.isfinite(reward), f"{where}: reward {reward!r}; expected a finite number")
            ends = bool(terminated), bool(truncated)
        for number, (there, then) in enumerate(zip(given, looks, strict=True)):
            unchanged = data_equivalence(there, then.observation)
            require(unchanged, f"{place}, look {number}: has changed since it was given; expected an array of its own")
        require(
            shared == shared_generators(),
            f"{place}: a generator that all share was used; expected self.np_random, seeded by reset",
        )
        return looks

    def _check_look(self, observation: Any, info: Any, place: str) -> None:
        space = self._world.observation_space
        require(space.contains(observation), f"{place}: {observation!r}; expected it to be in the space of looks")
        require(isinstance(info, Mapping), f"{place}: info {info!r}; expected a mapping")
        try:
            readings_in(self._assumptions.object_senses, observation)
            if self._sense is None:
                self._assumptions.alphabet.check_detection(detection_of(look_of(observation)))
        except AtgError as error:
            raise AssertionError(f"{place}: {error}") from error

    def _check_object(self, presented: object, info: Mapping[str, Any], place: str) -> None:
        shown, pattern = info.get("object"), info.get("pattern")
        require(
            isinstance(shown, (int, str, np.integer)) and not isinstance(shown, bool),
            f"{place}: info['object'] is {shown!r}; expected the number or name of what is presented, for scoring",
        )
        require(shown == presented, f"{place}: object {shown!r}; expected {presented!r}, that of the whole trial")
        if pattern is not None and self._sense is None:
            seen, most = self._patterns.setdefault(shown, set()), self._assumptions.n_aspects
            seen.add(tuple(pattern))
            require(
                len(seen) <= most,
                f"{place}: object {shown!r} has shown {len(seen)} patterns; expected at most n_aspects = {most}",
            )
