"""Memories of any size and the trials that contestants follow on them, all from fixed seeds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import permutations
from typing import Final

import numpy as np

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.worlds.arcube import ORIENTATIONS, SUCCESSORS, Cube, canonical, make_arcubes, shown_pattern

#: Actions that each object was turned by when it was learned; it then knows about 10 aspects.
N_LEARNING_ACTIONS: Final = 13
#: There are 27,720 different cubes; larger memories hold some of them twice, each with an ATG of its own.
MOST_CUBES: Final = 20_000
#: Objects of ``equal_matches`` that know patterns of the trial.
N_MATCHING: Final = 100


@dataclass(frozen=True)
class Course:
    """What is seen and done in a trial.

    Attributes:
        patterns: Index of the pattern seen at each look, t + 1 of them.
        evidence: The same as evidence.
        actions: Index of each action, t of them.
    """

    patterns: tuple[int, ...]
    evidence: tuple[Evidence, ...]
    actions: tuple[int, ...]


def remembered(n_objects: int) -> RobotMemory:
    """Return a memory of cubes, each turned at random."""
    cubes = make_arcubes(min(n_objects, MOST_CUBES), seed=0)
    return _learned([cubes[number % len(cubes)] for number in range(n_objects)], arcube_assumptions(n_objects))


def equal_matches(n_objects: int) -> RobotMemory:
    """Return a memory in which ``N_MATCHING`` objects, or all if fewer, have the tags 0 to 5, and the others 6 to 11.

    So in a trial of a cube of the first kind the same number of objects knows what is seen, however many there are.
    """
    matching = sorted({canonical((a, b, c, d, e, f)) for a, b, c, d, e, f in permutations(range(6))})
    others = [_other_tags(cube) for cube in matching]
    cubes = [
        (matching if number < N_MATCHING else others)[number % len(matching)]  # both kinds have 30 cubes
        for number in range(n_objects)
    ]
    return _learned(cubes, arcube_assumptions(n_objects))


def _other_tags(cube: Cube) -> Cube:
    a, b, c, d, e, f = (6 + tag for tag in cube)
    return a, b, c, d, e, f


def with_learned_structure(n_objects: int) -> StructuredMemory:
    """Return a memory of cubes that has also learned what all of them share."""
    memory = StructuredMemory(arcube_assumptions(n_objects))
    rng = np.random.default_rng(0)
    for cube in make_arcubes(n_objects, seed=0):
        course = random_course(cube, memory.assumptions, N_LEARNING_ACTIONS, rng)
        name = memory.learn(course.patterns, course.actions, matched=None)
        detections = [memory.assumptions.alphabet.patterns[pattern] for pattern in course.patterns]
        memory.learn_shared(name, detections, course.actions)
    return memory


def _learned(cubes: list[Cube], assumptions: Assumptions) -> RobotMemory:
    memory, rng = RobotMemory(assumptions), np.random.default_rng(0)
    for cube in cubes:
        course = random_course(cube, assumptions, N_LEARNING_ACTIONS, rng)
        memory.learn(course.patterns, course.actions, matched=None)
    return memory


def course_for(memory: RobotMemory, n_actions: int) -> Course:
    """Return a trial of random actions with the first cube that is remembered by ``remembered``."""
    return random_course(make_arcubes(1, seed=0)[0], memory.assumptions, n_actions, np.random.default_rng(1))


def matching_course(memory: RobotMemory, n_actions: int) -> Course:
    """Return a trial of random actions with a cube of the tags 0 to 5, for ``equal_matches``."""
    return random_course((0, 1, 2, 3, 4, 5), memory.assumptions, n_actions, np.random.default_rng(1))


def random_course(cube: Cube, assumptions: Assumptions, n_actions: int, rng: np.random.Generator) -> Course:
    """Return what a cube shows when it is turned at random, without noise."""
    orientation = int(rng.integers(len(ORIENTATIONS)))
    actions = tuple(rng.integers(len(assumptions.actions), size=n_actions).tolist())
    tags = [shown_pattern(cube, orientation)]
    for action in actions:
        orientation = SUCCESSORS[orientation][action]
        tags.append(shown_pattern(cube, orientation))
    evidence = _evidence(assumptions)
    patterns = tuple(assumptions.alphabet.index(pair) for pair in tags)
    return Course(patterns, tuple(evidence[pattern] for pattern in patterns), actions)


@cache
def _evidence(assumptions: Assumptions) -> tuple[Evidence, ...]:
    alphabet = assumptions.alphabet
    return tuple(Evidence.of_detection(alphabet, pattern) for pattern in alphabet.patterns)
