"""A whole memory put into a database at once, perhaps with the trial that it has just learned from."""

from __future__ import annotations

from pathlib import Path

from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.storage.database import trial_rows
from atg_fg.storage.database.connection import writing
from atg_fg.storage.database.memory_writing import replace_memory


def save_database(
    memory: RobotMemory,
    path: Path | str,
    trials: tuple[TrialSummary, ...] = (),
    experiment: Experiment | None = None,
) -> None:
    """Save a memory in place of the one that a database holds, if any; its records of trials stay.

    Args:
        memory: What is to be remembered.
        path: The database; made if it is not there.
        trials: Records to add, in the same transaction.
        experiment: That these belong to.

    Raises:
        BusyMemoryError: Another process was writing all the time that this one waited.
        InvalidInputError: The file cannot be written, or is something else; it is as it was.
    """
    with writing(path, create=True) as connection:
        replace_memory(connection, memory)
        for trial in trials:
            experiment = trial_rows.added(connection, experiment, trial)
