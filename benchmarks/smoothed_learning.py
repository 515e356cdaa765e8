"""Does the memory keep better ATGs if it learns from smoothed patterns? The same tests with and without, paired.

Run with ``python benchmarks/smoothed_learning.py [TESTS]``. Ideal world with 10 % missing detections, preset
``default``. A look is learned rightly if the memory took the pattern that was shown, for an ATG of that object. An ATG
is right if all that it learned is. Differences carry the 95 % interval of a paired mean over tests.
"""

from __future__ import annotations

import math
import statistics
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from rich.console import Console
from rich.table import Table

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.records import TrialSummary
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.storage.recorded_test import recorded_tests

PLAN = TestPlan(engine="bayes-filter", world_options={"missing": 0.1})
MEASURES = (
    "success, %",
    "looks learned rightly",
    "looks learned wrongly",
    "transitions learned rightly",
    "ATGs right, %",
)


def quality(trials: Sequence[TrialSummary]) -> tuple[float, ...]:
    """Return the last four measures of a test from its records."""
    alphabet = arcube_assumptions().alphabet
    owner: dict[str, object] = {}
    sound: dict[str, bool] = {}
    right = wrong = transitions = 0
    for trial in trials:
        if trial.verdict not in ("known", "novel"):
            continue
        learned, presented = trial.patterns, trial.object
        name = trial.matched or f"object-{len(owner):03}"
        truth = [alphabet.patterns.index(tuple(step.truth["pattern"])) for step in trial.steps]
        owner.setdefault(name, presented)
        good = [pattern == shown and owner[name] == presented for pattern, shown in zip(learned, truth, strict=True)]
        known = [pattern is not None for pattern in learned]
        right += sum(good)
        wrong += sum(known) - sum(good)
        transitions += sum(one and other for one, other in pairwise(good))
        sound[name] = sound.get(name, True) and sum(known) == sum(good)
    return right, wrong, transitions, 100 * sum(sound.values()) / len(sound)


def measured(plan: TestPlan, seed: int) -> tuple[float, ...]:
    """Run a test and return all measures."""
    with tempfile.TemporaryDirectory() as folder:
        result = run_test(plan, seed, Path(folder))
        (file,) = Path(folder).iterdir()
        return (100 * result.success[0] / result.success[1], *quality(recorded_tests(file)[0].trials))


def main() -> None:
    """Print the table."""
    n_tests = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    raw = [measured(PLAN, seed) for seed in range(n_tests)]
    smoothed = [measured(replace(PLAN, smoothed_learning=True), seed) for seed in range(n_tests)]
    table = Table(title=f"{n_tests} tests of 100 trials, seeds 0 to {n_tests - 1}", title_justify="left")
    for heading in ("mean of a test", "raw", "smoothed", "difference, paired"):
        table.add_column(heading, justify="left" if heading == "mean of a test" else "right")
    for number, name in enumerate(MEASURES):
        pairs = [(one[number], other[number]) for one, other in zip(raw, smoothed, strict=True)]
        differences = [other - one for one, other in pairs]
        margin = 1.96 * statistics.stdev(differences) / math.sqrt(n_tests)
        before, after = (statistics.fmean(column) for column in zip(*pairs, strict=True))
        table.add_row(name, f"{before:.1f}", f"{after:.1f}", f"{statistics.fmean(differences):+.1f} ± {margin:.1f}")
    Console(highlight=False).print(table)


if __name__ == "__main__":
    main()
