"""How many random ATGs could anybody tell apart, from the looks that preset ``learned`` took at them?

Run with ``python benchmarks/told_random_atgs.py [TESTS] [FIRST SEED]``. Worlds ``half-and-half`` and ``random-atg``,
100 trials of 10 actions from an empty memory, seeds from 0 if none is given. The observer is told which object each
earlier trial was of, which objects are random ATGs, how many of these there are, and how they were drawn: 24 aspects of
132 patterns, and from each by each action three successors whose probabilities are uniform on the simplex. It sums
over the rest, so that nobody who sees the same looks is right more often on average; how sure it is of its verdicts
says how often that is. 95 % Wilson intervals over trials.
"""

from __future__ import annotations

import copy
import math
import sys
from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.core.records import TrialRecord
from atg_fg.core.statistics import wilson_interval
from atg_fg.experiments.table1 import TestPlan
from atg_fg.storage.presets import preset
from benchmarks.told_everything import recorded

N_OBJECTS, N_ASPECTS, N_PATTERNS, N_SUCCESSORS = 100, 24, 132, 3
#: Number of the first random ATG: the objects before it are cubes.
FIRST = {"half-and-half": N_OBJECTS // 2, "random-atg": 0}


class Known:
    """What earlier trials showed of one random ATG."""

    def __init__(self) -> None:
        self._aspects: set[int] = set()
        self._rows: defaultdict[tuple[int, int], Counter[int]] = defaultdict(Counter)

    def log_evidence(self, patterns: Sequence[int], actions: Sequence[int]) -> float:
        """Return ln p(trial | this object), and learn from the trial as it goes."""
        total = 0.0
        for time, pattern in enumerate(patterns):
            n_known = len(self._aspects)
            # As one of so many aspects that are equally probable, known ones and others.
            share = 1.0 if pattern in self._aspects else (N_ASPECTS - n_known) / (N_PATTERNS - n_known)
            # Nothing is counted yet of what shows the first aspect.
            row = self._rows[patterns[time - 1], actions[time - 1]] if time else Counter[int]()
            further = share * (N_SUCCESSORS - len(row)) / (N_ASPECTS - len(row))
            probability = (1 + row[pattern] if row[pattern] else further) / (N_SUCCESSORS + row.total())
            if not probability > 0:
                return -math.inf
            row[pattern] += 1
            self._aspects.add(pattern)
            total += math.log(probability)
        return total


def judged(trials: Sequence[TrialRecord], first: int) -> list[tuple[int, bool, float]]:
    """Return the number of each trial of a random ATG, whether the observer is right, and how sure it is."""
    known: dict[int, Known] = {}
    result = []
    for number, trial in enumerate(trials):
        presented = int(trial.steps[0].truth["object"])
        if presented < first:
            continue
        patterns = [pattern for pattern in trial.patterns if pattern is not None]
        told = [*copy.deepcopy(known).values(), Known()]
        logarithms = np.array([each.log_evidence(patterns, trial.actions) for each in told])
        n_new = N_OBJECTS - first - len(known)
        logarithms[-1] = logarithms[-1] + math.log(n_new) if n_new else -math.inf
        belief = np.exp(logarithms - logarithms.max())
        belief /= belief.sum()
        truth = list(known).index(presented) if presented in known else len(known)
        result.append((number, int(belief.argmax()) == truth, float(belief.max())))
        known.setdefault(presented, Known()).log_evidence(patterns, trial.actions)
    return result


def main() -> None:
    """Print the table."""
    n_tests, first_seed = (int(given) for given in [*sys.argv[1:3], *("5", "0")[len(sys.argv[1:3]) :]])
    table = Table(title=f"{n_tests} tests of 100 trials, seeds from {first_seed}: success, %", title_justify="left")
    for heading in ("world", "learned", "of cubes", "of random ATGs", "told", "told expects", "all, told of the ATGs"):
        table.add_column(heading, justify="right")
    for world, first in FIRST.items():
        plan = TestPlan(world, engine="learned-structure", parameters=preset("learned"))
        cubes, atgs, told = list[bool](), list[bool](), list[bool]()
        sure: list[float] = []
        for seed in range(first_seed, first_seed + n_tests):
            trials, result = recorded(plan, seed)
            verdicts = judged(trials, first)
            numbers = {number for number, _, _ in verdicts}
            cubes += [right for number, right in enumerate(result.right) if number not in numbers]
            atgs += [result.right[number] for number in numbers]
            told += [right for _, right, _ in verdicts]
            sure += [probability for _, _, probability in verdicts]
        cells = (cubes + atgs, cubes, atgs, told)
        table.add_row(world, *map(_share, cells), f"{100 * np.mean(sure):.1f}", _share(cubes + told))
    Console(highlight=False, width=150).print(table)


def _share(right: Sequence[bool]) -> str:
    if not right:
        return "-"
    low, high = wilson_interval(sum(right), len(right))
    return f"{100 * np.mean(right):.1f} ({100 * low:.1f}-{100 * high:.1f})"


if __name__ == "__main__":
    main()
