"""Worlds by name.

A world has a ``Discrete`` action space and looks with a whole number a slot: the symbol detected there, or
``MISSING``. One with a ``sense`` has the observations that this reads. ``info`` carries
the truth, for scoring only.
"""

from __future__ import annotations

import re
from typing import Any, Final

import gymnasium

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import AtgError, InvalidInputError, unknown_name
from atg_fg.core.sense import Sense
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.base import World

#: Ids of environments by the names of worlds on the command line. The part before the colon is imported first, so
#: that it can register the id.
WORLDS: Final[dict[str, str]] = {
    "ideal": "atg_fg.worlds:atg_fg/ARcube-v0",
    "rendered": "sim:sim/RenderedARcube-v0",
    "robonaut": "sim:sim/RobonautARcube-v0",
    "picture-box": "sim:sim/PictureBox-v0",
    "meshes": "sim:sim/Meshes-v0",
    "robonaut-picture-box": "sim:sim/RobonautPictureBox-v0",
    "prism": "atg_fg.worlds:atg_fg/HexagonalPrism-v0",
    "lock": "atg_fg.worlds:atg_fg/RingLock-v0",
    "lid-box": "atg_fg.worlds:atg_fg/LidBox-v0",
    "random-atg": "atg_fg.worlds:atg_fg/RandomATG-v0",
    "half-and-half": "atg_fg.worlds:atg_fg/HalfAndHalf-v0",
    "mixed": "atg_fg.worlds:atg_fg/MixedKinds-v0",
    "repeated-tags": "atg_fg.worlds:atg_fg/RepeatedTags-v0",
    "detector": "atg_fg.worlds:atg_fg/Detector-v0",
}

#: Those of them whose objects are ARcubes, given as ``cubes``. The others draw objects of their own.
ARCUBE_WORLDS: Final = ("ideal", "rendered", "robonaut")

#: What ``gymnasium.make`` takes for itself, and what says which world of this project it is.
_NOT_OPTIONS: Final = frozenset(
    {"id", "max_episode_steps", "disable_env_checker", "additional_wrappers", "vectorization_mode", "family"}
)

#: What Gymnasium adds to an error about options: all of them, objects too.
_OF_GYMNASIUM: Final = " was raised from the environment creator"


def make_world(name: str, /, **options: Any) -> World:
    """Return the world registered as ``name`` (or any ``module:namespace/Id-v0`` of a user's own).

    Raises:
        UnknownNameError: No world has this name.
        MissingDependencyError: The world needs an extra that is not installed.
    """
    if not isinstance(name, str) or (name not in WORLDS and ":" not in name):
        raise unknown_name("world", name, WORLDS)
    for option in _NOT_OPTIONS & options.keys():
        raise InvalidInputError(f"world {name!r}: option {option!r}: expected an option of the world's own")
    module, _, environment = name.partition(":")
    if name not in WORLDS and not (is_dotted_name(module) and environment and ":" not in environment):
        raise InvalidInputError(
            f"world {name!r}: cannot be made: expected module:namespace/Id-v0, with a module on Python's path"
        )
    try:
        return gymnasium.make(WORLDS.get(name, name), disable_env_checker=True, **options)
    except AtgError:
        raise
    except (gymnasium.error.Error, ModuleNotFoundError, TypeError, ValueError, OverflowError, AttributeError) as error:
        of_options = name in WORLDS or "unexpected keyword argument" in str(error)
        if isinstance(error, (TypeError, ValueError, OverflowError, AttributeError)) and not of_options:
            raise  # a fault of the world's own
        reason = str(error).partition(_OF_GYMNASIUM)[0]
        unknown = re.search(r"unexpected keyword argument '(\w+)'", reason)
        if unknown:
            raise InvalidInputError(
                f"world {name!r}: option {unknown[1]!r}: unknown; expected an option of the world's own"
            ) from error
        what = "options that it takes" if of_options else "module:namespace/Id-v0, an id that the module registers"
        raise InvalidInputError(f"world {name!r}: cannot be made: {reason}; expected {what}") from error


def make_world_with(name: str, n_objects: int, seed: int, /, **options: Any) -> World:
    """Return the world registered as ``name`` with ``n_objects`` objects drawn by ``seed``; a user's own has its own.

    Raises:
        InvalidInputError: As for ``make_world``.
    """
    objects: dict[str, Any] = {}
    if name in ARCUBE_WORLDS:
        objects = {"cubes": make_arcubes(n_objects, seed)}
    elif name in WORLDS:
        objects = {"n_objects": n_objects, "objects_seed": seed}
    for option in objects.keys() & options.keys():
        raise InvalidInputError(f"world {name!r}: option {option!r}: is given already; expected another option")
    return make_world(name, **objects, **options)


def is_dotted_name(text: str) -> bool:
    """Return whether a text can be the name of a module: words with dots between them."""
    return all(word.isidentifier() for word in text.split("."))


def assumptions_of(world: World, n_objects: int) -> Assumptions:
    """Return what the robot takes for granted in a world: the world's attribute ``assumptions``, if it has one.

    A world without one is of ``n_objects`` ARcubes.

    Raises:
        InvalidInputError: The attribute is something else.
    """
    if not world.has_wrapper_attr("assumptions"):
        return arcube_assumptions(n_objects)
    found = world.get_wrapper_attr("assumptions")
    if not isinstance(found, Assumptions):
        raise InvalidInputError(f"world's assumptions: {found!r}; expected an atg_fg.Assumptions")
    return found


def sense_of(world: World) -> Sense | None:
    """Return a sense that reads a world's observations and has learned nothing; ``None`` if they are symbols.

    It is a copy of the world's attribute ``sense``, if it has one.
    """
    if not world.has_wrapper_attr("sense"):
        return None
    sense: Sense = world.get_wrapper_attr("sense")
    return sense.copy()


def check_arcube_world(role: str, name: str) -> None:
    """Raise ``InvalidInputError`` naming ``role`` if the world of this name is known to be without ARcubes."""
    if name in WORLDS and name not in ARCUBE_WORLDS:
        raise InvalidInputError(f"{role}: {name!r}; expected a world of ARcubes: {', '.join(ARCUBE_WORLDS)}")
