"""How long the paper's Table 1 takes: five tests of 100 trials of 10 actions, preset ``default``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from typing import Any, Final

from atg_fg.experiments.table1 import TestPlan, run_tests
from benchmarks.measuring import Clock, Sample, alternate, ratios, spread

#: Tests of the paper's Table 1.
PAPER_TESTS: Final = 5


@dataclass(frozen=True)
class Table1Run:
    """An engine and the processes it has."""

    engine: str
    jobs: int


RUNS: Final = (Table1Run("bayes-filter", 1), Table1Run("gtsam", 2))


def scale(n_tests: int, jobs: int) -> float:
    """Return how many times as long five tests take as ``n_tests``, if a process does one after the other."""
    return ceil(PAPER_TESTS / jobs) / ceil(n_tests / jobs)


def measure(n_tests: int, n_trials: int, n_rounds: int, clock: Clock) -> dict[str, Any]:
    """Time the tests, and scale up to Table 1.

    Args:
        n_tests: Tests to run, seeds 0 and up.
        n_trials: Trials a test; the paper's are 100, and less is not scaled up.
        n_rounds: Rounds in which the engines take turns.
        clock: Tells the time.
    """

    def seconds_of(run: Table1Run) -> Callable[[], Sample]:
        plan = TestPlan(engine=run.engine, n_trials=n_trials)

        def sample() -> Sample:
            start = clock()
            for _ in run_tests([(plan, seed) for seed in range(n_tests)], run.jobs):
                pass
            return {"seconds": (clock() - start) * scale(n_tests, run.jobs)}

        return sample

    taken = alternate({run.engine: seconds_of(run) for run in RUNS}, n_rounds)
    reference = taken[RUNS[0].engine]["seconds"]
    rows = [
        {
            "engine": run.engine,
            "jobs": run.jobs,
            "scaled_by": scale(n_tests, run.jobs),
            "rounds": taken[run.engine]["seconds"],
            "seconds": spread(taken[run.engine]["seconds"]),
            "ratio": spread(ratios(taken[run.engine]["seconds"], reference)),
        }
        for run in RUNS
    ]
    return {"tests": n_tests, "trials": n_trials, "n_rounds": n_rounds, "engines": rows}
