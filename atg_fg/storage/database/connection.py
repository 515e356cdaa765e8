"""Opening a memory database, and SQLite's errors as this project's."""

from __future__ import annotations

import os
import sqlite3
import stat
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from atg_fg.core.errors import BusyMemoryError, InvalidInputError
from atg_fg.storage.database import schema
from atg_fg.storage.plain_files import cannot_read, starts_with

#: No text in a memory is longer; a damaged file may say so.
_MAX_BYTES: Final = 2**26
#: Steps of SQLite's virtual machine that a statement may take: some, and more for each byte of the file. A row takes
#: about ten, and some bytes; so this is what a hundred times as many rows would take.
_STEPS: Final = 10_000_000
_STEPS_A_BYTE: Final = 200
#: After so many steps it is looked at how many there were.
_PACE: Final = 10_000


class DistrustfulConnection(sqlite3.Connection):
    """A connection that expects the worst of its file, once ``distrust`` was called.

    Nothing that the file defines is run, and no statement goes on for ever.
    """

    def distrust(self, path: Path | str) -> None:
        """Be on guard; a statement may take as many steps as the size of the file at ``path`` explains."""
        self._files = [f"{path}", f"{path}-wal"]
        self._steps = 0
        self.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _MAX_BYTES)
        self.execute("PRAGMA foreign_keys = ON")
        self.execute("PRAGMA trusted_schema = OFF")
        self.execute("PRAGMA cell_size_check = ON")
        if sys.version_info >= (3, 12):
            self.setconfig(sqlite3.SQLITE_DBCONFIG_DEFENSIVE, True)
            self.setconfig(sqlite3.SQLITE_DBCONFIG_ENABLE_TRIGGER, False)
            self.setconfig(sqlite3.SQLITE_DBCONFIG_ENABLE_VIEW, False)
        self.set_authorizer(_refuse_what_a_file_says)
        self.set_progress_handler(self._is_too_much, _PACE)

    def execute(self, *statement: Any) -> sqlite3.Cursor:
        """Run a statement; an endless one is interrupted."""
        self._steps = 0
        return super().execute(*statement)

    def executemany(self, *statement: Any) -> sqlite3.Cursor:
        """Run a statement for each of many rows."""
        self._steps = 0
        return super().executemany(*statement)

    def _is_too_much(self) -> bool:
        self._steps += _PACE
        return self._steps > _STEPS and self._steps > _STEPS + _STEPS_A_BYTE * sum(map(_size, self._files))


def _size(path: str) -> int:
    try:
        return os.stat(path).st_size
    except (OSError, ValueError):
        return 0


def _refuse_what_a_file_says(_action: int, _first: Any, _second: Any, _database: Any, source: str | None) -> int:
    """Deny all that a trigger or a view, ``source``, would do."""
    return sqlite3.SQLITE_OK if source is None else sqlite3.SQLITE_DENY


#: Seconds that a writer waits for another one to end its transaction.
WAIT: Final = 5.0
_MAGIC: Final = b"SQLite format 3\0"

_WRITING_FAILED: Final = (
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_IOERR,
    sqlite3.SQLITE_PERM,
    sqlite3.SQLITE_TOOBIG,
)


class EmptyDatabaseError(InvalidInputError):
    """A database without a table: a writer made it, and came no further."""


def is_database(path: Path | str) -> bool:
    """Return whether there is an SQLite file at ``path``, whatever its name says."""
    return starts_with(path, _MAGIC)


@contextmanager
def translated(place: Path | str) -> Iterator[None]:
    """Turn errors of SQLite, and of values that it cannot hold, into this project's; the message names ``place``.

    Raises:
        BusyMemoryError: Another process was writing all the time that this one waited.
        InvalidInputError: Anything else.
    """
    try:
        yield
    except sqlite3.ProgrammingError as error:
        if "thread" not in str(error):
            raise
        raise InvalidInputError(
            f"{place}: used from another thread than the one that opened it; expected each thread to open it itself"
        ) from error
    except sqlite3.Error as error:
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF
        if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
            raise BusyMemoryError(
                f"{place}: another process is writing to it ({error}); expected it to end, so try again"
            ) from error
        if code in _WRITING_FAILED:
            raise InvalidInputError(f"{place}: cannot be written: {error}; nothing in it was changed") from error
        if code == sqlite3.SQLITE_CANTOPEN:
            raise InvalidInputError(
                f"{place}: cannot be opened: {error}; expected a path in a folder that can be written"
            ) from error
        if code == sqlite3.SQLITE_INTERRUPT:
            raise InvalidInputError(
                f"{place}: damaged: to read it takes more work than its size explains, so it was ended"
            ) from error
        raise InvalidInputError(f"{place}: damaged, or not a memory of atg-fg: {error}") from error
    except MemoryError as error:
        # SQLite says so where the first bytes of a file ask for more than there is, too.
        raise InvalidInputError(
            f"{place}: damaged: to read it takes more memory than there is; expected a memory of atg-fg"
        ) from error
    except (OverflowError, UnicodeError) as error:
        raise InvalidInputError(f"{place}: cannot be held in a database: {error}") from error


def open_to_read(path: Path | str) -> sqlite3.Connection:
    """Return a connection that reads; a file of an older version is read as if it were of the present one.

    Raises:
        InvalidInputError: There is no file, or it is no memory database of this version or before.
    """
    _check_file(path)
    with translated(path):
        # Not mode=ro: such a connection leaves behind the files that it shares with writers.
        connection = _connected(path, "mode=rw")
        try:
            connection.execute("PRAGMA query_only = ON")
            try:
                version = schema.version_of(connection, str(path))
            except sqlite3.OperationalError:
                # In a folder that cannot be written SQLite cannot make the files it shares with writers. There are no
                # writers then; but what they may have left in a log is to be read too.
                log = Path(f"{path}-wal")
                if log.exists() and log.stat().st_size > 0:
                    raise
                connection.close()
                connection = _connected(path, "mode=ro&immutable=1")
                version = schema.version_of(connection, str(path))
            if version == 0:
                raise EmptyDatabaseError(f"{path}: an empty database; expected a memory")
            if version < len(schema.MIGRATIONS):
                connection = _migrated_copy(connection, path)
        except BaseException:
            connection.close()
            raise
    return connection


def open_to_write(path: Path | str, *, create: bool = False, wait: float = WAIT) -> sqlite3.Connection:
    """Return a connection that writes; a file of an older version is led to the present one.

    Args:
        path: The file.
        create: Make the file if there is none.
        wait: Seconds to wait for another writer.

    Raises:
        BusyMemoryError: Another process was writing all that time.
        InvalidInputError: There is no file, it is no memory database, or it cannot be written.
    """
    if not create or os.path.exists(path):
        _check_file(path)
    with translated(path):
        connection = _connected(path, "mode=rwc" if create else "mode=rw", wait)
        try:
            version = schema.version_of(connection, str(path))
            connection.execute("PRAGMA journal_mode = WAL").fetchone()
            # A power cut shall leave each trial that was said to be kept.
            connection.execute("PRAGMA synchronous = FULL")
            if version < len(schema.MIGRATIONS):
                with written(connection):
                    schema.migrate(connection, str(path))
        except BaseException:
            connection.close()
            raise
    return connection


@contextmanager
def reading(path: Path | str) -> Iterator[sqlite3.Connection]:
    """Give a connection that reads, with errors as ``open_to_read`` and ``translated`` raise them; close it."""
    with translated(path), closing(open_to_read(path)) as connection:
        yield connection


@contextmanager
def writing(path: Path | str, *, create: bool = False, wait: float = WAIT) -> Iterator[sqlite3.Connection]:
    """Give a connection for one transaction, written at the end or not at all, and close it.

    Arguments and errors are those of ``open_to_write`` and ``translated``.
    """
    with translated(path), closing(open_to_write(path, create=create, wait=wait)) as connection, written(connection):
        yield connection


@contextmanager
def written(connection: sqlite3.Connection) -> Iterator[None]:
    """Write what is done inside as one transaction, or nothing of it if there is an error.

    The right to write is taken at once, so that what is read inside is what will be changed.
    """
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        roll_back(connection)
        raise


def roll_back(connection: sqlite3.Connection) -> None:
    """End a transaction, if there is one, with nothing changed; SQLite ends some by itself after an error."""
    if connection.in_transaction:
        connection.execute("ROLLBACK")


def _connected(path: Path | str, mode: str, wait: float = WAIT) -> sqlite3.Connection:
    uri = f"file:{quote(str(Path(path).absolute()))}?{mode}"
    connection = sqlite3.connect(uri, uri=True, timeout=wait, isolation_level=None, factory=DistrustfulConnection)
    connection.distrust(path)
    return connection


def _migrated_copy(connection: sqlite3.Connection, path: Path | str) -> sqlite3.Connection:
    """Return a copy in RAM with the present tables, since whoever reads must not write."""
    copy = sqlite3.connect(":memory:", isolation_level=None, factory=DistrustfulConnection)
    copy.distrust(path)
    connection.backup(copy)
    connection.close()
    with written(copy):
        schema.migrate(copy, str(path))
    return copy


def _check_file(path: Path | str) -> None:
    """Raise ``InvalidInputError`` if there is no file at ``path``, or one that is neither SQLite's nor empty."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise InvalidInputError(f"{path}: is no plain file; expected a memory database")
        with open(path, "rb") as file:
            head = file.read(len(_MAGIC))
    except (OSError, ValueError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise cannot_read(path, error, "a memory database") from error
    if head not in (b"", _MAGIC):
        raise InvalidInputError(f"{path}: not an SQLite file; expected a memory database")
