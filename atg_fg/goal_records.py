"""Runs of the goal experiment on disk: one file a run, written whole when it ends."""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from atg_fg.errors import InvalidInputError
from atg_fg.goal_scoring import ServedObject
from atg_fg.json_format import plain_json
from atg_fg.store import write_bytes_atomically
from atg_fg.trial import TrialRecord
from atg_fg.trial_log import summary_of

_FORMAT: Final = {"format": "atg-fg/goal-run", "version": 1}


class GoalRunFile:
    """The file of one run.

    Args:
        path: ``….json.gz``.
        header: What run this is; a file of another one is refused.
    """

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        self.path = path
        self._header = json.loads(json.dumps({**_FORMAT, **header}, default=plain_json))

    def write(self, served: Sequence[ServedObject], records: Sequence[TrialRecord]) -> None:
        """Save what came of each goal, with what was seen and done."""
        entries = [{**asdict(each), "trial": summary_of(record)} for each, record in zip(served, records, strict=True)]
        document = {**self._header, "served": entries}
        text = json.dumps(document, default=plain_json, allow_nan=False, separators=(",", ":"))
        write_bytes_atomically(self.path, gzip.compress(text.encode(), mtime=0))

    def read(self) -> tuple[ServedObject, ...]:
        """Return what came of each goal.

        Raises:
            InvalidInputError: The file cannot be read, or it is of another run.
        """
        try:
            document = json.loads(gzip.decompress(self.path.read_bytes()))
            served = tuple(_served(each) for each in document.pop("served"))
        except (OSError, EOFError, zlib.error, ValueError, KeyError, TypeError, AttributeError) as error:
            raise InvalidInputError(
                f"{self.path}: cannot be read: {error!r}; expected a run that --records wrote"
            ) from error
        if document != self._header:
            raise InvalidInputError(
                f"{self.path}: holds {json.dumps(document)}; expected the run of {json.dumps(self._header)}"
            )
        return served


def _served(entry: dict[str, Any]) -> ServedObject:
    del entry["trial"]
    for name in ("goal", "nearest"):
        entry[name] = None if entry[name] is None else tuple(entry[name])
    return ServedObject(**entry)
