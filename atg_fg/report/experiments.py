"""The result of an experiment, as ``--json`` writes it, as tables and plots with intervals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, TypeAlias

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.statistics import wilson_interval
from atg_fg.experiments.document_tables import (
    ACTIONS,
    SUCCESS,
    action_rates,
    curve_numbers,
    detection_rates,
    goal_rates,
    per_cent,
    places_of,
    tables_of,
)
from atg_fg.report.content import Plot, Point, Report, Series, shown_parameters
from atg_fg.storage.checked_json import read_info

_Plots: TypeAlias = Callable[[Mapping[str, Any]], list[Plot]]


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
        tables, plots = tables_of(document), make(document)
        parameters = shown_parameters(document.get("parameters", {}))
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, ZeroDivisionError, OverflowError) as error:
        if isinstance(error, InvalidInputError) and str(error).startswith(place):
            raise
        raise InvalidInputError(f"{place}: {error!r}; expected a result that atg-fg {command} --json wrote") from error
    if not any(table.rows for table in tables):
        raise InvalidInputError(f"{place}: no results; expected at least one")
    drawn = [plot for plot in plots if any(series.points for series in plot.series)]
    return Report(title, parameters, tables=tuple(tables), plots=tuple(drawn))


def _table1(document: Mapping[str, Any]) -> list[Plot]:
    tests = document["tests"]
    # In each test the successes are of as many trials as were identified or not.
    points = [
        Point(float(number), *_scaled(_of(round(test["success"] * total), total)), f"seed {test['seed']}")
        for number, (test, total) in enumerate((test, int(test["identification"][1])) for test in tests)
    ]
    mean = [Point(number, per_cent(document["average"]["success"])) for number in (-0.4, len(tests) - 0.6)]
    series = (Series("a test, 95 % Wilson interval", tuple(points), joined=False), Series("average", tuple(mean)))
    return [Plot("Success of each test", "seed", SUCCESS, series, tuple(str(test["seed"]) for test in tests))]


def _curves(title: str, points: Sequence[Mapping[str, Any]], kind: str) -> Plot:
    """Return success over the number of actions, one curve a ``kind``."""
    found = {(point["actions"], str(point[kind])): point for point in points}
    series = [
        Series(
            name,
            tuple(
                Point(float(actions), *_scaled((point["success"], point["interval95"])), f"{name}, {actions} actions")
                for actions in curve_numbers(points)
                if (point := found.get((actions, name))) is not None
            ),
        )
        for name in dict.fromkeys(str(point[kind]) for point in points)
    ]
    return Plot(title, ACTIONS, f"{SUCCESS}, with 95 % Wilson intervals", tuple(series))


def _rates(title: str, rates: Mapping[str, Mapping[str, Any]]) -> Plot:
    """Return counted rates as points with intervals, those that there were any of."""
    some = {name.replace("_", " "): rate for name, rate in rates.items() if rate["rate"] is not None}
    found = {name: (rate["rate"], rate["interval95"]) for name, rate in some.items()}
    return _by_name(title, "", "%", "rate", found)


def _compare(document: Mapping[str, Any]) -> list[Plot]:
    ran = {name: engine["same_decision"] for name, engine in document["engines"].items() if not engine["refused"]}
    found = {name: (decision["rate"], decision["interval95"]) for name, decision in ran.items()}
    return [_by_name("Same decision as exact inference", "", "%", "same decision", found)]


def _rescore(document: Mapping[str, Any]) -> list[Plot]:
    tests = document["tests"]
    found = {test["file"]: (test["success"][0] / test["success"][1], test["interval95"]) for test in tests}
    return [
        replace(_by_name("Success", "test", SUCCESS, "success", found), categories=tuple(map(str, range(len(tests)))))
    ]


def _by_name(
    title: str, x_label: str, y_label: str, what: str, found: Mapping[str, tuple[float, Sequence[float]]]
) -> Plot:
    """Return rates with their intervals, each over its name."""
    points = [Point(float(place), *_scaled(rate), name) for place, (name, rate) in enumerate(found.items())]
    series = Series(f"{what}, 95 % Wilson interval", tuple(points), joined=False)
    return Plot(title, x_label, y_label, (series,), tuple(found))


def _calibrate(document: Mapping[str, Any]) -> list[Plot]:
    """Show what was found against what was predicted; the diagonal is a calibrated engine."""
    points = [
        Point(per_cent(each["predicted"]), *_scaled(_of(round(each["found"] * each["count"]), each["count"])))
        for each in document["reliability"]
        if each["count"]
    ]
    series = (
        Series("found, 95 % Wilson interval", tuple(points), joined=False),
        Series("as predicted", (Point(0.0, 0.0), Point(100.0, 100.0))),
    )
    return [Plot("Calibration", "predicted, %", "found, %", series)]


def _of(count: int, total: int) -> tuple[float, tuple[float, float]]:
    return count / total, wilson_interval(count, total)


def _scaled(rate: tuple[float, Sequence[float]]) -> tuple[float, float, float]:
    """Return a rate and the bounds of its interval in per cent."""
    value, (low, high) = rate
    return per_cent(value), per_cent(low), per_cent(high)


#: Commands whose results can be shown, with the page's heading.
EXPERIMENTS: Final[Mapping[str, tuple[str, _Plots]]] = {
    "table1": ("Table 1", _table1),
    "figure3": (
        "Figure 3",
        lambda document: [_curves("Success rate by number of actions", document["points"], "policy")],
    ),
    "ablation": (
        "What each part of the model adds",
        lambda document: [_curves(place, cells, "variant") for place, cells in places_of(document["cells"]).items()],
    ),
    "goal": ("Reaching a goal", lambda document: [_rates(*goal_rates(document))]),
    "compare": ("Engines compared", _compare),
    "rescore": ("Recorded tests, judged by another model", _rescore),
    "calibrate": ("Calibration of an engine", _calibrate),
    "sim reliability": (
        "Reliability of the robot",
        lambda document: [_rates(*action_rates(document)), _rates(*detection_rates(document))],
    ),
}
