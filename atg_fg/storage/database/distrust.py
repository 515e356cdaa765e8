"""A connection to a file from anywhere: nothing that the file defines is run, and no statement goes on for ever."""

from __future__ import annotations

import os
import sqlite3
import sys
from pathlib import Path
from typing import Any, Final

#: No text in a memory is longer; a damaged file may say so.
_MAX_BYTES: Final = 2**26


#: Steps of SQLite's virtual machine that a statement may take: some, and more for each byte of the file. A row takes
#: about ten, and some bytes; so this is what a hundred times as many rows would take.
_STEPS: Final = 10_000_000
_STEPS_A_BYTE: Final = 200


#: After so many steps it is looked at how many there were.
_PACE: Final = 10_000


class DistrustfulConnection(sqlite3.Connection):
    """A connection that expects the worst of its file, once ``distrust`` was called."""

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
