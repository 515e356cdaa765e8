"""The paper's Figure 3: success of several policies by number of actions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from atg_fg.core.statistics import Rate, mean, rates_of, standard_error
from atg_fg.core.table import Bar, Cell, Table
from atg_fg.experiments.result_log import ResultLog, run_logged
from atg_fg.experiments.scores import pooled_interval
from atg_fg.experiments.table1 import TestPlan, unusual


@dataclass(frozen=True)
class Point:
    """One point of the figure, of several tests.

    Attributes:
        actions: Actions a trial.
        policy: Name of the policy.
    """

    actions: int
    policy: str


class Figure3Log(ResultLog[Point]):
    """Tests of points that have been run.

    Args:
        path: The file, ``….jsonl``.
        plan: Of all tests, but for policy and number of actions; a file of others is refused.

    Raises:
        InvalidInputError: The file cannot be read, or is of other tests.
    """

    def __init__(self, path: Path, plan: TestPlan) -> None:
        usual = TestPlan()
        common = unusual(replace(plan, n_actions=usual.n_actions, policy=usual.policy))
        super().__init__(path, "a Figure 3", {"format": "atg-fg/figure3", "version": 1, **common}, Point)


def figure3_points(
    plan: TestPlan,
    actions: Sequence[int],
    policies: Sequence[str],
    seeds: Sequence[int],
    jobs: int = 1,
    on_trials: Callable[[int], None] | None = None,
    log: Figure3Log | None = None,
    executor: str = "process",
) -> list[dict[str, Any]]:
    """Return the success of each policy for each number of actions.

    Args:
        plan: Of all tests, but for policy and number of actions.
        actions: Numbers of actions a trial.
        policies: Names of policies.
        seeds: Of the tests of each point.
        jobs: As for ``run_tests``.
        on_trials: As for ``run_logged``.
        log: Where each test is kept as it ends; those that it holds are not run.
        executor: As for ``run_tests``.
    """
    points = [Point(number, policy) for number in actions for policy in policies]
    # The longest tests come first, so that no processor works alone at the end.
    tests = [(point, seed) for point in sorted(points, key=lambda point: -point.actions) for seed in seeds]

    def plan_of(point: Point) -> TestPlan:
        return replace(plan, n_actions=point.actions, policy=point.policy)

    results = run_logged(tests, plan_of, log, jobs, executor, on_trials)
    summaries = []
    for point in points:
        scored = [results[point, seed] for seed in seeds]
        rates = [test.success[0] / test.success[1] for test in scored]
        summaries.append(
            {
                "actions": point.actions,
                "policy": point.policy,
                "success": mean(rates),
                "interval95": list(pooled_interval(scored, "success")),
                "standard_error": standard_error(rates),
                "tests": len(scored),
            }
        )
    return summaries


def table_of_points(points: Sequence[Mapping[str, Any]], title: str = "") -> Table:
    """Return the points of Figure 3, a row for each number of actions, a column for each policy.

    Raises:
        InvalidInputError: A point lacks "actions", "policy", "success" or "interval95", or one of them is none.
    """
    rates = rates_of(points, "points", ["policy"])
    policies = list(dict.fromkeys(rate.names[0] for rate in rates))
    by_place = {(rate.actions, rate.names[0]): rate for rate in rates}
    rows: list[tuple[Cell, ...]] = []
    for actions in dict.fromkeys(rate.actions for rate in rates):
        found = [by_place.get((actions, policy)) for policy in policies]
        rows.append((str(actions), *("" if rate is None else _bar(rate) for rate in found)))
    return Table(title or "Success by actions", ("actions", *policies), tuple(rows), "success; 95 % intervals")


def _bar(rate: Rate) -> Bar:
    return Bar(rate.success, f"{100 * rate.success:.1f} % ({100 * rate.low:.1f}–{100 * rate.high:.1f})")
