"""The tables of a result, as ``--json`` writes it: one layout for the command line and for pages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from atg_fg.core.checks import number, whole_number
from atg_fg.core.table import Table

SUCCESS: Final = "success, %"
ACTIONS: Final = "actions a trial"
#: Actions a trial that a plot has room for.
_MOST_ACTIONS: Final = 10**6

#: Rates of the goal experiment by their names in its result, with what a reader calls them.
GOAL_RATES: Final = {
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


def tables_of(document: Mapping[str, Any]) -> list[Table]:
    """Return the tables of a result whose ``command`` is one of ``TABLES``.

    Raises:
        InvalidInputError: Something that should be a rate or a count is none.
        KeyError, IndexError, TypeError, ValueError, AttributeError, ZeroDivisionError: It is no such result.
    """
    return TABLES[str(document["command"])](document)


def curve_numbers(points: Sequence[Mapping[str, Any]]) -> list[int]:
    """Return the numbers of actions that there are points for, ascending."""
    return sorted({whole_number(point["actions"], "actions", 1, _MOST_ACTIONS) for point in points})


def places_of(cells: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    """Return the cells of an ablation by world and noise, in words."""
    places: dict[str, list[Mapping[str, Any]]] = {}
    for cell in cells:
        places.setdefault(f"World {cell['world']}, noise {cell['noise']}", []).append(cell)
    return places


def goal_rates(document: Mapping[str, Any]) -> tuple[str, dict[str, Mapping[str, Any]]]:
    """Return the title, and the rates by what a reader calls them, of a result of the goal experiment."""
    return f"{document['runs']} runs, {document['goals']} goals", {
        label: document[name] for name, label in GOAL_RATES.items()
    }


def action_rates(document: Mapping[str, Any]) -> tuple[str, dict[str, Mapping[str, Any]]]:
    """Return the title, and the rates by action, of a result of the robot's reliability."""
    return "Actions that came out right", {"all": document["success"], **document["by_action"]}


def detection_rates(document: Mapping[str, Any]) -> tuple[str, dict[str, Mapping[str, Any]]]:
    """Return the title, and the rates by slot, of a result of the robot's reliability; of boxes, how many it found."""
    if "boxes" in document:
        return "Boxes found, of all looks", {"all": document["boxes"]["found"]}
    return "Slots detected, of all looks", document["detection"]


def per_cent(rate: float) -> float:
    """Return a rate in per cent, or raise ``InvalidInputError`` if it is none."""
    return 100 * number(rate, "rate", 0.0, 1.0, slack=1e-9)


def _table1(document: Mapping[str, Any]) -> list[Table]:
    names = ("identification", "recognition", "success")
    average, intervals, errors = (document[key] for key in ("average", "interval95", "standard_error"))
    summary = [(name, _percent(average[name]), _interval(intervals[name]), _percent(errors[name])) for name in names]
    rows = [
        (
            str(test["seed"]),
            *(_count(test[name]) for name in names[:2]),
            _percent(test["success"]),
            *(str(test.get(ending, 0)) for ending in ("lost", "undecided")),
        )
        for test in document["tests"]
    ]
    return [
        Table("Averages over tests", ("", "average", "95 % interval", "standard error"), tuple(summary)),
        Table("Tests", ("seed", "identification", "recognition", "success", "lost", "undecided"), tuple(rows)),
    ]


def _curves(title: str, points: Sequence[Mapping[str, Any]], kind: str) -> Table:
    """Return success over the number of actions, one column a ``kind``."""
    names = list(dict.fromkeys(str(point[kind]) for point in points))
    found = {(point["actions"], str(point[kind])): point for point in points}
    rows = [
        (str(actions), *(_rate_at(found.get((actions, name))) for name in names)) for actions in curve_numbers(points)
    ]
    return Table(title, (ACTIONS, *names), tuple(rows))


def _goal(document: Mapping[str, Any]) -> list[Table]:
    numbers = [(label, _number(document[name])) for name, label in _GOAL_NUMBERS.items()]
    return [_rates(*goal_rates(document)), Table("Numbers", ("", "value"), tuple(numbers))]


def _rates(title: str, rates: Mapping[str, Mapping[str, Any]]) -> Table:
    """Return counted rates."""
    rows = [
        (
            name.replace("_", " "),
            f"{rate['count']} of {rate['of']}",
            _percent(rate["rate"]),
            _interval(rate["interval95"]),
        )
        for name, rate in rates.items()
    ]
    return Table(title, ("", "count", "rate", "95 % interval"), tuple(rows))


def _compare(document: Mapping[str, Any]) -> list[Table]:
    columns = ("engine", "exact", "total variation, mean / worst", "same decision, %", "time ratio (quartiles)")
    rows = [(name, *_engine_row(engine)) for name, engine in document["engines"].items()]
    return [Table("Engines on the same trials", columns, tuple(rows))]


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


def _rescore(document: Mapping[str, Any]) -> list[Table]:
    rows = [
        (
            "\n".join(test["file"].removesuffix(".jsonl.gz").split("/")[-2:]),  # folder and name
            _count(test["identification"]),
            _count(test["recognition"]),
            _rate(test["success"][0] / test["success"][1], test["interval95"]),
        )
        for test in document["tests"]
    ]
    return [Table("Recorded tests", ("test", "identification", "recognition", SUCCESS), tuple(rows))]


def _calibrate(document: Mapping[str, Any]) -> list[Table]:
    rows = [
        (f"{each['from']:.1f}", str(each["count"]), _percent(each["predicted"]), _percent(each["found"]))
        for each in document["reliability"]
        if each["count"]
    ]
    columns = ("from", "count", "predicted", "found")
    return [Table("Probabilities and how often they came true", columns, tuple(rows))]


def _percent(rate: float | None) -> str:
    return "–" if rate is None else f"{per_cent(rate):.1f} %"


def _interval(bounds: Sequence[float] | None) -> str:
    if bounds is None:
        return "–"
    low, high = bounds
    return f"{per_cent(low):.1f}–{per_cent(high):.1f} %"


def _rate_at(point: Mapping[str, Any] | None) -> str:
    return "–" if point is None else _rate(point["success"], point["interval95"])


def _rate(rate: float, bounds: Sequence[float]) -> str:
    low, high = bounds
    return f"{per_cent(rate):.1f} ({per_cent(low):.1f}–{per_cent(high):.1f})"


def _count(counts: Sequence[int]) -> str:
    right, total = counts
    return f"{whole_number(right, 'count', 0, whole_number(total, 'count'))} of {total}"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}" if isinstance(value, float) else str(value)


#: Commands whose results have tables.
TABLES: Final[Mapping[str, Callable[[Mapping[str, Any]], list[Table]]]] = {
    "table1": _table1,
    "figure3": lambda document: [_curves("Success rate by number of actions", document["points"], "policy")],
    "ablation": lambda document: [
        _curves(place, cells, "variant") for place, cells in places_of(document["cells"]).items()
    ],
    "goal": _goal,
    "compare": _compare,
    "rescore": _rescore,
    "calibrate": _calibrate,
    "sim reliability": lambda document: [_rates(*action_rates(document)), _rates(*detection_rates(document))],
}
