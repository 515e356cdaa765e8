"""Results of many tests in a file that grows test by test, and is sound whenever it is cut off."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from atg_fg.core.errors import InvalidInputError
from atg_fg.experiments.scores import TestResult
from atg_fg.experiments.table1 import TestPlan, run_tests
from atg_fg.storage.plain_files import append_bytes, read_bytes_file, write_bytes_atomically

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
        self.path = path
        self._experiment = experiment
        self._header = json.loads(json.dumps(header))
        self._cell_type = cell_type
        self._results: dict[tuple[Cell, int], TestResult] = {}
        if path.exists():
            self._read()
        else:
            write_bytes_atomically(path, _line(self._header))

    def get(self, cell: Cell, seed: int) -> TestResult | None:
        """Return the result of a test, ``None`` if it was not run yet."""
        return self._results.get((cell, seed))

    def add(self, cell: Cell, result: TestResult) -> None:
        """Add the result of a test.

        Raises:
            InvalidInputError: The disk is full, or the file cannot be written for another reason.
        """
        self._results[cell, result.seed] = result
        scores = {name: getattr(result, name) for name in ("identification", "recognition", "success")}
        append_bytes(self.path, _line({**asdict(cell), "seed": result.seed, **scores}))

    def _read(self) -> None:
        try:
            content = read_bytes_file(self.path)
            sound = content[: content.rfind(b"\n") + 1]  # a writer that was cut off leaves at most half a line
            header, *lines = [json.loads(line) for line in sound.split(b"\n")[:-1]]
            if header != self._header:
                raise ValueError(f"holds {json.dumps(header)}, not {json.dumps(self._header)}")
            for line in lines:
                self._take(line)
        except (ValueError, KeyError, TypeError, IndexError, RecursionError) as error:
            raise InvalidInputError(
                f"{self.path}: {error}; expected the log of {self._experiment} with such tests"
            ) from error
        if len(sound) < len(content):
            write_bytes_atomically(self.path, sound)

    def _take(self, line: dict[str, Any]) -> None:
        cell = self._cell_type(**{field.name: line[field.name] for field in fields(self._cell_type)})
        identification, recognition, success = (
            (int(line[name][0]), int(line[name][1])) for name in ("identification", "recognition", "success")
        )
        result = TestResult(int(line["seed"]), identification, recognition, success)
        self._results[cell, result.seed] = result


def _line(entry: dict[str, Any]) -> bytes:
    return (json.dumps(entry) + "\n").encode()


def run_logged(
    tests: Sequence[tuple[Cell, int]],
    plan_of: Callable[[Cell], TestPlan],
    log: ResultLog[Cell] | None = None,
    jobs: int = 1,
    executor: str = "process",
    on_test: Callable[[], None] | None = None,
) -> dict[tuple[Cell, int], TestResult]:
    """Run tests, but for what the log holds, and return the result of each.

    Args:
        tests: (cell, seed) of each, in the order in which they are to be begun.
        plan_of: Returns the plan of a cell's tests.
        log: Where each test is kept as it ends.
        jobs: As for ``run_tests``.
        executor: As for ``run_tests``.
        on_test: Called after each test that is run.
    """
    found = {test: log.get(*test) if log else None for test in tests}
    missing = [test for test, result in found.items() if result is None]
    done = {test: result for test, result in found.items() if result is not None}

    def keep(number: int, result: TestResult) -> None:
        test = missing[number]
        done[test] = result
        if log is not None:
            log.add(test[0], result)
        if on_test is not None:
            on_test()

    plans = [(plan_of(cell), seed) for cell, seed in missing]
    run_tests(plans, jobs, executor=executor, on_result=keep)
    return done
