"""What does it add to feel an object's weight? The same test without and with it, side by side.

Run with ``python benchmarks/weight.py [TESTS [WORLD [PRESET]]]``. Tests of 100 trials, 10 actions, seeds from 0, preset
``default`` if not given; 95 % Wilson intervals over all trials. The worlds:

* ``picture-box``: a third of the boxes look the same as another one, and differ from it in weight alone;
* ``meshes``: things of odd shapes, all of one grey, the whole view as one slot.

A weight is read off with an error of 8 % whenever an object is turned.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import Any, Final

from rich.console import Console
from rich.table import Table

from atg_fg.core.checks import one_of
from atg_fg.core.statistics import wilson_interval
from atg_fg.engines import usual_engine
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.storage.presets import preset

#: Options of each world.
WORLDS: Final[dict[str, dict[str, Any]]] = {
    "picture-box": {"look_alikes": 0.33, "differ_in": "weight"},
    "meshes": {},
}


def shown(right: int, trials: int) -> str:
    """Return a share with its interval, %."""
    low, high = wilson_interval(right, trials)
    return f"{100 * right / trials:.1f} ({100 * low:.1f}-{100 * high:.1f})"


def measure(world: str, n_tests: int, chosen: str, *, weight: bool) -> list[tuple[int, int]]:
    """Return how many verdicts of each test were right, and of how many, with the preset that was chosen."""
    parameters, options = preset(chosen), {**WORLDS[world], "weight": weight}
    plan = TestPlan(world=world, world_options=options, engine=usual_engine(parameters, "gtsam"), parameters=parameters)
    return [run_test(plan, seed).success for seed in range(n_tests)]


def main(n_tests: int = 5, worlds: Iterable[str] = WORLDS, chosen: str = "default") -> None:
    """Run the tests of each world without and with weight, and print a row for each."""
    table = Table(
        "world", "camera, %", "camera and weight, %", "gain, points", title=f"{n_tests} tests, preset {chosen}"
    )
    for world in worlds:
        both = [measure(world, n_tests, chosen, weight=weight) for weight in (False, True)]
        sums = [(sum(right for right, _ in tests), sum(trials for _, trials in tests)) for tests in both]
        gain = 100 * (sums[1][0] / sums[1][1] - sums[0][0] / sums[0][1])
        table.add_row(world, *(shown(*each) for each in sums), f"{gain:+.1f}")
    Console().print(table)


if __name__ == "__main__":
    asked = [one_of(sys.argv[2], "world", WORLDS)] if len(sys.argv) > 2 else list(WORLDS)
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 5, asked, *sys.argv[3:4])
