"""What does a trial that ends when its verdict is settled save? Success and actions, beside fixed numbers of actions.

Run with ``python benchmarks/stopping.py [TESTS]``. Ideal world, preset ``default``, entropy policy, tests of 100
trials; a trial that can end early has up to 20 actions. 95 % intervals over all trials.
"""

from __future__ import annotations

import sys

from rich.console import Console
from rich.table import Table

from atg_fg.experiments.scores import actions_a_trial, pooled_interval, summarise
from atg_fg.experiments.table1 import TestPlan, run_test

MOST = 20
THRESHOLDS = (0.3, 0.1, 0.03, 0.01)
FIXED = (4, 6, 8, 10, 12, 13, 14, 16, 20)


def main() -> None:
    """Print the table."""
    n_tests = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    plans = [TestPlan(engine="bayes-filter", n_actions=MOST, settled=settled) for settled in THRESHOLDS]
    plans += [TestPlan(engine="bayes-filter", n_actions=number) for number in FIXED]
    table = Table(title=f"{n_tests} tests of 100 trials, seeds 0 to {n_tests - 1}", title_justify="left")
    for heading in ("settled at, nats", "actions a trial", "identification, %", "recognition, %", "success, %"):
        table.add_column(heading, justify="right")
    for plan in plans:
        tests = [run_test(plan, seed) for seed in range(n_tests)]
        number, average = actions_a_trial(tests), summarise(tests)["average"]
        low, high = number["interval95"]
        spread = "" if plan.settled is None else f" ({low:.2f}-{high:.2f})"
        rates = [
            "{:.1f} ({:.1f}-{:.1f})".format(100 * average[score], *(100 * end for end in pooled_interval(tests, score)))
            for score in ("identification", "recognition", "success")
        ]
        table.add_row("-" if plan.settled is None else f"{plan.settled}", f"{number['mean']:.2f}{spread}", *rates)
    Console(highlight=False, width=120).print(table)


if __name__ == "__main__":
    main()
