"""The record of one trial (``atg-fg/trial``, JSON lines) as a page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.report import checked
from atg_fg.report.content import Look, Named, Report, TrialPage, shown_parameters
from atg_fg.report.pictures import data_address
from atg_fg.report.summaries import told_verdict, with_graphs
from atg_fg.storage.checked_json import check_format, parse_json
from atg_fg.storage.memory_json import read_assumptions
from atg_fg.storage.trial_record import TRIAL_FORMAT

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
    lines = [parse_json(line, f"{path}: line {number}") for number, line in enumerate(text.splitlines(), 1)]
    if len(lines) < 3:
        raise InvalidInputError(f"{path}: {len(lines)} lines; expected a header, a line a look and the verdict")
    header, *steps, last = lines
    for key in ("format", "version"):
        checked.field_of(header, key, f"{path}: line 1")
    check_format(header, TRIAL_FORMAT, f"{path}: line 1")
    names = checked.texts(checked.field_of(header, "objects", f"{path}: line 1"), f"{path}: line 1: objects")
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
    verdict = checked.field_of(last, "verdict", f"{path}: line {len(lines)}")
    outcome = str(checked.field_of(verdict, "outcome", f"{path}: line {len(lines)}: verdict"))
    matched = verdict.get("matched")
    page = TrialPage(
        title="trial",
        verdict=told_verdict(outcome, matched),
        truth=checked.told_truth(verdict.get("truth")),
        right=None,
        looks=(),
        graphs=(),
    )
    page = with_graphs(page, looks, memory, assumptions, None if matched is None else str(matched))
    notes = () if memory is not None or not names else (_NO_MEMORY,)
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


def _look(step: Any, names: list[str], assumptions: Assumptions, folder: Path, place: str) -> Look:
    """Return a line as a look."""
    shares = checked.numbers(checked.field_of(step, "objects", place), f"{place}: objects", len(names), most=1.0)
    truth = step.get("truth")
    purpose = step.get("purpose")
    return Look(
        checked.detection(checked.field_of(step, "observed", place), assumptions, f"{place}: observed"),
        checked.number(checked.field_of(step, "unseen", place), f"{place}: unseen", most=1.0),
        checked.number(checked.field_of(step, "entropy", place), f"{place}: entropy"),
        best_objects(names, shares),
        _expected(step.get("expected_entropy"), assumptions, f"{place}: expected_entropy"),
        checked.action(checked.field_of(step, "action", place), assumptions, f"{place}: action"),
        None if purpose is None else str(purpose),
        checked.shown(truth),
        isinstance(truth, Mapping) and bool(truth.get("slipped")),
        frame=data_address(step["frame"], folder, f"{place}: frame") if "frame" in step else None,
    )


def best_objects(names: list[str] | tuple[str, ...], shares: list[float]) -> Named:
    """Return the most probable objects with their probabilities, best first, the earlier one where two are alike."""
    order = np.argsort(-np.array(shares, dtype=np.float64), kind="stable")[:TOP].tolist()
    return tuple((names[index], shares[index]) for index in order)


def _expected(value: Any, assumptions: Assumptions, place: str) -> Named:
    if value is None:
        return ()
    if not isinstance(value, Mapping):
        raise InvalidInputError(f"{place}: {value!r}; expected an object with a number for each action")
    for name in value:
        checked.action(name, assumptions, place)
    return tuple((name, checked.number(entry, f"{place}: {name}")) for name, entry in value.items())
