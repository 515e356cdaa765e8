"""Time one decision (expected entropy of 3 actions, 132 patterns) of every engine, side by side.

Run with ``make bench``. Rounds of all contestants alternate, so a slow moment of the machine meets all of them; the
ratios are taken round by round. The naive way eliminates one graph for each action and pattern; with 100 objects it
is timed on one action and a few patterns and scaled up, which is said in the table.
"""

from __future__ import annotations

import platform
import statistics
import time
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.assumptions import arcube_assumptions
from atg_fg.engines import begin_trial
from atg_fg.engines.base import Inference
from atg_fg.engines.gtsam_elimination import GtsamElimination
from atg_fg.memory import RobotMemory
from atg_fg.patterns import Evidence
from atg_fg.policies import RandomPolicy
from atg_fg.presets import preset
from atg_fg.trial import run_trial
from atg_fg.worlds import detection_of, make_world

ROUNDS = 7
N_NAIVE_PATTERNS = 2
LOOKS = 3


def remembered(n_objects: int) -> RobotMemory:
    """Return a memory of cubes, each turned at random 13 times (about 10 known aspects)."""
    memory = RobotMemory(arcube_assumptions())
    world = make_world("ideal")
    for cube, seed in enumerate(np.random.SeedSequence(0).spawn(n_objects)):
        inference = begin_trial("bayes-filter", RobotMemory(memory.assumptions), preset("default"))
        rng = np.random.default_rng(seed)
        record = run_trial(world, inference, RandomPolicy(), 13, rng, reset_options={"object": cube})
        memory.learn(record.patterns, record.actions, matched=None)
    return memory


def after_some_looks(engine: str, memory: RobotMemory, preset_name: str) -> Inference:
    """Return an engine that has looked ``LOOKS`` times at a cube."""
    inference = begin_trial(engine, memory, preset(preset_name))
    world = make_world("ideal")
    observation, _ = world.reset(seed=1, options={"object": 7})
    for look in range(LOOKS):
        inference.observe(Evidence.of_detection(memory.assumptions.alphabet, detection_of(observation)))
        if look < LOOKS - 1:
            inference.act(look % 3)
            observation, *_ = world.step(np.int64(look % 3))
    return inference


def naive_decision(inference: GtsamElimination) -> Callable[[], float]:
    """Return a function that eliminates some hypothetical graphs and returns seconds for all of them."""
    model = inference.model
    graph = inference.graph()
    patterns = np.eye(model.n_patterns)[:N_NAIVE_PATTERNS]
    observations = np.stack([model.likelihood(Evidence(pattern)) for pattern in patterns])
    transition = model.transition(0)

    def seconds() -> float:
        start = time.perf_counter()
        graph.expected_entropy_by_elimination(transition, observations)
        return (time.perf_counter() - start) * model.n_actions * model.n_patterns / N_NAIVE_PATTERNS

    return seconds


def timed(function: Callable[[], object], repeats: int) -> Callable[[], float]:
    """Return a function that gives the mean seconds of ``repeats`` calls."""

    def seconds() -> float:
        start = time.perf_counter()
        for _ in range(repeats):
            function()
        return (time.perf_counter() - start) / repeats

    return seconds


def measure() -> list[tuple[str, list[float]]]:
    """Return the seconds of every contestant in every round."""
    memory = remembered(100)
    gtsam_fixed = after_some_looks("gtsam", memory, "paper")
    gtsam_learning = after_some_looks("gtsam", memory, "default")
    assert isinstance(gtsam_fixed, GtsamElimination)
    contestants = [
        ("bayes-filter, paper", timed(after_some_looks("bayes-filter", memory, "paper").expected_entropies, 50)),
        ("bayes-filter, default", timed(after_some_looks("bayes-filter", memory, "default").expected_entropies, 50)),
        ("gtsam, factors in hand", timed(gtsam_fixed.expected_entropies, 5)),
        ("gtsam, factors made again", timed(gtsam_learning.expected_entropies, 5)),
        (f"gtsam, 396 graphs eliminated (from {N_NAIVE_PATTERNS})", naive_decision(gtsam_fixed)),
    ]
    rounds = [[seconds() for _, seconds in contestants] for _ in range(ROUNDS)]
    return [(name, [row[index] for row in rounds]) for index, (name, _) in enumerate(contestants)]


def main() -> None:
    """Print the table."""
    times = measure()
    reference = times[0][1]
    table = Table(
        title=f"One decision at 100 remembered objects; median (least to most) of {ROUNDS} rounds\n"
        f"{platform.machine()}, Python {platform.python_version()}",
        title_justify="left",
    )
    for heading in ("way", "ms", "ratio to the first row"):
        table.add_column(heading, justify="left" if heading == "way" else "right")
    for name, seconds in times:
        ratios = [own / other for own, other in zip(seconds, reference, strict=True)]
        table.add_row(
            name,
            f"{1e3 * statistics.median(seconds):.2f} ({1e3 * min(seconds):.2f}-{1e3 * max(seconds):.2f})",
            f"{statistics.median(ratios):.1f} ({min(ratios):.1f}-{max(ratios):.1f})",
        )
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
