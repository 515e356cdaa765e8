"""Results of experiments as small tables: tests of the paper, Figure 3, goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from atg_fg.core.checks import brief, title_or
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.table import Table
from atg_fg.experiments.figure3 import table_of_points
from atg_fg.experiments.goal_scores import ServedObject, table_of_goals
from atg_fg.experiments.scores import TestResult, _comparison, table_of_tests


def results_table(results: Any, title: str = "") -> Table:
    """Return a table of results, which a notebook shows and ``print`` prints.

    Args:
        results: One of: ``TestResult`` objects, as ``run_tests`` yields them; a mapping from names to such, to compare
            them; the points of ``figure3_points``; ``ServedObject`` objects, as a run of ``run_many`` has them, or
            several such runs.
        title: Above the table; one that says what it is if not given.

    Raises:
        InvalidInputError: There are none, or they are something else.
    """
    title = title_or(title, "")
    if isinstance(results, TestResult):
        return table_of_tests([results], title)
    if isinstance(results, Mapping):
        compared = {str(name): list(tests) if isinstance(tests, Iterable) else [] for name, tests in results.items()}
        if compared and all(tests and _all(tests, TestResult) for tests in compared.values()):
            return _comparison(compared, title)
    elif isinstance(results, Iterable):
        found = list(results)
        if found and all(isinstance(each, Sequence) and each and _all(each, ServedObject) for each in found):
            return table_of_goals([goal for run in found for goal in run], title)
        for kind, table in ((TestResult, table_of_tests), (ServedObject, table_of_goals), (Mapping, table_of_points)):
            if found and _all(found, kind):
                return table(found, title)
    raise InvalidInputError(
        f"results: {brief(results)}; expected test results, a mapping from names to such, points of Figure 3, or goals"
    )


def _all(values: Iterable[object], kind: type) -> bool:
    return all(isinstance(value, kind) for value in values)
