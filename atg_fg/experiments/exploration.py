"""Memories of cubes that were turned over one by one, and of all that there is to know of them."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from typing import Final

import numpy as np

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.records import TrialSummary
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import learn_steps, run_trial
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import Policy
from atg_fg.worlds.arcube import ORIENTATIONS, SUCCESSORS, Cube, shown_pattern
from atg_fg.worlds.base import World
from atg_fg.worlds.registry import make_world

_PLAIN: Final = ModelParameters()


def learned_memory(
    assumptions: Assumptions,
    cubes: Sequence[Cube],
    policy: Policy,
    n_actions: int,
    rng: np.random.Generator,
    world: str = "ideal",
    parameters: ModelParameters = _PLAIN,
) -> RobotMemory:
    """Return a memory of all cubes, in their order, each turned over in one trial.

    The robot is told that each of them is new, so that no two are taken for one.

    Args:
        assumptions: Of the memory.
        cubes: What it shall remember.
        policy: Chooses the actions.
        n_actions: On each cube.
        rng: Of all these trials.
        world: Name of the world.
        parameters: Say whether the memory learns what the cubes share.
    """
    memory = memory_for(parameters, RobotMemory(assumptions))
    with closing(make_world(world, cubes=cubes)) as made_world:
        explore(memory, made_world, len(cubes), policy, n_actions, rng)
    return memory


def explore(
    memory: RobotMemory, world: World, n_objects: int, policy: Policy, n_actions: int, rng: np.random.Generator
) -> None:
    """Let a memory learn the first objects of a world, each from one trial, knowing that it is new.

    Args:
        memory: What learns.
        world: Where the objects are.
        n_objects: How many of them.
        policy: Chooses the actions.
        n_actions: On each object.
        rng: Of all these trials.
    """
    for number in range(n_objects):
        # The memory is empty: what else the robot remembers does not matter while it explores a new object.
        inference = begin_trial("bayes-filter", RobotMemory(memory.assumptions, sense=memory.sense), _PLAIN)
        record = run_trial(world, inference, policy, n_actions, rng, reset_options={"object": number})
        learn_steps(memory, TrialSummary.of(record), None)


def complete_memory(assumptions: Assumptions, cubes: Sequence[Cube]) -> RobotMemory:
    """Return a memory that knows all aspects of all cubes, in their order, and each transition from one observation."""
    return RobotMemory(assumptions, (_complete_graph(assumptions, number, cube) for number, cube in enumerate(cubes)))


def _complete_graph(assumptions: Assumptions, number: int, cube: Cube) -> AspectTransitionGraph:
    graph = AspectTransitionGraph(f"object-{number:03d}", assumptions)
    for orientation in range(len(ORIENTATIONS)):
        graph.add_aspect(shown_pattern(cube, orientation))
    for orientation, successors in enumerate(SUCCESSORS):
        for action, successor in enumerate(successors):
            graph.add_transition(orientation, action, successor)
    return graph
