"""The trials of one test in a file that grows trial by trial, and is sound whenever it is cut off.

Each line is a gzip member of its own: a header, then a trial a line. A writer that is killed leaves at most half of the
last member, which ``read`` drops. A trial is put where it belongs rather than at the end of the file, so that two
writers of one test do no harm: a worker of a cluster that is taken for lost may still be at it.
"""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import AtgError, InvalidInputError
from atg_fg.core.patterns import Detection, Evidence
from atg_fg.core.records import TrialOutcome, TrialRecord
from atg_fg.storage.checked_json import plain_json
from atg_fg.storage.limits import gzip_members
from atg_fg.storage.plain_files import append_bytes, check_writable, read_bytes_file, write_bytes_atomically

_FORMAT = {"format": "atg-fg/test", "version": 1}


class TrialLog:
    """The trials of one test on disk.

    Args:
        path: The file, ``….jsonl.gz``.
        header: What test this is; a file of another one is refused.
        assumptions: Of the memory; names the actions.
    """

    def __init__(self, path: Path, header: Mapping[str, Any], assumptions: Assumptions) -> None:
        self.path = path
        self._assumptions = assumptions
        self._end = path.stat().st_size if path.exists() else 0
        self._header = json.loads(json.dumps({**_FORMAT, **header}, default=plain_json))

    def begin(self) -> list[TrialOutcome]:
        """Make the file, with its header, and return the trials in it: none.

        Raises:
            InvalidInputError: It is already there, or cannot be written.
        """
        check_not_begun(self.path)
        check_writable(self.path)
        content = _member(self._header)
        write_bytes_atomically(self.path, content)
        self._end = len(content)
        return []

    def resume(self) -> list[TrialOutcome]:
        """Return the trials that are in the file, cutting off half a trial at its end; begin it if it is not there.

        Raises:
            InvalidInputError: The file cannot be read, or is of another test.
        """
        if not self.path.exists():
            return self.begin()
        lines, sound = _sound_lines(self.path)
        if not lines or lines[0] != self._header:
            found = json.dumps(lines[0]) if lines else "nothing"
            raise InvalidInputError(f"{self.path}: holds {found}; expected the trials of {json.dumps(self._header)}")
        with self.path.open("r+b") as file:
            file.truncate(sound)
        self._end = sound
        return [outcome_of(line, self._assumptions, str(self.path)) for line in lines[1:]]

    def append(self, record: TrialRecord, outcome: TrialOutcome | None = None) -> None:
        """Add a trial to the file, and what is learned from it if that is not what was seen.

        Raises:
            InvalidInputError: The disk is full, or the file cannot be written for another reason; ``resume`` goes on.
        """
        line = summary_of(record)
        if outcome is not None and outcome.patterns != tuple(record.patterns):
            line["learned"] = outcome.patterns
        self._end = append_bytes(self.path, _member(line), self._end)


def outcome_of(line: Mapping[str, Any], assumptions: Assumptions, place: str) -> TrialOutcome:
    """Return what scoring and learning need of a trial in a log.

    Raises:
        InvalidInputError: It is no such trial; the message names ``place``.
    """
    alphabet, names = assumptions.alphabet, assumptions.actions
    try:
        seen: list[Detection] = [tuple(detection) for detection in line["observed"]]
        return TrialOutcome(
            line["verdict"],
            line["matched"],
            tuple(line.get("learned", [Evidence.of_detection(alphabet, each).pattern for each in seen])),
            tuple(names.index(action) for action in line["actions"]),
            line["truth"][0]["object"],
            tuple(seen),
        )
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise InvalidInputError(f"{place}: {error!r}; expected a trial a line") from error


def check_not_begun(path: Path) -> None:
    """Raise ``InvalidInputError`` if there is a file of records already."""
    if path.exists():
        raise InvalidInputError(f"{path}: is already there; expected another folder, or --resume to go on")


def summary_of(record: TrialRecord) -> dict[str, Any]:
    """Return what is kept of a trial: what was seen and done, what was believed, and the truth."""
    truths = [step.truth for step in record.steps]
    purposes = [step.purpose for step in record.steps]
    return {
        "verdict": record.verdict,
        "matched": record.matched,
        "observed": [step.detection for step in record.steps],
        "actions": [record.assumptions.actions[action] for action in record.actions],
        "unseen": [step.belief.unseen for step in record.steps],
        "entropy": [step.belief.entropy for step in record.steps],
        **({"purpose": purposes} if any(purposes) else {}),
        "truth": truths if record.lost_truth is None else [*truths, record.lost_truth],
    }


def read_trials(path: Path) -> list[dict[str, Any]]:
    """Return the trials in a file as they were logged, without the header; errors are those of ``read_log``."""
    return read_log(path)[1]


def read_log(path: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the header of a file, without format and version, and its trials; half a trial at the end is left out.

    Raises:
        InvalidInputError: The file cannot be read, or is not such a file.
    """
    lines, _ = _sound_lines(path)
    header = lines[0] if lines and isinstance(lines[0], dict) else {}
    if {name: header.get(name) for name in _FORMAT} != _FORMAT:
        raise InvalidInputError(f"{path}: is not a log of trials; expected a file that --records wrote")
    return {name: value for name, value in header.items() if name not in _FORMAT}, lines[1:]


def _member(line: Mapping[str, Any]) -> bytes:
    text = json.dumps(line, default=plain_json, allow_nan=False, separators=(",", ":")) + "\n"
    return gzip.compress(text.encode(), mtime=0)


def _sound_lines(path: Path) -> tuple[list[dict[str, Any]], int]:
    """Return the lines of all whole members, and how many bytes they are."""
    try:
        lines, sound = [], 0
        for text, end in gzip_members(read_bytes_file(path), path):
            lines.append(json.loads(text))
            sound = end
    except (zlib.error, ValueError, RecursionError) as error:
        if isinstance(error, AtgError):
            raise
        raise InvalidInputError(f"{path}: cannot be read: {error}; expected a log of trials") from error
    return lines, sound
