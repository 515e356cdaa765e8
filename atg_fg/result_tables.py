"""Results of experiments as small tables: tests of the paper, Figure 3, goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from atg_fg.errors import InvalidInputError
from atg_fg.html_table import Bar, Cell, HtmlTable, shortened
from atg_fg.statistics import mean, wilson_interval

if TYPE_CHECKING:
    from atg_fg.experiments import TestResult
    from atg_fg.goal_scoring import ServedObject

_SCORES: Final = ("identification", "recognition", "success")
_ROWS: Final = 40


def results_table(results: Any, title: str = "") -> HtmlTable:
    """Return a table of results, which a notebook shows and ``print`` prints.

    Args:
        results: One of: ``TestResult`` objects, as ``run_tests`` yields them; a mapping from names to such, to compare
            them; the points of ``figure3_points``; ``ServedObject`` objects, as a run of ``run_many`` has them, or
            several such runs.
        title: Above the table; one that says what it is if not given.

    Raises:
        InvalidInputError: There are none, or they are something else.
    """
    # Not at the top: these modules let their own results show themselves by this one.
    from atg_fg.experiments import TestResult
    from atg_fg.goal_scoring import ServedObject

    if isinstance(results, TestResult):
        return table_of_tests([results], title)
    if isinstance(results, Mapping):
        compared = {str(name): list(tests) for name, tests in results.items()}
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
        f"results: {results!r:.80}; expected test results, a mapping from names to such, points of Figure 3, or goals"
    )


def _all(values: Iterable[object], kind: type) -> bool:
    return all(isinstance(value, kind) for value in values)


def table_of_tests(tests: Sequence[TestResult], title: str = "") -> HtmlTable:
    """Return tests as the paper's Table 1 has them, with the average over tests and intervals over all trials."""
    rows: list[tuple[Cell, ...]] = [
        (str(test.seed), *(_count(getattr(test, score)) for score in _SCORES)) for test in tests
    ]
    rows = list(shortened(rows, _ROWS, "tests"))
    if len(tests) > 1:
        rows.append(("average", *(_average(tests, score) for score in _SCORES)))
    rows.append(("95 % interval", *(_interval(tests, score) for score in _SCORES)))
    endings = [f"{number} {name}" for name in ("lost", "undecided") if (number := sum(getattr(t, name) for t in tests))]
    noun = "test" if len(tests) == 1 else "tests"
    return HtmlTable(title or f"{len(tests)} {noun}", ("seed", *_SCORES), tuple(rows), ", ".join(endings))


def _comparison(compared: Mapping[str, Sequence[TestResult]], title: str) -> HtmlTable:
    rows: list[tuple[Cell, ...]] = []
    for name, tests in compared.items():
        cells = [Bar(_average(tests, score).share, _with_interval(tests, score)) for score in _SCORES]
        rows.append((name, str(len(tests)), *cells))
    note = "averages over tests; 95 % Wilson intervals over all trials"
    return HtmlTable(title or "Tests compared", ("", "tests", *_SCORES), tuple(rows), note)


def table_of_points(points: Sequence[Mapping[str, Any]], title: str = "") -> HtmlTable:
    """Return the points of Figure 3, a row for each number of actions, a column for each policy.

    Raises:
        InvalidInputError: A point lacks "actions", "policy", "success" or "interval95".
    """
    for number, point in enumerate(points):
        for key in ("actions", "policy", "success", "interval95"):
            if key not in point:
                raise InvalidInputError(f"points[{number}]: {dict(point)!r}; expected the key {key!r}")
    policies = list(dict.fromkeys(str(point["policy"]) for point in points))
    by_place = {(point["actions"], str(point["policy"])): point for point in points}
    rows: list[tuple[Cell, ...]] = []
    for actions in dict.fromkeys(point["actions"] for point in points):
        found = [by_place.get((actions, policy)) for policy in policies]
        rows.append((str(actions), *("" if point is None else _point(point) for point in found)))
    return HtmlTable(title or "Success by actions", ("actions", *policies), tuple(rows), "success; 95 % intervals")


def table_of_goals(served: Sequence[ServedObject], title: str = "") -> HtmlTable:
    """Return what came of each goal."""
    rows: list[tuple[Cell, ...]] = [
        (
            str(each.object),
            f"({', '.join('any' if symbol is None else str(symbol) for symbol in each.goal)})",
            each.ending,
            "new" if each.judged_new else "–" if each.matched is None else str(each.matched),
            str(each.recognition_actions),
            f"{each.goal_actions} of at least {each.optimum}",
        )
        for each in served
    ]
    reached = sum(each.ending == "reached" for each in served)
    low, high = wilson_interval(reached, len(served))
    note = f"reached {reached} of {len(served)} ({100 * low:.1f}–{100 * high:.1f} %, 95 % Wilson interval)"
    headings = ("object", "goal", "ending", "taken for", "actions to recognise", "actions to the goal")
    return HtmlTable(
        title or f"{len(served)} {'goal' if len(served) == 1 else 'goals'}",
        headings,
        shortened(rows, _ROWS, "goals"),
        note,
    )


def _count(count: tuple[int, int]) -> Bar:
    right, total = count
    return Bar(right / total if total else 0.0, f"{right}/{total}")


def _average(tests: Sequence[TestResult], score: str) -> Bar:
    counts = [getattr(test, score) for test in tests]
    average = mean([right / total for right, total in counts if total])
    return Bar(average or 0.0, "–" if average is None else f"{100 * average:.1f} %")


def _interval(tests: Sequence[TestResult], score: str) -> str:
    counts = [getattr(test, score) for test in tests]
    total = sum(total for _, total in counts)
    if not total:
        return "–"
    low, high = wilson_interval(sum(right for right, _ in counts), total)
    return f"{100 * low:.1f}–{100 * high:.1f}"


def _with_interval(tests: Sequence[TestResult], score: str) -> str:
    average, interval = _average(tests, score).text, _interval(tests, score)
    return average if interval == "–" else f"{average} ({interval})"


def _point(point: Mapping[str, Any]) -> Bar:
    low, high = point["interval95"]
    return Bar(point["success"], f"{100 * point['success']:.1f} % ({100 * low:.1f}–{100 * high:.1f})")
