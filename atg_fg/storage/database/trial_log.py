"""The trials of one test as an experiment in a database: what ``TrialLog`` is in a file of its own."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.core.version import __version__
from atg_fg.storage.checked_json import plain_json
from atg_fg.storage.database import trial_rows
from atg_fg.storage.database.connection import reading, writing

#: The kind of experiment that a test of the paper is.
TEST_KIND: Final = "test"
#: Seconds that a process waits for others that write trials to the same database.
_WAIT: Final = 60.0


class DatabaseTrialLog:
    """The trials of one test in a database, which may hold other tests, and a memory.

    Args:
        path: The database; made if it is not there.
        header: What test this is: its seed, and what its plan has other than usual.
        assumptions: Of the memory; names the actions.
    """

    def __init__(self, path: Path, header: Mapping[str, Any], assumptions: Assumptions) -> None:
        self.path = path
        self._assumptions = assumptions
        self._experiment = _experiment_of(header)

    def begin(self) -> list[TrialSummary]:
        """Write the experiment, and return its trials: none.

        Raises:
            InvalidInputError: It is already there, or cannot be written.
        """
        if self._open():
            raise _already_there(self.path)
        return []

    def resume(self) -> list[TrialSummary]:
        """Return the trials of this test that are in the database; begin it if it is not there.

        Raises:
            InvalidInputError: The database cannot be read or written.
        """
        self._open()
        return list(read_stored_trials(self.path, self._experiment.number, self._assumptions))

    def append(self, trial: TrialSummary) -> None:
        """Write a trial, as one transaction."""
        with writing(self.path, wait=_WAIT) as connection:
            trial_rows.added(connection, self._experiment, trial)

    def _open(self) -> bool:
        """Find the experiment, or write it; return whether it was there."""
        with writing(self.path, create=True, wait=_WAIT) as connection:
            number = trial_rows.find_experiment(connection, self._experiment)
            there = number is not None
            if number is None:
                number = trial_rows.add_experiment(connection, self._experiment)
        self._experiment = replace(self._experiment, number=number)
        return there


def check_not_in_database(path: Path, header: Mapping[str, Any]) -> None:
    """Raise ``InvalidInputError`` if a database has a test already; one that is not there yet has none.

    Args:
        path: The database.
        header: As for ``DatabaseTrialLog``.
    """
    if not os.path.exists(path) or not path.stat().st_size:
        return
    with reading(path) as connection:
        there = trial_rows.find_experiment(connection, _experiment_of(header)) is not None
    if there:
        raise _already_there(path)


def _experiment_of(header: Mapping[str, Any]) -> Experiment:
    parameters = json.loads(json.dumps(header, default=plain_json))
    return Experiment(TEST_KIND, parameters, parameters.pop("seed"), __version__)


def _already_there(path: Path) -> InvalidInputError:
    return InvalidInputError(f"{path}: has this test already; expected another database, or --resume to go on")


def read_stored_trials(
    path: Path | str, experiment: int | None = None, assumptions: Assumptions | None = None, *, alone: bool = False
) -> Iterator[TrialSummary]:
    """Yield the trials in a database, all or those of one experiment.

    Args:
        path: The database.
        experiment: Number of the experiment; all if not given.
        assumptions: Of the trials, as for ``trial_log.from_line``.
        alone: Whether only those are asked for that belong to no experiment.

    Raises:
        InvalidInputError: The file cannot be read, or a trial in it is not as it should be.
    """
    with reading(path) as connection:
        yield from trial_rows.read_trials(connection, str(path), experiment, assumptions, alone=alone)


def read_stored_experiments(path: Path | str) -> list[Experiment]:
    """Return the experiments in a database.

    Raises:
        InvalidInputError: The file cannot be read, or an experiment in it is not as it should be.
    """
    with reading(path) as connection:
        return list(trial_rows.read_experiments(connection, str(path)))
