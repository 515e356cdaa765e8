"""An open memory and its database in step: what the memory learns is in the file when the transaction ends."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from atg_fg.core.errors import AtgError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Experiment, TrialRecord, TrialSummary
from atg_fg.core.version import __version__
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.database import trial_rows
from atg_fg.storage.database.connection import roll_back, translated
from atg_fg.storage.database.memory_reading import read_memory_rows
from atg_fg.storage.database.memory_writing import held_by, replace_memory, write_changes


class DatabaseKeeper:
    """Keeps one memory in step with its database.

    Args:
        connection: To the database; closed by ``close``.
        place: For error messages.
        memory: What has just been read from it.
        read_only: Whether changes are refused.
    """

    def __init__(self, connection: sqlite3.Connection, place: str, memory: RobotMemory, *, read_only: bool) -> None:
        self._connection, self._place, self._read_only = connection, place, read_only
        self._held = held_by(connection, memory)
        self._seen = self._data_version()
        self._inside = False
        self._experiment: Experiment | None = None

    @contextmanager
    def transaction(self, memory: RobotMemory) -> Iterator[None]:
        """Write what changes inside, all of it or nothing; nested ones belong to the outermost."""
        if self._inside:
            yield
            return
        if self._read_only:
            raise InvalidInputError(f"{self._place}: was opened to be read only; expected no change of the memory")
        experiment = self._experiment
        with translated(self._place):
            self._connection.execute("BEGIN IMMEDIATE")
        self._inside = True
        try:
            self._take_over(memory)
            assumptions = memory.assumptions
            yield
            with translated(self._place):
                if memory.assumptions == assumptions:
                    held = write_changes(self._connection, memory, self._held)
                else:
                    held = replace_memory(self._connection, memory)
                self._connection.execute("COMMIT")
            self._held = held
        except BaseException:
            self._experiment = experiment
            self._restore(memory)
            raise
        finally:
            self._inside = False

    def refresh(self, memory: RobotMemory) -> None:
        """Take over what others have written."""
        if not self._inside:
            self._take_over(memory)

    def begin_experiment(self, kind: str, parameters: Mapping[str, Any], seed: int | None) -> None:
        """Say what the trials from here on belong to; it is written with the first of them."""
        self._experiment = Experiment(kind, dict(parameters), seed, __version__)

    def add_record(self, record: TrialRecord, learned: str | None) -> None:
        """Write the record of a trial, inside of a transaction."""
        with translated(self._place):
            self._experiment = trial_rows.added(self._connection, self._experiment, TrialSummary.of(record, learned))

    def experiments(self) -> Iterator[Experiment]:
        """Yield the experiments in the file."""
        with translated(self._place):
            yield from trial_rows.read_experiments(self._connection, self._place)

    def trials(self, experiment: int | None) -> Iterator[TrialSummary]:
        """Yield the trials in the file."""
        with translated(self._place):
            yield from trial_rows.read_trials(self._connection, self._place, experiment)

    def close(self) -> None:
        """Let go of the file."""
        with translated(self._place):
            self._connection.close()

    def _data_version(self) -> int:
        """Return a number that is another one whenever another connection has written."""
        (version,) = self._connection.execute("PRAGMA data_version").fetchone()
        return int(version)

    def _take_over(self, memory: RobotMemory) -> None:
        with translated(self._place):
            version = self._data_version()
            if version != self._seen:
                self._load_into(memory)
                self._seen = version

    def _load_into(self, memory: RobotMemory) -> None:
        loaded = read_memory_rows(self._connection, self._place)
        if isinstance(loaded, StructuredMemory) and not isinstance(memory, StructuredMemory):
            raise InvalidInputError(
                f"{self._place}: another process has begun to learn structure in it; expected it to be opened anew"
            )
        if not loaded.assumptions.extends(memory.assumptions):
            raise InvalidInputError(f"{self._place}: another process has put another memory in it")
        memory.become(loaded)
        self._held = held_by(self._connection, memory)

    def _restore(self, memory: RobotMemory) -> None:
        """Let the memory be as the file is, after a transaction that failed."""
        # Whatever else goes wrong here, the error that led here says more.
        with contextlib.suppress(AtgError, sqlite3.Error):
            roll_back(self._connection)
            with translated(self._place):
                self._seen = self._data_version()
                self._load_into(memory)
