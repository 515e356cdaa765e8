"""What ``demo`` and ``watch`` begin with: a world, and a robot that met some of its objects beforehand."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from typing import Any, Final

import numpy as np

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.experiments.exploration import explore, learned_memory
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import RandomPolicy
from atg_fg.worlds.arcube import Cube, make_arcubes
from atg_fg.worlds.base import World
from atg_fg.worlds.registry import assumptions_of, check_arcube_world, make_world, sense_of

N_REMEMBERED: Final = 6
#: Boxes without tags, before the robot and before a rendered camera, where the robot learns what it remembers.
PICTURE_BOXES, RENDERED_BOXES = "robonaut-picture-box", "picture-box"
_ACTIONS: Final = 12


def told_world(world: str) -> str:
    """Return the name of the world that is told of where a user names ``world``: boxes are turned by the robot.

    Raises:
        InvalidInputError: It is neither of ARcubes nor of boxes.
    """
    if world in (PICTURE_BOXES, RENDERED_BOXES):
        return PICTURE_BOXES
    check_arcube_world("--world", world)
    return world


def world_with_memory(
    world: str, parameters: ModelParameters, seed: int, rng: np.random.Generator, **options: Any
) -> tuple[World, RobotMemory]:
    """Return a world of seven objects, and the memory of a robot that turned over the first six, one after the other.

    Args:
        world: Name, as ``told_world`` returns it.
        parameters: Say whether the memory learns what objects share.
        seed: Of the objects.
        rng: Of the trials in which they were learned.
        options: Of the world.
    """
    n_objects = N_REMEMBERED + 1
    if world == PICTURE_BOXES:
        own: dict[str, Any] = {"n_objects": n_objects, "objects_seed": seed}
        made = make_world(world, **own, **options)
        with closing(make_world(RENDERED_BOXES, **own)) as rendered:
            memory = memory_for(parameters, RobotMemory(assumptions_of(rendered, n_objects), sense=sense_of(rendered)))
            explore(memory, rendered, N_REMEMBERED, RandomPolicy(), _ACTIONS, rng)
        return made, memory
    cubes = make_arcubes(n_objects, seed)
    return make_world(world, cubes=cubes, **options), learn_beforehand(cubes, parameters, rng)


def learn_beforehand(cubes: Sequence[Cube], parameters: ModelParameters, rng: np.random.Generator) -> RobotMemory:
    """Return the memory of a robot that turned each of the first six cubes over at random, twelve times.

    It did so in the ideal world, and knew that each was new.
    """
    assumptions, remembered = arcube_assumptions(), cubes[:N_REMEMBERED]
    return learned_memory(assumptions, remembered, RandomPolicy(), _ACTIONS, rng, parameters=parameters)
