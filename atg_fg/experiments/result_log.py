"""Results of many tests in a file that grows test by test, and stays readable wherever it is cut off."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, get_type_hints

from atg_fg.core.checks import brief, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.experiments.scores import SCORES, TestResult
from atg_fg.experiments.table1 import TestPlan, run_tests
from atg_fg.storage.checked_json import read_list, read_object
from atg_fg.storage.growing_file import GrowingFile

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


Cell = TypeVar("Cell", bound="DataclassInstance")


class ResultLog(Generic[Cell]):
    """Tests that have been run, a JSON line each, in the order in which they ended.

    Args:
        path: The file, ``….jsonl``.
        experiment: What they are of, in words: ``an ablation``.
        header: The first line, with ``format`` and what all tests have in common; a file with another is refused.
        cell_type: A dataclass that says which test it is, but for its seed; its fields are in each line.

    Raises:
        InvalidInputError: The file cannot be read, or is of other tests.
    """

    def __init__(self, path: Path, experiment: str, header: Mapping[str, Any], cell_type: type[Cell]) -> None:
        self._file = GrowingFile(path, header, f"the log of {experiment}")
        self._cell_type = cell_type
        self._results: dict[tuple[Cell, int], TestResult] = {}
        for number, line in enumerate(self._file.resume(), 2):
            self._take(line, f"{path}: line {number}")

    def get(self, cell: Cell, seed: int) -> TestResult | None:
        """Return the result of a test, ``None`` if it was not run yet."""
        return self._results.get((cell, seed))

    def add(self, cell: Cell, result: TestResult) -> None:
        """Add the result of a test.

        Raises:
            InvalidInputError: The disk is full, or the file cannot be written for another reason.
        """
        self._results[cell, result.seed] = result
        scores = {name: getattr(result, name) for name in SCORES}
        self._file.append({**asdict(cell), "seed": result.seed, **scores})

    def _take(self, line: Any, place: str) -> None:
        types = get_type_hints(self._cell_type)
        entry = read_object(line, place, (*types, "seed", *SCORES))
        for name, kind in types.items():
            if type(entry[name]) is not kind:
                raise InvalidInputError(f"{place}: {name}: {brief(entry[name])}; expected a {kind.__name__}")
        seed = whole_number(entry["seed"], f"{place}: seed")
        identification, recognition, success = (_count(entry[name], f"{place}: {name}") for name in SCORES)
        cell = self._cell_type(**{name: entry[name] for name in types})
        self._results[cell, seed] = TestResult(seed, identification, recognition, success)


def _count(value: Any, place: str) -> tuple[int, int]:
    """Return a count, and what it is a count of."""
    read_list(value, place, 2)
    of = whole_number(value[1], place)
    return whole_number(value[0], place, 0, of), of


def run_logged(
    tests: Sequence[tuple[Cell, int]],
    plan_of: Callable[[Cell], TestPlan],
    log: ResultLog[Cell] | None = None,
    jobs: int = 1,
    executor: str = "process",
    on_trials: Callable[[int], None] | None = None,
) -> dict[tuple[Cell, int], TestResult]:
    """Run tests, but for what the log holds, and return the result of each.

    Args:
        tests: (cell, seed) of each, in the order in which they are to be begun.
        plan_of: Returns the plan of a cell's tests.
        log: Where each test is kept as it ends.
        jobs: As for ``run_tests``.
        executor: As for ``run_tests``.
        on_trials: Called with the number of trials that were done since the last call; those that the log holds count.
    """
    found = {test: log.get(*test) if log else None for test in tests}
    missing = [test for test, result in found.items() if result is None]
    done = {test: result for test, result in found.items() if result is not None}

    def keep(number: int, result: TestResult) -> None:
        test = missing[number]
        done[test] = result
        if log is not None:
            log.add(test[0], result)

    if on_trials is not None:
        on_trials(sum(plan_of(cell).n_trials for cell, _ in done))
    plans = [(plan_of(cell), seed) for cell, seed in missing]
    run_tests(plans, jobs, executor=executor, on_result=keep, on_trials=on_trials)
    return done
