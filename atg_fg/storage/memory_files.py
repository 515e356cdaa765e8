"""Robot memories on disk, whatever the format: arrays, a database or JSON, by the file's content and name."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import brief
from atg_fg.core.compact.compact_memory import CompactMemory
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.compact_file import is_compact, load_compact_memory, save_compact_memory
from atg_fg.storage.database.connection import WAIT, is_database, open_to_read, open_to_write, translated, written
from atg_fg.storage.database.keeper import DatabaseKeeper
from atg_fg.storage.database.memory_reading import database_holds_memory, holds_memory, load_database, read_memory_rows
from atg_fg.storage.database.memory_writing import replace_memory, save_database
from atg_fg.storage.memory_json import memory_from_json, memory_to_json
from atg_fg.storage.plain_files import is_plain_file, read_text_file, write_bytes_atomically

#: Names of new files that become databases.
DATABASE_SUFFIXES: Final = (".db", ".sqlite", ".sqlite3")


def load_memory(path: Path | str) -> RobotMemory:
    """Load a robot memory from a database, from arrays (``.npz``) or from JSON.

    Raises:
        InvalidInputError: Unreadable, or anything in it is not as it should be; the message names the place.
    """
    path_of(path)
    if is_database(path):
        return load_database(path)
    if is_compact(path):
        return load_compact_memory(path)
    return memory_from_json(read_text_file(path), str(path))


def save_memory(memory: RobotMemory, path: Path | str) -> None:
    """Save a robot memory, with the structure it has learned; the file holds the old one or the new, never a part.

    A database that is there stays one, and its records of trials stay; a new file is a database if its name ends in
    one of ``DATABASE_SUFFIXES``, arrays if it ends in ``.npz``, else versioned JSON.

    Raises:
        InvalidInputError: The file cannot be written, or arrays cannot hold this memory; what was there is as it was.
    """
    path_of(path)
    check_holds(memory, path)
    if goes_to_database(path):
        save_database(memory, path)
    elif is_compact(path):
        save_compact_memory(CompactMemory.of(memory), path)
    else:
        write_bytes_atomically(path, memory_to_json(memory).encode())


def check_holds(memory: RobotMemory, path: Path | str) -> None:
    """Raise ``InvalidInputError`` if what goes to ``path`` cannot hold such a memory: called before long work, too."""
    has_more = bool(memory.merges) or isinstance(memory, StructuredMemory)
    if has_more and not goes_to_database(path) and is_compact(path):
        raise InvalidInputError(f"{path}: merges or a learned structure; expected ATGs alone, as arrays keep no more")


def save_trial(memory: RobotMemory, path: Path | str, trial: TrialSummary, experiment: Experiment) -> None:
    """Save a memory that has learned from a trial; a database gets the record of the trial in the same transaction.

    A memory that is kept in its file has both there already.

    Args:
        memory: What is to be remembered.
        path: The file, as for ``save_memory``.
        trial: The record.
        experiment: That it belongs to.

    Raises:
        InvalidInputError: As for ``save_memory``.
    """
    if memory.is_kept:
        return
    if goes_to_database(path):
        save_database(memory, path, (trial,), experiment)
    else:
        save_memory(memory, path)


def open_memory(
    path: Path | str, assumptions: Assumptions | None = None, *, read_only: bool = False, wait: float = WAIT
) -> RobotMemory:
    """Return the memory in a database, which keeps what it learns; one transaction a trial.

    Args:
        path: The database.
        assumptions: Of a new memory, if there is none yet; they must be those of the one that is there, which may have
            met labels since that its open alphabet did not know.
        read_only: Refuse changes.
        wait: Seconds to wait for another writer.

    Raises:
        BusyMemoryError: Another process was writing all that time.
        InvalidInputError: There is no such database, or anything in it is not as it should be.
    """
    path_of(path)
    with translated(path):
        create = assumptions is not None and not read_only
        connection = open_to_read(path) if read_only else open_to_write(path, create=create, wait=wait)
        try:
            if assumptions is not None and not read_only:
                with written(connection):
                    if not holds_memory(connection):
                        replace_memory(connection, RobotMemory(assumptions))
            memory = read_memory_rows(connection, str(path))
            if assumptions is not None and not memory.assumptions.extends(assumptions):
                raise InvalidInputError(f"{path}: was made under other assumptions: {memory.assumptions}")
            memory._keeper = DatabaseKeeper(connection, str(path), memory, read_only=read_only)
        except BaseException:
            connection.close()
            raise
    return memory


def path_of(given: Path | str, place: str = "memory") -> Path:
    """Return a path, or raise ``InvalidInputError`` for a number, which would be an open file, or anything else."""
    if not isinstance(given, (str, os.PathLike)):
        raise InvalidInputError(f"{place}: {brief(given)}; expected the path of a file")
    return Path(given)


def goes_to_database(path: Path | str) -> bool:
    """Return whether a memory is saved to ``path`` as a database: by what is there, or else by the name."""
    return is_database(path) if _is_there(path) else Path(path).suffix in DATABASE_SUFFIXES


def has_memory(path: Path | str) -> bool:
    """Return whether what is at ``path`` is to be read as a memory; else a new one can be begun there."""
    return _is_there(path) and not is_database_without_memory(path)


def is_database_without_memory(path: Path | str) -> bool:
    """Return whether a file is a database that holds records of trials alone, or nothing yet.

    Raises:
        InvalidInputError: It is a database that cannot be read.
    """
    return is_database(path) and not database_holds_memory(path)


def _is_there(path: Path | str) -> bool:
    return os.path.exists(path) and not (is_plain_file(path) and os.path.getsize(path) == 0)
