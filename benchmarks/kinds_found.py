"""How many kinds does the preset ``learned`` find where there are three, and are their members of one kind?

Run with ``python benchmarks/kinds_found.py [TESTS] [SLIP] [WRONG]``. World ``mixed``: cubes, prisms and locks with one
alphabet and the same actions; tests of 100 trials of 10 actions from an empty memory, seeds from 0. A kind is one with
members. Its purity is the share of its members that are of the family of most of them. 95 % Wilson intervals.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.core.statistics import wilson_interval
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.learning.object_kinds import kinds_of
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.memory_files import load_memory
from atg_fg.storage.presets import preset

FAMILIES = 3
#: The family of each of the 100 objects: cubes, then prisms, then locks.
FAMILY_OF = np.repeat(range(FAMILIES), (34, 33, 33))


def kinds_found(plan: TestPlan, seed: int) -> tuple[int, list[Counter[int]]]:
    """Return how many trials of a test succeed, and for each kind found how many members it has of each family."""
    objects: list[int] = []
    with tempfile.TemporaryDirectory() as folder:
        result = run_test(
            plan,
            seed,
            memories=Path(folder),
            on_trial=lambda _, record: objects.append(record.steps[0].truth["object"]),
        )
        memory = load_memory(next(Path(folder).iterdir()))
    assert isinstance(memory, StructuredMemory)
    made_from: dict[str, int] = {}
    for name, presented in zip(memory.learner.owners, objects, strict=True):
        made_from.setdefault(name, presented)
    members = [kind.members for kind in kinds_of(memory) if kind.members]
    families = [Counter(int(FAMILY_OF[made_from[name]]) for name in each) for each in members]
    return result.success[0], families


def main() -> None:
    """Print the table."""
    n_tests = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    slip, wrong = (float(given) for given in [*sys.argv[2:4], "0", "0"][:2])
    table = Table(title=f"mixed, {slip:.1%} slip, {wrong:.1%} wrong looks, preset learned", title_justify="left")
    for heading in ("seed", "success, %", "kinds", "members by family", "purity", "processor time, s"):
        table.add_column(heading, justify="right")
    plan = TestPlan("mixed", {"slip": slip, "wrong": wrong}, "learned-structure", parameters=preset("learned"))
    total = right = pure = members = 0
    for seed in range(n_tests):
        start = time.process_time()
        successes, kinds = kinds_found(plan, seed)
        most, all_members = sum(max(kind.values()) for kind in kinds), sum(map(Counter.total, kinds))
        families = "; ".join(", ".join(map(str, sorted(kind.values(), reverse=True))) for kind in kinds)
        seconds = f"{time.process_time() - start:.1f}"
        table.add_row(str(seed), str(successes), str(len(kinds)), families, f"{most / all_members:.3f}", seconds)
        total, right = total + successes, right + (len(kinds) == FAMILIES)
        pure, members = pure + most, members + all_members
    table.add_section()
    table.add_row(
        "all", _share(total, n_tests * plan.n_trials), f"{right} of {n_tests} right", "", _share(pure, members), ""
    )
    Console(highlight=False, width=140).print(table)


def _share(count: int, of: int) -> str:
    low, high = wilson_interval(count, of)
    return f"{100 * count / of:.1f} ({100 * low:.1f}-{100 * high:.1f})"


if __name__ == "__main__":
    main()
