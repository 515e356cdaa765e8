"""Does it pay to look two actions ahead? Success on the same seeds as greedy expected entropy, and its cost.

Run with ``python benchmarks/lookahead.py [TESTS]``. Ideal world, preset ``default``. Costs: 100 remembered objects, at
each look of some trials the three policies in turn, in processor time; success: tests of 100 trials, differences with
the standard error of a paired mean over tests.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Iterator
from itertools import product

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.core.patterns import Evidence
from atg_fg.core.statistics import standard_error
from atg_fg.engines import begin_trial
from atg_fg.experiments.scores import pooled_interval
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.inference.interface import Inference
from atg_fg.policies import make_policy
from atg_fg.storage.presets import preset
from atg_fg.worlds.base import detection_of
from atg_fg.worlds.registry import make_world
from benchmarks.memories import remembered

POLICIES = ("entropy", "lookahead-2", "lookahead-3")
N_OBJECTS = 100
N_TRIALS = 6
N_LOOKS = 6
ACTIONS = (4, 6, 10)


def looks() -> Iterator[tuple[int, Inference]]:
    """Yield an engine after every look of some trials of random actions, with the number of the look."""
    memory, world, rng = remembered(N_OBJECTS), make_world("ideal"), np.random.default_rng(0)
    for trial in range(N_TRIALS):
        inference = begin_trial("bayes-filter", memory, preset("default"))
        observation, _ = world.reset(seed=trial)
        for look in range(N_LOOKS):
            inference.observe(Evidence.of_detection(memory.assumptions.alphabet, detection_of(observation)))
            yield look, inference
            action = int(rng.integers(3))
            inference.act(action)
            observation, *_ = world.step(np.int64(action))


def seconds(policy: str, inference: Inference) -> float:
    start = time.process_time()
    make_policy(policy).choose(inference, np.random.default_rng(0))
    return time.process_time() - start


def costs() -> Table:
    times: dict[tuple[int, str], list[float]] = {
        (look, policy): [] for look, policy in product(range(N_LOOKS), POLICIES)
    }
    for look, inference in looks():
        for policy in POLICIES:
            times[look, policy].append(seconds(policy, inference))
    table = Table(title=f"A decision at {N_OBJECTS} objects, median (quartiles) of {N_TRIALS} trials")
    for heading in ("looks", "policy", "ms", "ratio to entropy"):
        table.add_column(heading, justify="left" if heading == "policy" else "right")
    for (look, policy), own in times.items():
        ratios = [one / other for one, other in zip(own, times[look, POLICIES[0]], strict=True)]
        table.add_row(str(look + 1), policy, quartiles([1e3 * one for one in own]), quartiles(ratios))
    return table


def quartiles(values: list[float]) -> str:
    low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
    return f"{middle:.3g} ({low:.3g}-{high:.3g})"


def success(n_tests: int) -> Table:
    table = Table(title=f"Success, {n_tests} tests of 100 trials, seeds 0 to {n_tests - 1}, 95 % intervals")
    for heading in ("actions", "entropy", "lookahead-2", "difference ± standard error"):
        table.add_column(heading, justify="right")
    for n_actions in ACTIONS:
        tests = [
            [
                run_test(TestPlan(engine="bayes-filter", policy=policy, n_actions=n_actions), seed)
                for seed in range(n_tests)
            ]
            for policy in POLICIES[:2]
        ]
        rates = [[100 * test.success[0] / test.success[1] for test in column] for column in tests]
        differences = [ahead - greedy for greedy, ahead in zip(*rates, strict=True)]
        cells = [
            f"{statistics.fmean(rate):.1f} % ({100 * low:.1f}-{100 * high:.1f})"
            for rate, (low, high) in zip(rates, (pooled_interval(column, "success") for column in tests), strict=True)
        ]
        error = standard_error(differences)
        spread = "" if error is None else f" ± {error:.1f}"
        table.add_row(str(n_actions), *cells, f"{statistics.fmean(differences):+.1f}{spread}")
    return table


def main() -> None:
    """Print the tables."""
    console = Console(highlight=False, width=120)
    console.print(costs())
    console.print(success(int(sys.argv[1]) if len(sys.argv) > 1 else 10))


if __name__ == "__main__":
    main()
