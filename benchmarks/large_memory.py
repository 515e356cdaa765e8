"""Time decisions of the engine ``large-memory`` with 100 to 100,000 remembered objects, side by side.

Run with ``python benchmarks/large_memory.py``. Two kinds of memory: with *equal matches* the object presented shares its
patterns with eight remembered ones, however many there are; of *ARcubes*, 132 patterns in all, 7.6 % of all objects know
each. Times are of the processor, medians over trials; memories take turns, so a slow moment meets all of them.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from atg_fg.arcube import ACTION_SOURCES
from atg_fg.assumptions import Assumptions
from atg_fg.engines import begin_trial
from atg_fg.engines.base import Inference
from atg_fg.large_memory.compact_memory import CompactMemory, GraphArrays, compacted
from atg_fg.patterns import Evidence, IntArray, PatternAlphabet
from atg_fg.presets import preset

SIZES = (100, 1_000, 10_000, 100_000)
N_WALK = 13
N_MATCHING = 8

#: The place that comes to the front, by action, and where the other places go.
_SOURCES = np.array(list(ACTION_SOURCES.values()))


class Presented(NamedTuple):
    """A memory, and trials with objects that look like some of those remembered.

    Attributes:
        memory: The robot memory.
        trials: The pattern of each look and the action after it, for each trial.
    """

    memory: CompactMemory
    trials: list[tuple[IntArray, IntArray]]


class Times(NamedTuple):
    """Seconds of the processor, by trial and look, both of shape [trials, looks]."""

    decision: np.ndarray
    update: np.ndarray


def synthetic_memory(n_objects: int, seed: int, n_symbols: int = 12, n_alike: int = 0) -> CompactMemory:
    """Return a memory of random cubes, each turned at random 13 times (about 10 known aspects).

    Args:
        n_objects: K.
        seed: Seed of cubes and actions.
        n_symbols: Number of tags there are; each cube has six of them.
        n_alike: So many cubes are the one with tags 0 to 5, which no other cube has.
    """
    rng = np.random.default_rng(seed)
    least = 6 if n_alike else 0
    faces = least + np.argsort(rng.random((n_objects, n_symbols - least)), axis=1)[:, :6]
    faces[: min(n_alike, n_objects)] = np.arange(6)
    patterns, actions = walks(faces, N_WALK, n_symbols, rng)
    alphabet = PatternAlphabet(("front", "top"), n_symbols)
    assumptions = Assumptions(2 * n_objects, 24, tuple(ACTION_SOURCES), alphabet)
    names = [f"object-{number:03d}" for number in range(n_objects)]
    return CompactMemory.of_arrays(assumptions, names, compacted(graphs_of(patterns, actions), assumptions))


def walks(faces: IntArray, n_actions: int, n_symbols: int, rng: np.random.Generator) -> tuple[IntArray, IntArray]:
    """Return what cubes with these tags [K, 6] show, shape [K, t + 1], in the course of random actions [K, t]."""
    actions = rng.integers(len(_SOURCES), size=(len(faces), n_actions))
    shown = []
    for time_ in range(n_actions + 1):
        front, top = faces[:, 0], faces[:, 4]
        shown.append(front * (n_symbols - 1) + top - (top > front))
        if time_ < n_actions:
            faces = np.take_along_axis(faces, _SOURCES[actions[:, time_]], axis=1)
    return np.stack(shown, axis=1), actions


def graphs_of(patterns: IntArray, actions: IntArray) -> GraphArrays:
    """Return the ATGs that trials [K, t + 1] and [K, t] leave, as ``RobotMemory.learn`` would make them."""
    n_objects, n_looks = patterns.shape
    first = (patterns[:, :, None] == patterns[:, None, :]).argmax(axis=2)
    new = first == np.arange(n_looks)
    aspect = np.take_along_axis(new.cumsum(axis=1) - 1, first, axis=1)
    numbers = np.repeat(np.arange(n_objects), n_looks - 1)
    sources, targets = aspect[:, :-1].ravel(), aspect[:, 1:].ravel()
    keys = ((numbers * n_looks + sources) * len(_SOURCES) + actions.ravel()) * n_looks + targets
    edges, count = np.unique(keys, return_counts=True)
    edges, target = np.divmod(edges, n_looks)
    edges, action = np.divmod(edges, len(_SOURCES))
    number, source = np.divmod(edges, n_looks)
    n_edges = np.bincount(number, minlength=n_objects)
    return GraphArrays(new.sum(axis=1), patterns[new], n_edges, source, action, target, count)


def equal_matches(n_objects: int, n_trials: int = 5, n_looks: int = 10) -> Presented:
    """Return a memory in which eight objects are like the one presented, and no other shares a pattern with it."""
    memory = synthetic_memory(n_objects, seed=0, n_symbols=46, n_alike=N_MATCHING)
    patterns, actions = walks(np.tile(np.arange(6), (n_trials, 1)), n_looks - 1, 46, np.random.default_rng(1))
    return Presented(memory, list(zip(patterns, actions, strict=True)))


def arcubes(n_objects: int, n_trials: int = 5, n_looks: int = 10) -> Presented:
    """Return a memory of ARcubes, and trials with cubes of which half are remembered, or nearly."""
    memory = synthetic_memory(n_objects, seed=0)
    rng = np.random.default_rng(1)
    faces = np.argsort(rng.random((n_trials, 12)), axis=1)[:, :6]
    patterns, actions = walks(faces, n_looks - 1, 12, rng)
    return Presented(memory, list(zip(patterns, actions, strict=True)))


def timed_trial(
    memory: CompactMemory, patterns: IntArray, actions: IntArray
) -> tuple[list[float], list[float], Inference]:
    """Return the seconds of each decision and of each update of a trial, and the engine after it."""
    inference = begin_trial("large-memory", memory, preset("default"), n_exact=0)
    alphabet = memory.assumptions.alphabet
    evidence = [Evidence.of_detection(alphabet, alphabet.patterns[pattern]) for pattern in patterns]
    decisions, updates = [], []
    for look, each in enumerate(evidence):
        start = time.process_time()
        if look:
            inference.act(int(actions[look - 1]))
        inference.observe(each)
        looked = time.process_time()
        inference.expected_entropies()
        decisions.append(time.process_time() - looked)
        updates.append(looked - start)
    return decisions, updates, inference
