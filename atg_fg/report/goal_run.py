"""A run of the goal experiment (``atg-fg/goal-run``) as a page: a trial a station, each with its goal."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.report import checked
from atg_fg.report.content import Report, TrialPage, shown_parameters
from atg_fg.report.summaries import read_looks, verdict_of, with_graphs
from atg_fg.storage.checked_json import check_format, parse_json, read_list
from atg_fg.storage.plain_files import read_gzipped_text

GOAL_RUN_FORMAT: Final = "atg-fg/goal-run"
_ENDINGS: Final = {
    "reached": "goal reached",
    "unreachable": "goal declared out of reach",
    "exhausted": "actions ran out",
    "lost": "object lost",
}
_NO_BELIEFS: Final = (
    "A run's record holds the probability that an object was never met, not the belief over single objects, nor the "
    "memory; the graph is of what the trial has shown, unless --memory FILE gives the memory of the run."
)


def read_goal_run(path: Path, memory: RobotMemory | None) -> Report:
    """Return the page of a run.

    Args:
        path: The run's file.
        memory: That the run began with, if given.

    Raises:
        InvalidInputError: The file cannot be read or is not as it should be.
    """
    text = read_gzipped_text(path, "expected a run that --records wrote")
    document = parse_json(text, str(path))
    for key in ("format", "version"):
        checked.field_of(document, key, str(path))
    check_format(document, GOAL_RUN_FORMAT, str(path))
    served = read_list(checked.field_of(document, "served", str(path)), f"{path}: served")
    if not served:
        raise InvalidInputError(f"{path}: served: no goals; expected at least one")
    assumptions = arcube_assumptions() if memory is None else memory.assumptions
    pages = [
        _page(entry, number, memory, assumptions, f"{path}: served[{number}]") for number, entry in enumerate(served)
    ]
    header = {key: value for key, value in document.items() if key not in ("format", "version", "served")}
    reached = sum(entry["ending"] == "reached" for entry in served)
    title = f"Run {header.get('run', '')}: {reached} of {len(served)} goals reached"
    notes = () if memory is not None else (_NO_BELIEFS,)
    return Report(title, shown_parameters(header), notes, assumptions, tuple(pages))


def _page(entry: Any, number: int, memory: RobotMemory | None, assumptions: Assumptions, place: str) -> TrialPage:
    """Return what came of one goal."""
    ending = checked.field_of(entry, "ending", place)
    if ending not in _ENDINGS:
        raise InvalidInputError(f"{place}: ending: {json.dumps(ending)}; expected one of: {', '.join(_ENDINGS)}")
    goal = checked.detection(checked.field_of(entry, "goal", place), assumptions, f"{place}: goal")
    summary = checked.field_of(entry, "trial", place)
    looks = read_looks(summary, assumptions, f"{place}: trial")
    verdict, matched = verdict_of(summary, f"{place}: trial")
    page = TrialPage(
        title=f"station {number}",
        verdict=f"{verdict}; {_ENDINGS[ending]}",
        truth=f"{checked.told_truth(summary['truth'][0])}, goal {'shown' if entry.get('shown') else 'not shown'}",
        right=_is_right(entry, str(ending)),
        looks=(),
        graphs=(),
        goal=goal,
    )
    return with_graphs(page, looks, memory, assumptions, matched)


def _is_right(entry: Mapping[str, Any], ending: str) -> bool:
    """Whether the robot reached the goal as it says, or rightly said that it knew no way."""
    if ending == "reached":
        return bool(entry.get("shown"))
    return ending == "unreachable" and not entry.get("reachable")
