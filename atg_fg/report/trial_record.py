"""The record of one trial (``atg-fg/trial``, JSON lines) as a page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from atg_fg.core import checks
from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import StepSummary
from atg_fg.report.content import Look, Named, Report, TrialPage, shown_parameters
from atg_fg.report.kinds import told_kinds
from atg_fg.report.pictures import data_address, thumbnails
from atg_fg.report.summaries import look_of, told_mistakes, told_truth, told_verdict, with_graphs
from atg_fg.storage.checked_json import check_format, parse_json, read_entries, read_info, read_list, read_object
from atg_fg.storage.memory_json import read_assumptions
from atg_fg.storage.trial_log import TRIAL_FORMAT, read_step, summary_of

#: Remembered objects that are shown by name at each look.
TOP = 6
_OWN = ("format", "version", "objects", "assumptions")


def read_trial_record(text: str, path: Path, memory: RobotMemory | None) -> Report:
    """Return the page of a trial's record.

    Args:
        text: The file's content.
        path: Where it is; pictures are looked for beside it.
        memory: That the trial began with, if given.

    Raises:
        InvalidInputError: A line is not as it should be, or the memory is of another trial.
    """
    lines = [parse_json(line, f"{path}: line {number}") for number, line in enumerate(_lines(text), 1)]
    if len(lines) < 3:
        raise InvalidInputError(f"{path}: {len(lines)} lines; expected a header, a line a look and the verdict")
    header, *steps, last = lines
    first = f"{path}: line 1"
    check_format(_holding(header, first, "format", "version", "objects"), TRIAL_FORMAT, first)
    read_info(header, first)
    names = read_list(header["objects"], f"{first}: objects")
    if names:  # a memory may be empty
        checks.distinct_names(names, f"{first}: objects")
    assumptions = _assumptions(header, memory, path)
    # A memory that was saved after the trial may have one object more.
    if memory is not None and list(memory.names)[: len(names)] != names:
        raise InvalidInputError(
            f"--memory: {len(memory)} objects; expected the memory of the trial, of {len(names)} objects: "
            f"{', '.join(names[:3])}{' …' if len(names) > 3 else ''}"
        )
    looks = [
        _look(step, names, assumptions, path.parent, f"{path}: line {number}") for number, step in enumerate(steps, 2)
    ]
    place = f"{path}: line {len(lines)}"
    end = _holding(_holding(last, place, "verdict")["verdict"], f"{place}: verdict", "outcome", "matched", "truth")
    lost = end["truth"] if end["outcome"] == "lost" else None
    trial = summary_of(
        {"verdict": end["outcome"], "matched": end["matched"], "lost_truth": lost, "mistakes": end.get("mistakes", [])},
        [step for step, _ in looks],
        f"{place}: verdict",
    )
    page = TrialPage(
        title="trial",
        verdict=told_verdict(trial.verdict, trial.matched),
        truth=told_truth(read_info(end["truth"], f"{place}: verdict: truth")),
        # From a memory with objects, the record does not say which of them this one is by the truth.
        right=None if names else trial.verdict == "novel",
        notes=told_mistakes(trial, assumptions),
        thumbnails=thumbnails(
            ((f"{path}: line {number}", read) for number, (read, _) in enumerate(looks, 2)), path.parent
        ),
    )
    page = with_graphs(page, [look for _, look in looks], memory, assumptions, trial.matched)
    notes = told_kinds(memory) if memory is not None or not names else (_NO_MEMORY,)
    parameters = shown_parameters({key: value for key, value in header.items() if key not in _OWN})
    return Report("A trial, look by look", parameters, notes, assumptions, (page,))


_NO_MEMORY = (
    "The record does not hold the ATGs that the robot remembered, so the graph is of what the trial has shown. "
    "With --memory FILE it is that of the object it takes this one for."
)


def _assumptions(header: Mapping[str, Any], memory: RobotMemory | None, path: Path) -> Assumptions:
    """Return the trial's assumptions; those of ARcubes where neither a memory nor the record says any."""
    stated = read_assumptions(header["assumptions"], f"{path}: assumptions") if "assumptions" in header else None
    if memory is None:
        return stated or arcube_assumptions()
    if stated is not None and stated != memory.assumptions:
        raise InvalidInputError(f"--memory: made under other assumptions than {path}; expected that trial's memory")
    return memory.assumptions


def _look(step: Any, names: list[str], assumptions: Assumptions, folder: Path, place: str) -> tuple[StepSummary, Look]:
    """Return a line as a look."""
    fields = _holding(step, place, "observed", "objects", "unseen", "entropy", "action", "truth")
    entries = read_entries(fields["objects"], f"{place}: objects", len(names))
    shares = [checks.number(entry, where, 0.0, 1.0, slack=1e-6) for entry, where in entries]
    read = read_step(fields, place, assumptions)
    frame = data_address(fields["frame"], folder, f"{place}: frame") if "frame" in fields else None
    return read, replace(
        look_of(read, max(assumptions.n_objects - len(names), 1)), objects=best_objects(names, shares), frame=frame
    )


def _holding(value: Any, place: str, *keys: str) -> dict[str, Any]:
    """Return ``value`` if it is an object with these keys, and perhaps others."""
    return read_object(value, place, keys, optional=tuple(value) if isinstance(value, dict) else ())


def _lines(text: str) -> list[str]:
    """Return the lines of a text: only a line feed ends one, for JSON may hold other separators of lines."""
    return text.removesuffix("\n").split("\n")


def best_objects(names: list[str] | tuple[str, ...], shares: list[float]) -> Named:
    """Return the most probable objects with their probabilities, best first, the earlier one where two are alike."""
    order = np.argsort(-np.array(shares, dtype=np.float64), kind="stable")[:TOP].tolist()
    return tuple((names[index], shares[index]) for index in order)
