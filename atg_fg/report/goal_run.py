"""A run of the goal experiment (``atg-fg/goal-run``) as a page: a trial a station, each with its goal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from atg_fg.core.assumptions import MAX_NUMBER, Assumptions, arcube_assumptions
from atg_fg.core.checks import one_of, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.report.content import Report, TrialPage, shown_parameters
from atg_fg.report.summaries import looks_of, told_truth, told_verdict, with_graphs
from atg_fg.storage.checked_json import check_format, parse_json, read_entries, read_info, read_list, read_object
from atg_fg.storage.plain_files import read_gzipped_text
from atg_fg.storage.trial_log import from_line

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
    header = read_object(document, str(path), ("format", "version", "served"), optional=tuple(document))
    check_format(header, GOAL_RUN_FORMAT, str(path))
    served = read_entries(document.pop("served"), f"{path}: served")
    read_info(document, str(path))
    if not served:
        raise InvalidInputError(f"{path}: served: no goals; expected at least one")
    assumptions = arcube_assumptions() if memory is None else memory.assumptions
    # As many as GoalPlan has where the run's header does not say otherwise.
    n_objects, n_remembered = (
        whole_number(document.get(name, usual), f"{path}: {name}", 1, MAX_NUMBER)
        for name, usual in (("n_objects", 100), ("n_remembered", 20))
    )
    n_unseen = max(n_objects - n_remembered, 1)
    pages = [_page(entry, number, n_unseen, memory, assumptions, where) for number, (entry, where) in enumerate(served)]
    header = {key: value for key, value in document.items() if key not in ("format", "version")}
    reached = sum(entry["ending"] == "reached" for entry, _ in served)
    title = f"Run {header.get('run', '')}: {reached} of {len(served)} goals reached"
    notes = () if memory is not None else (_NO_BELIEFS,)
    return Report(title, shown_parameters(header), notes, assumptions, tuple(pages))


def _page(
    entry: Any, number: int, n_unseen: int, memory: RobotMemory | None, assumptions: Assumptions, place: str
) -> TrialPage:
    """Return what came of one goal; ``n_unseen`` objects were never met."""
    read_object(entry, place, ("ending", "goal", "trial"), optional=tuple(entry) if isinstance(entry, dict) else ())
    ending = one_of(entry["ending"], f"{place}: ending", _ENDINGS)
    goal = assumptions.alphabet.check_detection(read_list(entry["goal"], f"{place}: goal"), f"{place}: goal")
    trial = from_line(entry["trial"], f"{place}: trial", assumptions)
    page = TrialPage(
        title=f"station {number}",
        verdict=f"{told_verdict(trial.verdict, trial.matched)}; {_ENDINGS[ending]}",
        truth=f"{told_truth(trial.truths[0])}, goal {'shown' if entry.get('shown') else 'not shown'}",
        right=_is_right(entry, ending),
        goal=goal,
    )
    return with_graphs(page, looks_of(trial, n_unseen), memory, assumptions, trial.matched)


def _is_right(entry: Mapping[str, Any], ending: str) -> bool:
    """Whether the robot reached the goal as it says, or rightly said that it knew no way."""
    if ending == "reached":
        return bool(entry.get("shown"))
    return ending == "unreachable" and not entry.get("reachable")
