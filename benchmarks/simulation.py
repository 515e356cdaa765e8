"""Time the simulated robot: bare steps, steps under control, and whole actions, side by side.

Run with ``make bench``. Rounds alternate, so a slow moment of the machine meets all of them; the ratios are taken round
by round. A step is 1/240 s of simulated time, in the same scene, with the hands beside the cube.
"""

from __future__ import annotations

import platform
import statistics
import time
from collections.abc import Callable
from contextlib import closing

import numpy as np
from rich.console import Console
from rich.table import Table

from sim.manipulation.impedance_control import TIME_STEP
from sim.worlds.robonaut_world import RobonautARcubeWorld

ROUNDS = 7
N_STEPS = 1200


def steps_per_second(world: RobonautARcubeWorld, work: Callable[[], object]) -> float:
    """Return simulated steps a second of wall clock while ``work`` goes on."""
    before, start = world.scene.steps, time.perf_counter()
    work()
    return (world.scene.steps - before) / (time.perf_counter() - start)


def main() -> None:
    """Print the table."""
    with closing(RobonautARcubeWorld()) as world:
        world.reset(seed=0)

        def bare() -> None:
            # Arms that nobody holds would fall on the table, and contacts cost time.
            torques = world.controller.feedforward
            for _ in range(N_STEPS):
                world.scene.robot.apply(torques)
                world.scene.advance()

        works: dict[str, Callable[[], object]] = {
            "bare steps, constant torques": bare,
            "steps under control": lambda: world.controller.hold(N_STEPS * TIME_STEP),
            "whole actions: planning, control, looks": lambda: [world.step(np.int64(action)) for action in (0, 1)],
        }
        rates: dict[str, list[float]] = {name: [] for name in works}
        for round_ in range(ROUNDS):
            for name, work in works.items():
                world.reset(seed=round_)
                rates[name].append(steps_per_second(world, work))
    table = Table(
        title=f"{platform.machine()}, Python {platform.python_version()}, {ROUNDS} rounds", title_justify="left"
    )
    for heading in ("", "steps/s, median (least to most)", "share of the bare rate"):
        table.add_column(heading, justify="left" if not heading else "right")
    reference = rates["bare steps, constant torques"]
    for name, found in rates.items():
        shares = [rate / bare_rate for rate, bare_rate in zip(found, reference, strict=True)]
        spread = f"{statistics.median(found):,.0f} ({min(found):,.0f} to {max(found):,.0f})"
        table.add_row(name, spread, f"{statistics.median(shares):.2f} ({min(shares):.2f} to {max(shares):.2f})")
    Console(highlight=False).print(table)


if __name__ == "__main__":
    main()
