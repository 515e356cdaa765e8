"""One run of all measurements, as a document."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from benchmarks import against as revisions
from benchmarks import matching_cost, table1, worker_start
from benchmarks.lower_bound import floor
from benchmarks.machine import description
from benchmarks.measuring import Clock
from benchmarks.targets import TARGETS
from benchmarks.trials import TrialPlan, measure_all

FORMAT: Final = "atg-fg/bench"


@dataclass(frozen=True)
class Plan:
    """What a run is made of.

    Attributes:
        sizes: Numbers of remembered objects.
        trial: Rounds, the trial, and what is left out.
        tests: Tests of Table 1 that are timed, to be scaled up to five.
        table1_trials: Trials of a test; the paper's are 100.
        table1_rounds: Rounds of the two engines.
        matches: The two sizes of equal matches.
    """

    sizes: tuple[int, ...] = (10, 100, 1_000, 10_000, 100_000)
    trial: TrialPlan = field(default_factory=TrialPlan)
    tests: int = 2
    table1_trials: int = 100
    table1_rounds: int = 3
    matches: tuple[int, int] = (100, 100_000)


#: A look at whether everything runs, in less than a minute; its figures say little.
QUICK: Final = Plan(
    (10,), TrialPlan(n_rounds=2, n_actions=3), tests=1, table1_trials=5, table1_rounds=1, matches=(4, 8)
)


def run(
    plan: Plan,
    on_part: Callable[[str], None] = lambda _: None,
    clock: Clock = time.perf_counter,
    against: str | None = None,
) -> dict[str, Any]:
    """Measure everything.

    Args:
        plan: What is measured.
        on_part: Told the name of each part before it begins.
        clock: Tells the time.
        against: A revision of this project that is timed beside the present code, if given.

    Raises:
        InvalidInputError: There is no such revision.

    Returns:
        A document as JSON knows it; ``docs/file_formats.md`` says what is in it.
    """
    compared = None
    if against is not None:
        figures = revisions.QUICK if plan == QUICK else revisions.FIGURES
        compared = revisions.measure(against, figures, lambda claim: on_part(f"against {against}: {claim}"))
    machine, trials, floors = description(), [], []
    on_part(f"{min(plan.sizes):,} objects")
    remaining = sorted(plan.sizes)[1:]
    for memory, measured in measure_all(list(plan.sizes), plan.trial, clock):
        trials.append(measured)
        floors.append(floor(memory, plan.trial.n_rounds, clock))
        on_part(f"{remaining.pop(0):,} objects" if remaining else "equal matches")
    equal = matching_cost.measure(*plan.matches, plan.trial.n_rounds, clock)
    on_part(f"peak memory at {max(plan.sizes):,} objects")
    peak = {"remembered": max(plan.sizes), "bytes": revisions.peak_bytes(max(plan.sizes))}
    on_part("Table 1")
    document: dict[str, Any] = {
        "format": FORMAT,
        "version": 1,
        "parameters": asdict(plan),
        "machine": machine,
        "trials": trials,
        "floor": floors,
        "equal_matches": equal,
        "peak_memory": peak,
        "against": compared,
        "worker_start": worker_start.measure(plan.table1_rounds, clock),
        "table1": table1.measure(plan.tests, plan.table1_trials, plan.table1_rounds, clock),
    }
    return {**document, "targets": [target.verdict(document) for target in TARGETS]}
