"""Time the simulated robot: bare steps, steps under control, and whole actions, side by side.

Run with ``make bench``, or beside another revision of the repository, each in processes of its own, by turns::

    python benchmarks/simulation.py --against REVISION

Rounds alternate, so a slow moment of the machine meets all of them; the ratios are taken round by round. A step is
1/240 s of simulated time, in the same scene, with the hands beside the cube.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import platform
import statistics
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

ROUNDS = 7
N_STEPS = 1200
TIME_STEP = 1 / 240  # s
BARE = "bare steps, constant torques"
_ROOT = Path(__file__).resolve().parents[1]


def steps_per_second(world: Any, work: Callable[[], object]) -> float:
    """Return simulated steps a second of the processor's time, whoever else wants it, while ``work`` goes on."""
    before, start = world.scene.steps, time.process_time()
    work()
    return float((world.scene.steps - before) / (time.process_time() - start))


def rates_of_a_round(seed: int) -> dict[str, float]:
    """Return steps a second of each kind of work, in a world of any revision."""
    from atg_fg import make_world

    with closing(make_world("robonaut")) as made:
        world: Any = made.unwrapped

        def bare() -> None:
            # Arms that nobody holds would fall on the table, and contacts cost time.
            torques = world.controller.feedforward
            for _ in range(N_STEPS):
                world.scene.robot.apply(torques)
                world.scene.advance()

        works: dict[str, Callable[[], object]] = {
            BARE: bare,
            "steps under control": lambda: world.controller.hold(N_STEPS * TIME_STEP),
            "whole actions: planning, control, looks": lambda: [world.step(np.int64(action)) for action in (0, 1)],
        }
        # What is loaded, or compiled, with a process's first action is not timed.
        world.reset(seed=seed)
        world.step(np.int64(0))
        rates = {}
        for name, work in works.items():
            world.reset(seed=seed)
            rates[name] = steps_per_second(world, work)
        return rates


def rates_elsewhere(tree: Path, seed: int) -> dict[str, float]:
    """Return the rates of a round of the code in ``tree``, in a process of its own."""
    done = subprocess.run(
        [sys.executable, str(Path(__file__).resolve()), "--round", str(seed)],
        env={**os.environ, "PYTHONPATH": str(tree)},
        cwd=tree,
        check=True,
        capture_output=True,
        text=True,
    )
    rates: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return rates


def compare(revision: str) -> Table:
    """Return the rates of this tree beside those of a revision."""
    with tempfile.TemporaryDirectory(prefix="revision-") as folder:
        archive = subprocess.run(
            ["git", "-C", str(_ROOT), "archive", revision, "atg_fg", "sim"], check=True, capture_output=True
        ).stdout
        with tarfile.open(fileobj=io.BytesIO(archive)) as files:
            files.extractall(folder, filter="data")
        trees = {"this tree": _ROOT, revision: Path(folder)}
        rounds = [
            # By turns, each tree is the first.
            {name: rates_elsewhere(trees[name], seed) for name in sorted(trees, reverse=bool(seed % 2))}
            for seed in range(ROUNDS)
        ]
    table = _table(f"{platform.machine()}, Python {platform.python_version()}, {ROUNDS} rounds by turns")
    for heading in ("", f"{revision}, steps/s", "this tree, steps/s", "times as quick"):
        table.add_column(heading, justify="left" if not heading else "right")
    for name in rounds[0][revision]:
        before, after = ([rates[tree][name] for rates in rounds] for tree in (revision, "this tree"))
        ratios = [new / old for new, old in zip(after, before, strict=True)]
        table.add_row(name, _spread(before, ",.0f"), _spread(after, ",.0f"), _spread(ratios, ".2f"))
    return table


def shares() -> Table:
    """Return the rates of this tree, and how they compare with bare steps."""
    rounds = [rates_of_a_round(seed) for seed in range(ROUNDS)]
    table = _table(f"{platform.machine()}, Python {platform.python_version()}, {ROUNDS} rounds")
    for heading in ("", "steps/s, median (least to most)", "share of the bare rate"):
        table.add_column(heading, justify="left" if not heading else "right")
    for name in rounds[0]:
        of_bare = [rates[name] / rates[BARE] for rates in rounds]
        table.add_row(name, _spread([rates[name] for rates in rounds], ",.0f"), _spread(of_bare, ".2f"))
    return table


def _table(title: str) -> Table:
    return Table(title=title, title_justify="left")


def _spread(values: Sequence[float], form: str) -> str:
    """Return median, least and most as text."""
    return f"{statistics.median(values):{form}} ({min(values):{form}} to {max(values):{form}})"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description="Time the simulated robot.")
    parser.add_argument("--against", metavar="REVISION", help="compare with another revision of the repository")
    parser.add_argument("--round", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.round is not None:
        print(json.dumps(rates_of_a_round(options.round)))
        return
    Console(highlight=False).print(compare(options.against) if options.against else shares())


if __name__ == "__main__":
    main()
