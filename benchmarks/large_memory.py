"""Time decisions of the engine ``large-memory`` with 100 to 100,000 remembered objects, side by side.

Run with ``python benchmarks/large_memory.py``. Two kinds of memory: with *equal matches* the object presented shares
its patterns with eight remembered ones, however many there are; of *ARcubes*, 132 patterns in all, 7.6 % of all
objects know each. Times are of the processor, medians over trials; memories take turns, so that a slow moment meets
all. How far the belief is from that of ``bayes-filter`` is measured with 10,000 ARcubes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.compact.compact_memory import CompactMemory, GraphArrays, compacted
from atg_fg.core.patterns import Evidence, FloatArray, IntArray, PatternAlphabet
from atg_fg.engines import begin_trial
from atg_fg.engines.large_memory.engine import LargeMemory
from atg_fg.experiments.engine_comparison import total_variation
from atg_fg.inference.interface import Inference, TrialSetup
from atg_fg.storage.compact_file import load_compact_memory, save_compact_memory
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import ACTION_SOURCES

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


def measure(
    make: Callable[[int], Presented], sizes: Sequence[int] = SIZES, rounds: int = 3
) -> dict[int, tuple[FloatArray, FloatArray]]:
    """Return the median seconds of decisions and of updates at each look, by number of remembered objects."""
    presented = {size: make(size) for size in sizes}
    times: dict[int, list[tuple[list[float], list[float]]]] = {size: [] for size in sizes}
    for each in presented.values():  # what is made at first use is no part of a trial
        timed_trial(each.memory, *each.trials[0])
    for _ in range(rounds):
        for number in range(min(len(each.trials) for each in presented.values())):
            for size, each in presented.items():
                times[size].append(timed_trial(each.memory, *each.trials[number])[:2])
    return {
        size: (np.median([d for d, _ in each], axis=0), np.median([u for _, u in each], axis=0))
        for size, each in times.items()
    }


def deviations(n_objects: int = 10_000, n_trials: int = 3) -> tuple[float, float]:
    """Return the largest total variation to ``bayes-filter``, and the largest bound of it, in trials with ARcubes."""
    worst, bound = 0.0, 0.0
    presented = arcubes(n_objects, n_trials)
    alphabet = presented.memory.assumptions.alphabet
    for patterns, actions in presented.trials:
        tried = begin_trial("large-memory", presented.memory, preset("default"), n_exact=0)
        reference = begin_trial("bayes-filter", presented.memory, preset("default"))
        for look, pattern in enumerate(patterns):
            for each in (tried, reference):
                if look:
                    each.act(int(actions[look - 1]))
                each.observe(Evidence.of_detection(alphabet, alphabet.patterns[pattern]))
            worst = max(worst, total_variation(tried, reference))
            bound = max(bound, tried.total_variation_bound or 0.0)
    return worst, bound


def fallbacks(preset_name: str, n_objects: int = 1_000, n_trials: int = 10) -> tuple[int, int, float]:
    """Return how many decisions needed all objects, of how many, and the largest bound of total variation."""
    presented = arcubes(n_objects, n_trials)
    alphabet = presented.memory.assumptions.alphabet
    fell_back, decisions, bound = 0, 0, 0.0
    for patterns, actions in presented.trials:
        inference = LargeMemory(TrialSetup(presented.memory, preset(preset_name)), n_exact=0)
        for look, pattern in enumerate(patterns):
            if look:
                inference.act(int(actions[look - 1]))
            inference.observe(Evidence.of_detection(alphabet, alphabet.patterns[pattern]))
            fell_back += inference.fell_back
            decisions += 1
            bound = max(bound, inference.total_variation_bound)
    return fell_back, decisions, bound


def table_of(title: str, times: dict[int, tuple[FloatArray, FloatArray]]) -> Table:
    """Return decisions and updates of a kind of memory, with the median over looks of ratios to the smallest one."""
    table = Table(title=title, title_justify="left")
    for heading in ("objects", "first decision, ms", "last", "ratio", "with update, ms", "ratio"):
        table.add_column(heading, justify="right")
    base_decision, base_update = next(iter(times.values()))
    for size, (decision, update) in times.items():
        table.add_row(
            str(size),
            f"{1e3 * decision[0]:.2f}",
            f"{1e3 * decision[-1]:.2f}",
            f"{np.median(decision / base_decision):.2f}",
            f"{1e3 * np.median(decision + update):.2f}",
            f"{np.median((decision + update) / (base_decision + base_update)):.2f}",
        )
    return table


def footprint(n_objects: int = 100_000) -> tuple[float, int, float]:
    """Return the bytes a transition takes in memory, those of the file, and the seconds that loading it takes."""
    memory = synthetic_memory(n_objects, seed=0)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "memory.npz"
        save_compact_memory(memory, path)
        start = time.process_time()
        load_compact_memory(path)
        seconds = time.process_time() - start
        return memory.nbytes / len(memory.arrays().counts), path.stat().st_size, seconds


def main() -> None:
    """Print the tables."""
    console = Console(width=120, highlight=False)
    console.print(table_of("Equal matches", measure(equal_matches)))
    console.print(table_of("ARcubes", measure(arcubes, rounds=1)))
    a_transition, file_size, seconds = footprint()
    console.print(
        f"ARcubes, 100,000 objects: {a_transition:.1f} bytes a transition; a file of {file_size / 1e6:.1f} MB, "
        f"loaded in {seconds:.2f} s"
    )
    worst, bound = deviations()
    console.print(
        f"ARcubes, 10,000 objects: total variation to bayes-filter at most {worst:.1e}, its bound {bound:.1e}"
    )
    for name in ("default", "robot"):
        fell_back, decisions, bound = fallbacks(name)
        console.print(
            f"ARcubes, 1,000 objects, preset {name}: {fell_back} of {decisions} decisions needed all objects; "
            f"the bound of total variation is at most {bound:.1e}"
        )


if __name__ == "__main__":
    main()
