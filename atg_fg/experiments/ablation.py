"""The ablation: what each part of the model adds, by number of actions and by noise, each test logged as it ends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from atg_fg.core.statistics import mean, standard_error
from atg_fg.engines import usual_engine
from atg_fg.experiments.result_log import ResultLog, run_logged
from atg_fg.experiments.scores import TestResult, pooled_interval
from atg_fg.experiments.table1 import TestPlan
from atg_fg.storage.presets import preset


@dataclass(frozen=True)
class Variant:
    """A way to recognise.

    Attributes:
        preset: Name of the parameters.
        policy: Name of the policy.
    """

    preset: str
    policy: str = "entropy"


#: What is compared, by name: each adds to the one before.
VARIANTS: Final[dict[str, Variant]] = {
    "paper": Variant("paper"),
    "default": Variant("default"),
    "learned": Variant("learned"),
    "learned + lookahead": Variant("learned", "lookahead-2-pruned"),
}

#: Options of the world, by name.
NOISES: Final[dict[str, dict[str, float]]] = {
    "ideal": {},
    "2% slip, 0.5% wrong": {"slip": 0.02, "wrong": 0.005},
    "5% slip, 1% wrong": {"slip": 0.05, "wrong": 0.01},
    "10% missing": {"missing": 0.10},
}


@dataclass(frozen=True)
class Cell:
    """One entry of the table, of several tests.

    Attributes:
        variant: Name in ``VARIANTS``.
        world: Name of the world.
        noise: Name in ``NOISES``.
        actions: Actions a trial.
    """

    variant: str
    world: str
    noise: str
    actions: int

    def plan(self, n_trials: int) -> TestPlan:
        """Return the plan of each test."""
        variant = VARIANTS[self.variant]
        parameters = preset(variant.preset)
        return TestPlan(
            world=self.world,
            world_options=dict(NOISES[self.noise]),
            engine=usual_engine(parameters, "bayes-filter"),
            policy=variant.policy,
            parameters=parameters,
            n_actions=self.actions,
            n_trials=n_trials,
        )


class AblationLog(ResultLog[Cell]):
    """Tests of cells that have been run.

    Args:
        path: The file, ``….jsonl``.
        n_trials: Trials a test; a file with others is refused.

    Raises:
        InvalidInputError: The file cannot be read, or is of other tests.
    """

    def __init__(self, path: Path, n_trials: int) -> None:
        header = {"format": "atg-fg/ablation", "version": 1, "trials": n_trials}
        super().__init__(path, "an ablation", header, Cell)


def run_ablation(
    cells: Sequence[Cell],
    seeds: Sequence[int],
    n_trials: int,
    log: AblationLog | None = None,
    jobs: int = 1,
    on_trials: Callable[[int], None] | None = None,
    executor: str = "process",
) -> dict[Cell, list[TestResult]]:
    """Run every cell with every seed, but for what the log holds, and return the results in the order of ``cells``.

    The results are the same for any executor and number of jobs, and after any interruption.

    Args:
        cells: What is to be run.
        seeds: Of the tests of each cell; the same for all, so that differences can be paired.
        n_trials: Trials a test.
        log: Where each test is kept as it ends.
        jobs: As for ``run_tests``.
        on_trials: As for ``run_logged``.
        executor: As for ``run_tests``.
    """
    # The tests run seed by seed: a run that is cut off has equally many tests in each cell. Within a seed the longest
    # tests come first, so that no processor works alone at the end. Each variant does more than the one before it.
    variants = list(VARIANTS)
    longest_first = sorted(cells, key=lambda cell: (-variants.index(cell.variant), -cell.actions))
    tests = [(cell, seed) for seed in sorted(seeds) for cell in longest_first]
    results = run_logged(tests, lambda cell: cell.plan(n_trials), log, jobs, executor, on_trials)
    return {cell: [results[cell, seed] for seed in seeds] for cell in cells}


def summarise_ablation(results: dict[Cell, list[TestResult]], reference: str = "default") -> list[dict[str, Any]]:
    """Return the success of each cell with its interval, and its paired difference to ``reference`` if that was run."""
    return [
        {
            **asdict(cell),
            "tests": len(tests),
            "success": mean(_rates(tests)),
            "interval95": list(pooled_interval(tests, "success")),
            "standard_error": standard_error(_rates(tests)),
            "above_reference": _paired(tests, results.get(Cell(reference, cell.world, cell.noise, cell.actions))),
        }
        for cell, tests in results.items()
    ]


def _rates(tests: Iterable[TestResult]) -> list[float]:
    return [test.success[0] / test.success[1] for test in tests]


def _paired(tests: Sequence[TestResult], reference: Sequence[TestResult] | None) -> dict[str, float | None] | None:
    """Return the mean difference of success to the same seeds of the reference, with its standard error."""
    if reference is None or reference is tests:
        return None
    differences = [ours - theirs for ours, theirs in zip(_rates(tests), _rates(reference), strict=True)]
    return {"mean": mean(differences), "standard_error": standard_error(differences)}
