"""Any file that a report can be made of, told apart by what is in it."""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import Any, Final

from atg_fg.core.checks import brief
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.report.content import Report
from atg_fg.report.database import read_database
from atg_fg.report.experiments import EXPERIMENTS, read_experiment
from atg_fg.report.goal_run import GOAL_RUN_FORMAT, read_goal_run
from atg_fg.report.graphs import gallery
from atg_fg.report.test_log import test_report
from atg_fg.report.trial_record import read_trial_record
from atg_fg.storage.checked_json import parse_json
from atg_fg.storage.compact_file import is_compact
from atg_fg.storage.database.connection import is_database
from atg_fg.storage.memory_files import load_memory
from atg_fg.storage.memory_json import MEMORY_FORMAT, memory_from_document
from atg_fg.storage.plain_files import GZIP, cannot_read, read_text_file, readable_again
from atg_fg.storage.recorded_test import recorded_tests
from atg_fg.storage.trial_log import TRIAL_FORMAT

_EXPECTED: Final = (
    "expected a trial's record (trial --record), the trials of a test (table1 --records), a run (goal --records), "
    "a robot memory with its trials if it is a database, "
    f"or a result (--json) of: {', '.join(EXPERIMENTS)}"
)


def read_report(path: Path, memory: RobotMemory | None = None) -> Report:
    """Return the page of a file.

    Args:
        path: A trial's record, the trials of a test, a run of the goal experiment, a robot memory database, or the
            JSON of an experiment.
        memory: That the trial began with, if it is at hand.

    Raises:
        InvalidInputError: The file cannot be read, is of no kind that there is a page for, or has a fault in it.
    """
    with readable_again(path) as there:
        return _report_of(there, memory)


def _report_of(path: Path, memory: RobotMemory | None) -> Report:
    try:
        with path.open("rb") as file:
            start = file.read(4096)
    except (OSError, ValueError) as error:
        raise cannot_read(path, error, _EXPECTED.removeprefix("expected ")) from error
    if is_database(path):
        return read_database(path, memory)
    if start.startswith(GZIP):
        if _is_goal_run(start):
            return read_goal_run(path, memory)
        (test,) = recorded_tests(path, None if memory is None else memory.assumptions)
        return test_report(test, path.parent)
    if is_compact(path):
        return gallery(load_memory(path), path.name)
    text = read_text_file(path)
    if _first_line(text).get("format") == TRIAL_FORMAT:
        return read_trial_record(text, path, memory)
    document = parse_json(text, str(path))
    if isinstance(document, dict) and document.get("command") in list(EXPERIMENTS):
        return read_experiment(document, str(path))
    if isinstance(document, dict) and document.get("format") == MEMORY_FORMAT:
        return gallery(memory_from_document(document, str(path)), path.name)
    raise InvalidInputError(f"{path}: {_what_it_says(document)}; {_EXPECTED}")


def _is_goal_run(start: bytes) -> bool:
    """Whether a gzipped file begins like a run; its first line may be longer than what was read."""
    try:
        text = zlib.decompressobj(31).decompress(start, 200)
    except zlib.error:
        return False
    return GOAL_RUN_FORMAT.encode() in text


def _first_line(text: str) -> dict[str, Any]:
    try:
        line = json.loads(text.split("\n", 1)[0])
    except (ValueError, RecursionError):
        return {}
    return line if isinstance(line, dict) else {}


def _what_it_says(document: Any) -> str:
    if isinstance(document, dict) and ("command" in document or "format" in document):
        return f"is of {brief(document.get('command', document.get('format')))}"
    return "says neither a command nor a format"
