"""The result of an experiment, as ``--json`` writes it, as tables and plots with intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeAlias

from atg_fg.core.checks import number, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.statistics import wilson_interval
from atg_fg.report.content import Plot, Point, Report, Series, Table, shown_parameters
from atg_fg.storage.checked_json import read_info

_Views: TypeAlias = tuple[list[Table], list[Plot]]

_SUCCESS: Final = "success, %"
#: That a plot has room for.
_MOST_ACTIONS: Final = 10**6
_ACTIONS: Final = "actions a trial"


def read_experiment(document: Mapping[str, Any], place: str) -> Report:
    """Return the page of an experiment.

    Args:
        document: The result, with its ``command`` one of ``EXPERIMENTS``.
        place: Named in errors.

    Raises:
        InvalidInputError: A field is missing or is not what was expected.
    """
    command = str(document["command"])
    title, make = EXPERIMENTS[command]
    try:
        read_info(document, place)
        tables, plots = make(document)
        parameters = shown_parameters(document.get("parameters", {}))
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, ZeroDivisionError, OverflowError) as error:
        if isinstance(error, InvalidInputError) and str(error).startswith(place):
            raise
        raise InvalidInputError(f"{place}: {error!r}; expected a result that atg-fg {command} --json wrote") from error
    if not any(table.rows for table in tables):
        raise InvalidInputError(f"{place}: no results; expected at least one")
    drawn = [plot for plot in plots if any(series.points for series in plot.series)]
    return Report(title, parameters, tables=tuple(tables), plots=tuple(drawn))


def _table1(document: Mapping[str, Any]) -> _Views:
    names = ("identification", "recognition", "success")
    average, intervals, errors = (document[key] for key in ("average", "interval95", "standard_error"))
    summary = [(name, _percent(average[name]), _interval(intervals[name]), _percent(errors[name])) for name in names]
    tests = document["tests"]
    rows = [
        (str(test["seed"]), *(_count(test[name]) for name in names[:2]), _percent(test["success"]), *_endings(test))
        for test in tests
    ]
    # In each test the successes are of as many trials as were identified or not.
    points = [
        Point(float(number), *_scaled(_of(round(test["success"] * total), total)), f"seed {test['seed']}")
        for number, (test, total) in enumerate((test, int(test["identification"][1])) for test in tests)
    ]
    mean = [Point(number, 100 * average["success"]) for number in (-0.4, len(tests) - 0.6)]
    return (
        [
            Table("Averages over tests", ("", "average", "95 % interval", "standard error"), tuple(summary)),
            Table("Tests", ("seed", "identification", "recognition", "success", "lost", "undecided"), tuple(rows)),
        ],
        [
            Plot(
                "Success of each test", "seed", _SUCCESS,
                (Series("a test, 95 % Wilson interval", tuple(points), joined=False), Series("average", tuple(mean))),
                tuple(str(test["seed"]) for test in tests),
            )
        ],
    )  # fmt: skip


def _endings(test: Mapping[str, Any]) -> tuple[str, str]:
    return str(test.get("lost", 0)), str(test.get("undecided", 0))


def _figure3(document: Mapping[str, Any]) -> _Views:
    table, plot = _curves("Success rate by number of actions", document["points"], "policy")
    return [table], [plot]


def _ablation(document: Mapping[str, Any]) -> _Views:
    cells = document["cells"]
    places = dict.fromkeys((cell["world"], cell["noise"]) for cell in cells)
    tables, plots = [], []
    for world, noise in places:
        chosen = [cell for cell in cells if (cell["world"], cell["noise"]) == (world, noise)]
        table, plot = _curves(f"World {world}, noise {noise}", chosen, "variant")
        tables.append(table)
        plots.append(plot)
    return tables, plots


def _curves(title: str, points: Sequence[Mapping[str, Any]], kind: str) -> tuple[Table, Plot]:
    """Return success over the number of actions, one curve and one column a ``kind``."""
    names = list(dict.fromkeys(str(point[kind]) for point in points))
    found = {(point["actions"], str(point[kind])): point for point in points}
    numbers = sorted({whole_number(point["actions"], "actions", 1, _MOST_ACTIONS) for point in points})
    rows = [
        (str(number), *(_rate_at(found.get((number, name))) for name in names)) for number in numbers
    ]  # fmt: skip
    series = [
        Series(
            name,
            tuple(
                Point(float(number), *_scaled((point["success"], point["interval95"])), f"{name}, {number} actions")
                for number in numbers
                if (point := found.get((number, name))) is not None
            ),
        )
        for name in names
    ]
    plot = Plot(title, _ACTIONS, f"{_SUCCESS}, with 95 % Wilson intervals", tuple(series))
    return Table(title, (_ACTIONS, *names), tuple(rows)), plot


def _rate_at(point: Mapping[str, Any] | None) -> str:
    return "–" if point is None else _rate(point["success"], point["interval95"])


_GOAL_RATES: Final = {
    "reached": "goals reached",
    "reachable": "goals with a known path",
    "reached_of_reachable": "of these reached",
    "declared_of_unreachable": "without a known path, declared so",
    "runs_with_all_reachable_reached": "runs with all known ones reached",
    "wrong_success": "said to be reached, but not shown",
    "wrong_object": "taken for another object",
    "optimal": "ways as short as can be",
}
_GOAL_NUMBERS: Final = {
    "recognition_actions": "actions to recognise, mean",
    "goal_actions": "actions to a goal reached, mean",
    "optimum": "fewest possible, mean",
    "exhausted": "goals for which the actions ran out",
    "lost": "objects lost",
}


def _goal(document: Mapping[str, Any]) -> _Views:
    numbers = [(label, _number(document[name])) for name, label in _GOAL_NUMBERS.items()]
    table, plot = _rates(
        f"{document['runs']} runs, {document['goals']} goals",
        {label: document[name] for name, label in _GOAL_RATES.items()},
    )
    return [table, Table("Numbers", ("", "value"), tuple(numbers))], [plot]


def _reliability(document: Mapping[str, Any]) -> _Views:
    actions, plot = _rates("Actions that came out right", {"all": document["success"], **document["by_action"]})
    looks, seen = _rates("Slots detected, of all looks", document["detection"])
    return [actions, looks], [plot, seen]


def _rates(title: str, rates: Mapping[str, Mapping[str, Any]]) -> tuple[Table, Plot]:
    """Return counted rates as a table, and as points with intervals for those that there were any of."""
    names = {name.replace("_", " "): rate for name, rate in rates.items()}
    rows = [
        (name, f"{rate['count']} of {rate['of']}", _percent(rate["rate"]), _interval(rate["interval95"]))
        for name, rate in names.items()
    ]
    some = {name: rate for name, rate in names.items() if rate["rate"] is not None}
    points = [
        Point(float(place), *_scaled((rate["rate"], rate["interval95"])), name)
        for place, (name, rate) in enumerate(some.items())
    ]
    series = Series("rate, 95 % Wilson interval", tuple(points), joined=False)
    plot = Plot(title, "", "%", (series,), tuple(some))
    return Table(title, ("", "count", "rate", "95 % interval"), tuple(rows)), plot


def _compare(document: Mapping[str, Any]) -> _Views:
    engines = document["engines"]
    rows = [(name, *_engine_row(engine)) for name, engine in engines.items()]
    ran = {name: engine for name, engine in engines.items() if not engine["refused"]}
    points = [
        Point(float(place), *_scaled((engine["same_decision"]["rate"], engine["same_decision"]["interval95"])), name)
        for place, (name, engine) in enumerate(ran.items())
    ]
    columns = ("engine", "exact", "total variation, mean / worst", "same decision, %", "time ratio (quartiles)")
    series = Series("same decision, 95 % Wilson interval", tuple(points), joined=False)
    return (
        [Table("Engines on the same trials", columns, tuple(rows))],
        [Plot("Same decision as exact inference", "", "%", (series,), tuple(ran))],
    )


def _engine_row(engine: Mapping[str, Any]) -> tuple[str, str, str, str]:
    exact = "yes" if engine["exact"] else "no"
    if engine["refused"]:
        return exact, "refused: too large", "–", "–"
    variation, decision, ratio = engine["total_variation"], engine["same_decision"], engine["time_ratio"]
    low, high = ratio["quartiles"]
    return (
        exact,
        f"{variation['mean']:.2g} / {variation['worst']:.2g}",
        _rate(decision["rate"], decision["interval95"]),
        f"{ratio['median']:.3g} ({low:.3g}–{high:.3g})",
    )


def _rescore(document: Mapping[str, Any]) -> _Views:
    tests = document["tests"]
    rows = [
        (
            test["file"],
            _count(test["identification"]),
            _count(test["recognition"]),
            _rate(test["success"][0] / test["success"][1], test["interval95"]),
        )
        for test in tests
    ]
    points = [
        Point(float(place), *_scaled((test["success"][0] / test["success"][1], test["interval95"])), test["file"])
        for place, test in enumerate(tests)
    ]
    series = Series("success, 95 % Wilson interval", tuple(points), joined=False)
    table = Table("Recorded tests", ("test", "identification", "recognition", _SUCCESS), tuple(rows))
    return [table], [Plot("Success", "test", _SUCCESS, (series,), tuple(str(place) for place in range(len(tests))))]


def _calibrate(document: Mapping[str, Any]) -> _Views:
    """Show what was found against what was predicted; the diagonal is a calibrated engine."""
    bins = [each for each in document["reliability"] if each["count"]]
    rows = [
        (f"{each['from']:.1f}", str(each["count"]), _percent(each["predicted"]), _percent(each["found"]))
        for each in bins
    ]
    points = [
        Point(100 * each["predicted"], *_scaled(_of(round(each["found"] * each["count"]), each["count"])))
        for each in bins
    ]
    series = (
        Series("found, 95 % Wilson interval", tuple(points), joined=False),
        Series("as predicted", (Point(0.0, 0.0), Point(100.0, 100.0))),
    )
    table = Table("Probabilities and how often they came true", ("from", "count", "predicted", "found"), tuple(rows))
    return [table], [Plot("Calibration", "predicted, %", "found, %", series)]


def _of(count: int, total: int) -> tuple[float, tuple[float, float]]:
    return count / total, wilson_interval(count, total)


def _scaled(rate: tuple[float, Sequence[float]]) -> tuple[float, float, float]:
    """Return a rate and the bounds of its interval in per cent."""
    value, (low, high) = rate
    return _share(value), _share(low), _share(high)


def _share(rate: float) -> float:
    """Return a rate in per cent, or raise ``InvalidInputError`` if it is none."""
    return 100 * number(rate, "rate", 0.0, 1.0, slack=1e-9)


def _percent(rate: float | None) -> str:
    return "–" if rate is None else f"{_share(rate):.1f} %"


def _interval(bounds: Sequence[float] | None) -> str:
    if bounds is None:
        return "–"
    low, high = bounds
    return f"{_share(low):.1f}–{_share(high):.1f} %"


def _rate(rate: float, bounds: Sequence[float]) -> str:
    low, high = bounds
    return f"{_share(rate):.1f} ({_share(low):.1f}–{_share(high):.1f})"


def _count(counts: Sequence[int]) -> str:
    right, total = counts
    return f"{whole_number(right, 'count', 0, whole_number(total, 'count'))} of {total}"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}" if isinstance(value, float) else str(value)


#: Commands whose results can be shown, with the page's heading.
EXPERIMENTS: Final[Mapping[str, tuple[str, Callable[[Mapping[str, Any]], _Views]]]] = {
    "table1": ("Table 1", _table1),
    "figure3": ("Figure 3", _figure3),
    "ablation": ("What each part of the model adds", _ablation),
    "goal": ("Reaching a goal", _goal),
    "compare": ("Engines compared", _compare),
    "rescore": ("Recorded tests, judged by another model", _rescore),
    "calibrate": ("Calibration of an engine", _calibrate),
    "sim reliability": ("Reliability of the robot", _reliability),
}
