"""What would a recogniser reach on the world ``detector`` that is told how objects move and how the detector errs?

Run with ``python benchmarks/told_everything.py [TESTS]``. It is told the true automaton, the rates, and what
confidences mean, and learns contents exactly: for each object the probability of all 8^6 contents. It is told nothing
of objects, and its verdicts are final: it learns from each trial as it was judged. So it is no upper bound: the
preset ``learned``, told none of this, judges old trials again. Both judge the same trials of random actions; 95 %
Wilson intervals over trials, seeds from 0. Beside them is where the errors are: in novelty or in identity, and how many
of both are in the first trials.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.core.patterns import FloatArray
from atg_fg.core.records import TrialRecord
from atg_fg.core.statistics import wilson_interval
from atg_fg.experiments.scores import TestResult
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.storage.presets import preset
from atg_fg.worlds.detector_world import LABELS, N_VIEWS, RIGHT_CONFIDENCE, SHARED, WRONG_CONFIDENCE

N_OBJECTS, N_TRIALS, N_ACTIONS = 8, 48, 8
#: Weight of a further object when all that there are should be known.
ONE_TOO_MANY = 0.05
#: Errors in so many trials are counted apart: little is known of objects and noise then.
FIRST = 8
LEVELS = ((0.0, 0.0), (0.05, 0.05), (0.2, 0.1))


def emission(label: int | None, confidence: float | None, wrong: float, missing: float) -> FloatArray:
    """Return p(label, confidence | what is shown) of each label that may be shown, shape [8]."""
    if label is None:
        return np.ones(len(LABELS))
    right, other = max(1.0 - wrong - missing, 1e-6), max(wrong, 1e-6) / (len(LABELS) - 1)
    if confidence is not None:
        right *= _density(confidence, RIGHT_CONFIDENCE)
        other *= _density(confidence, WRONG_CONFIDENCE)
    result = np.full(len(LABELS), other)
    result[label] = right
    return result


def _density(value: float, interval: tuple[float, float]) -> float:
    low, high = interval
    return 1.0 / (high - low) if low - 0.005 <= value <= high + 0.005 else 1e-9


def evidence_of(trial: TrialRecord, wrong: float, missing: float) -> FloatArray:
    """Return p(trial | contents of the six views), summed over first views, shape [8] * 6."""
    total = np.zeros((len(LABELS),) * N_VIEWS)
    for first in range(N_VIEWS):
        views, view = np.ones((N_VIEWS, len(LABELS))), first
        for step in trial.steps:
            (label,), stated = step.detection, step.confidences
            views[view] *= emission(label, stated[0] if stated else None, wrong, missing)
            if step.action is not None:
                view = int(SHARED.successors[view, step.action, 0])
        product = views[0]
        for other in views[1:]:
            product = np.multiply.outer(product, other)
        total += product / N_VIEWS
    return total


class Errors(NamedTuple):
    """What is judged wrong in a test.

    Attributes:
        novelty: Trials of a new object that is taken for a known one, or the other way round.
        identity: Trials of a known object that is taken for another known one.
        first: Those of both among the first ``FIRST`` trials.
    """

    novelty: int
    identity: int
    first: int

    @property
    def total(self) -> int:
        """All of them."""
        return self.novelty + self.identity

    @classmethod
    def of(cls, result: TestResult) -> Errors:
        """Return those of a test of the preset, its verdicts as they were given."""
        (identified, n_trials), (right, _) = result.identification, result.success
        return cls(n_trials - identified, identified - right, result.right[:FIRST].count(False))

    def plus(self, other: Errors) -> Errors:
        """Return those of two tests."""
        return Errors(*(one + another for one, another in zip(self, other, strict=True)))


def errors_of_told(trials: Sequence[TrialRecord], wrong: float, missing: float) -> Errors:
    """Return what is judged wrong, one trial after the other from an empty memory, by one that is told everything."""
    prior = np.full((len(LABELS),) * N_VIEWS, float(len(LABELS)) ** -N_VIEWS)
    contents: list[FloatArray] = []
    made_from: list[Any] = []
    met: set[Any] = set()
    novelty = identity = first = 0
    for number, trial in enumerate(trials):
        presented, table = trial.steps[0].truth["object"], evidence_of(trial, wrong, missing)
        new = max(N_OBJECTS - len(contents), ONE_TOO_MANY)
        weights = np.array([*((each * table).sum() for each in contents), new * (prior * table).sum()])
        best = int(weights[:-1].argmax()) if contents and weights[-1] <= weights.sum() / 2 else None
        is_novelty = (best is None) == (presented in met)
        is_identity = not is_novelty and best is not None and made_from[best] != presented
        novelty, identity = novelty + is_novelty, identity + is_identity
        first += number < FIRST and (is_novelty or is_identity)
        met.add(presented)
        if best is None:
            contents.append(prior)
            made_from.append(presented)
            best = len(contents) - 1
        contents[best] = contents[best] * table
        contents[best] /= contents[best].sum()
    return Errors(novelty, identity, first)


def recorded(plan: TestPlan, seed: int) -> tuple[list[TrialRecord], TestResult]:
    """Return the trials of a test, and its result."""
    trials: list[TrialRecord] = []

    def on_trial(_number: int, record: TrialRecord) -> None:
        trials.append(record)

    return trials, run_test(plan, seed, on_trial=on_trial)


def main() -> None:
    """Print the table."""
    n_tests = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    table = Table(title=f"{n_tests} tests of {N_TRIALS} trials, random actions: success, %", title_justify="left")
    kinds = f"errors: novelty, identity; in the first {FIRST}"
    for heading in ("wrong, missing", "evidence", "told everything", kinds, "learned", kinds, "learned, mended"):
        table.add_column(heading, justify="right")
    for wrong, missing in LEVELS:
        for confidences in (False, True):
            options = {"wrong": wrong, "missing": missing, "confidences": confidences}
            plan = TestPlan(
                world="detector",
                world_options=options,
                engine="learned-structure",
                policy="random",
                parameters=preset("learned"),
                n_actions=N_ACTIONS,
                n_trials=N_TRIALS,
                n_objects=N_OBJECTS,
            )
            told = learned = Errors(0, 0, 0)
            mended = 0
            for seed in range(n_tests):
                trials, result = recorded(plan, seed)
                told = told.plus(errors_of_told(trials, wrong, missing))
                learned = learned.plus(Errors.of(result))
                mended += result.success[0] if result.mended is None else result.mended[0]
            total = n_tests * N_TRIALS
            cells = [
                cell
                for each in (told, learned)
                for cell in (_share(total - each.total, total), f"{each.novelty}, {each.identity}; {each.first}")
            ]
            evidence = "confidences" if confidences else "labels"
            table.add_row(f"{wrong:.2f}, {missing:.2f}", evidence, *cells, _share(mended, total))
    Console(highlight=False, width=150).print(table)


def _share(count: int, total: int) -> str:
    low, high = wilson_interval(count, total)
    return f"{100 * count / total:.1f} ({100 * low:.1f}-{100 * high:.1f})"


if __name__ == "__main__":
    main()
