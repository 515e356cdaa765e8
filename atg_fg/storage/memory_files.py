"""Robot memories on disk, whatever the format."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from atg_fg.core.compact.compact_memory import CompactMemory
from atg_fg.core.memory import RobotMemory
from atg_fg.storage.compact_file import is_compact, load_compact_memory, save_compact_memory
from atg_fg.storage.database.connection import is_database
from atg_fg.storage.database.memory_reading import load_database
from atg_fg.storage.database.saving import save_database
from atg_fg.storage.memory_json import memory_from_json, memory_to_json
from atg_fg.storage.plain_files import read_text_file, write_bytes_atomically


def load_any_memory(path: Path | str) -> RobotMemory:
    """Load a robot memory from a file of arrays if its name ends in ``.npz``, else from JSON or a database.

    Raises:
        InvalidInputError: Unreadable, or anything in it is not as it should be; the message names the place.
    """
    return load_compact_memory(path) if is_compact(path) else load_memory(path)


def save_any_memory(memory: RobotMemory, path: Path | str) -> None:
    """Save the ATGs of a robot memory as arrays if the file's name ends in ``.npz``, else all as ``save_memory``."""
    if is_compact(path):
        save_compact_memory(CompactMemory.of(memory), path)
    else:
        save_memory(memory, path)


#: Names of new files that become databases.
DATABASE_SUFFIXES: Final = (".db", ".sqlite", ".sqlite3")


def save_memory(memory: RobotMemory, path: Path | str) -> None:
    """Save a robot memory, with the structure it has learned; the file holds the old one or the new, never a part.

    A database that is there stays one, and its records of trials stay; a new file is a database if its name ends in
    one of ``DATABASE_SUFFIXES``, else versioned JSON.

    Raises:
        InvalidInputError: The file cannot be written; what was there is as it was.
    """
    if goes_to_database(path):
        save_database(memory, path)
    else:
        write_bytes_atomically(path, memory_to_json(memory).encode())


def load_memory(path: Path | str) -> RobotMemory:
    """Load a robot memory from JSON or a database, whichever the file is by its content.

    Raises:
        InvalidInputError: Unreadable, or anything in it is not as it should be; the message names the place.
    """
    if is_database(path):
        return load_database(path)
    return memory_from_json(read_text_file(path), str(path))


def goes_to_database(path: Path | str) -> bool:
    """Return whether a memory is saved to ``path`` as a database: by what is there, or else by the name."""
    there = Path(path)
    if there.is_dir() or (there.exists() and there.stat().st_size > 0):
        return is_database(path)
    return there.suffix in DATABASE_SUFFIXES
