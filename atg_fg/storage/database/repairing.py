"""Trials and experiments that cannot be read, taken out of a database, with a record of what was taken out."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Any, Final

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.records import Experiment
from atg_fg.core.version import __version__
from atg_fg.storage.database import trial_rows
from atg_fg.storage.database.checking import assumptions_of_tests
from atg_fg.storage.database.connection import writing
from atg_fg.storage.database.trial_log import TEST_KIND

#: The kind of experiment that says what was taken out.
REPAIR_KIND: Final = "repair"


def repair_database(path: Path | str) -> list[str]:
    """Take trials and experiments that cannot be read out of a database, all or nothing; return what is wrong.

    What was taken out is kept as text in an experiment of kind ``REPAIR_KIND``. Trials of a test follow from those
    before them: all after a bad one are taken out, too, and ``--resume`` runs them again. Memory is not touched.

    Raises:
        InvalidInputError: The database cannot be read or written at all.
    """
    place = str(path)
    with writing(path) as connection:
        assumptions, unsound = assumptions_of_tests(connection, place)
        faults = list(unsound.values())
        removed: list[dict[str, Any]] = []
        for number, fault in unsound.items():
            rows = connection.execute("SELECT id FROM trials WHERE experiment = ?", (number,)).fetchall()
            removed += [_taken_out(connection, key, fault) for (key,) in rows]
            connection.execute("DELETE FROM experiments WHERE id = ?", (number,))
        gone: set[int] = set()
        for key, trial in list(trial_rows.trials_or_faults(connection, place, assumptions)):
            if isinstance(trial, InvalidInputError) and key not in gone:
                faults.append(str(trial))
                followers = _followers(connection, key)
                gone |= set(followers)
                removed += [_taken_out(connection, each, str(trial)) for each in followers]
        connection.execute("DELETE FROM steps WHERE trial NOT IN (SELECT id FROM trials)")
        _number_anew(connection)
        if faults:
            trial_rows.add_experiment(connection, Experiment(REPAIR_KIND, {"removed": removed}, None, __version__))
    return faults


def _followers(connection: sqlite3.Connection, key: int) -> list[int]:
    """Return the rows of a trial, and of those that follow from it."""
    rows = connection.execute(
        "SELECT later.id FROM trials AS bad JOIN experiments ON experiments.id = bad.experiment"
        " JOIN trials AS later ON later.experiment = bad.experiment AND later.id >= bad.id"
        " WHERE bad.id = ? AND experiments.kind = ? ORDER BY later.id",
        (key, TEST_KIND),
    )
    return [each for (each,) in rows] or [key]


def _taken_out(connection: sqlite3.Connection, key: int, fault: str) -> dict[str, Any]:
    """Delete a trial; return what its rows said, as text."""
    connection.text_factory = bytes  # what is no text comes out all the same
    try:
        trial = connection.execute("SELECT * FROM trials WHERE id = ?", (key,)).fetchone()
        steps = connection.execute("SELECT * FROM steps WHERE trial = ? ORDER BY number", (key,)).fetchall()
    finally:
        connection.text_factory = str
    connection.execute("DELETE FROM steps WHERE trial = ?", (key,))
    connection.execute("DELETE FROM trials WHERE id = ?", (key,))
    return {"fault": fault, "trial": _as_text(trial or ()), "steps": [_as_text(step) for step in steps]}


def _as_text(row: tuple[Any, ...]) -> list[str | None]:
    return [
        None if value is None
        else value.decode(errors="backslashreplace") if isinstance(value, bytes) else str(value)
        for value in row
    ]  # fmt: skip


def _number_anew(connection: sqlite3.Connection) -> None:
    """Number the trials of each experiment from 0, in their order."""
    following: dict[int | None, int] = {}
    for key, experiment, number in connection.execute(
        "SELECT id, experiment, number FROM trials ORDER BY 2, 3"
    ).fetchall():
        expected = following.get(experiment, 0)
        following[experiment] = expected + 1
        if number != expected:
            connection.execute("UPDATE trials SET number = ? WHERE id = ?", (expected, key))
