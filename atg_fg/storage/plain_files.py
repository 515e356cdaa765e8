"""Files on disk: written whole or not at all, checked when they are read, never pickled."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from atg_fg.core.errors import InvalidInputError


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


def starts_with(path: Path | str, start: bytes) -> bool:
    """Return whether there is a file at ``path`` that begins with these bytes."""
    try:
        with open(path, "rb") as file:
            return file.read(len(start)) == start
    except (OSError, ValueError):
        return False


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
