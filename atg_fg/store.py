"""Files on disk: written whole or not at all, checked when they are read, never pickled."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Final

from atg_fg.database.connection import is_database
from atg_fg.database.memory_reading import load_database
from atg_fg.database.saving import save_database
from atg_fg.errors import InvalidInputError
from atg_fg.memory import RobotMemory
from atg_fg.memory_json import MEMORY_FORMAT, memory_from_json, memory_to_json

__all__ = [
    "DATABASE_SUFFIXES",
    "MEMORY_FORMAT",
    "check_writable",
    "goes_to_database",
    "load_memory",
    "make_folder",
    "memory_from_json",
    "memory_to_json",
    "read_text_file",
    "save_memory",
    "write_bytes_atomically",
]

#: Names of new files that become databases.
DATABASE_SUFFIXES: Final = (".db", ".sqlite", ".sqlite3")


def read_text_file(path: Path | str) -> str:
    """Return the text of a UTF-8 file.

    Raises:
        InvalidInputError: It cannot be read, or is not UTF-8.
    """
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise InvalidInputError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InvalidInputError(f"{path}: not a UTF-8 text file: {error}") from error


def write_bytes_atomically(path: Path | str, content: bytes) -> None:
    """Write a file so that at any moment its path holds the old content or the new one, never a part.

    Raises:
        InvalidInputError: The folder does not exist or cannot be written; the old file is as it was.
    """
    target = Path(path)
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except (OSError, ValueError) as error:
        raise _cannot_write(path, error) from error
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, target)
    except OSError as error:
        os.unlink(temporary)
        raise _cannot_write(path, error) from error


def check_writable(path: Path | str) -> None:
    """Raise ``InvalidInputError`` if a file could not be written at ``path``; leave nothing behind.

    Called before long work, so that its result is not lost at the end.
    """
    if Path(path).is_dir():
        raise InvalidInputError(f"{path}: is a folder; expected the path of a file")
    try:
        with tempfile.TemporaryFile(dir=Path(path).parent):
            pass
    except (OSError, ValueError) as error:
        raise _cannot_write(path, error) from error


def make_folder(path: Path | str) -> Path:
    """Make a folder for output if it is not there, and return it.

    Raises:
        InvalidInputError: It cannot be made or written.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        raise _cannot_write(path, error) from error
    return folder


def _cannot_write(path: Path | str, error: Exception) -> InvalidInputError:
    reason = error.strerror if isinstance(error, OSError) else str(error)
    return InvalidInputError(f"{path}: cannot be written: {reason}; expected a path in a folder that can be written")


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
