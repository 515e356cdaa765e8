"""How often is the next look foretold after so many looks of an object whose aspects look alike?

Run with ``python benchmarks/foretelling.py [OBJECTS]``. World ``repeated-tags``, of which each object here shows one
tag on two opposite faces, so that what it shows does not say how it lies. The robot looks at one object after the
other, 25 trials of 10 random actions each (275 looks), and learns whose trials they are from its own verdicts. Then
it foretells each look of a trial of 50 random actions: the most probable pattern after the action, before the look.
95 % Wilson intervals over looks.
"""

from __future__ import annotations

import sys

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.core.statistics import wilson_interval
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import RandomPolicy
from atg_fg.storage.presets import preset
from atg_fg.worlds.base import World, detection_of
from atg_fg.worlds.registry import assumptions_of, make_world_with

TRIALS, ACTIONS, FORETOLD = 25, 10, 50


def foretold(world: World, n_objects: int, presented: int, rng: np.random.Generator) -> list[bool]:
    """Return whether each look of the last trial was foretold, once the object has been learned."""
    memory = memory_for(preset("learned"), RobotMemory(assumptions_of(world, n_objects)))
    options = {"object": presented}
    for _ in range(TRIALS):
        inference = begin_trial("learned-structure", memory, preset("learned"))
        learn_from(run_trial(world, inference, RandomPolicy(), ACTIONS, rng, reset_options=options), memory)
    inference, right = begin_trial("learned-structure", memory, preset("learned")), []
    alphabet = memory.assumptions.alphabet
    observation, _ = world.reset(seed=int(rng.integers(2**31)), options=options)
    for _ in range(FORETOLD):
        inference.observe(Evidence.of_detection(alphabet, detection_of(observation)))
        action = int(rng.integers(len(memory.assumptions.actions)))
        expected = int(np.argmax(inference.belief_tree().after(action).probabilities))
        inference.act(action)
        observation, *_ = world.step(np.int64(action))
        right.append(alphabet.patterns[expected] == detection_of(observation))
    return right


def main() -> None:
    """Print the table."""
    n_objects = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    title = f"{n_objects} objects, preset learned: looks foretold after {TRIALS * (ACTIONS + 1)} looks of an object"
    table = Table(title=title, title_justify="left")
    for heading in ("all 50 looks, %", "all but the first five, %"):
        table.add_column(heading, justify="right")
    world, rng = make_world_with("repeated-tags", n_objects, 0, share=1.0), np.random.default_rng(0)
    looks = [foretold(world, n_objects, presented, rng) for presented in range(n_objects)]
    table.add_row(*(_share([hit for each in looks for hit in each[first:]]) for first in (0, 5)))
    Console(highlight=False, width=120).print(table)


def _share(hits: list[bool]) -> str:
    low, high = wilson_interval(sum(hits), len(hits))
    return f"{100 * sum(hits) / len(hits):.1f} ({100 * low:.1f}-{100 * high:.1f})"


if __name__ == "__main__":
    main()
