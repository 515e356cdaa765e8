"""A file of JSON lines that grows line by line, and is sound whenever it is cut off.

A writer that is killed leaves at most a part of the last line, which readers leave out. A line is put where it belongs
rather than at the end of the file, so that two writers of the same lines do no harm: a worker of a cluster that is
taken for lost may still be at it.
"""

from __future__ import annotations

import contextlib
import gzip
import json
import os
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from atg_fg.core.errors import InvalidInputError
from atg_fg.storage.checked_json import parse_json, plain_json
from atg_fg.storage.limits import gzip_members
from atg_fg.storage.named_pipes import write_all
from atg_fg.storage.plain_files import check_writable, read_bytes_file, write_bytes_atomically


class GrowingFile:
    """JSON lines with a header that says what they are of.

    Args:
        path: The file.
        header: The first line; a file with another one is refused.
        what: The lines, in words: ``the trials``.
        packed: Whether each line is a gzip member of its own.
    """

    def __init__(self, path: Path, header: Mapping[str, Any], what: str, *, packed: bool = False) -> None:
        self.path = path
        self._what, self._packed = what, packed
        self._header = json.loads(json.dumps(header, default=plain_json))
        self._end = path.stat().st_size if os.path.exists(path) else 0

    def begin(self) -> None:
        """Make the file, with its header.

        Raises:
            InvalidInputError: It is already there, or cannot be written.
        """
        check_not_begun(self.path)
        check_writable(self.path)
        content = self._line(self._header)
        write_bytes_atomically(self.path, content)
        self._end = len(content)

    def resume(self) -> list[Any]:
        """Return the lines after the header, cutting off part of a line at the end; begin the file if there is none.

        Raises:
            InvalidInputError: The file cannot be read, or has another header.
        """
        if not os.path.exists(self.path):
            self.begin()
            return []
        lines, sound = _sound_lines(self.path, packed=self._packed)
        if not lines or lines[0] != self._header:
            found = json.dumps(lines[0]) if lines else "nothing"
            raise InvalidInputError(f"{self.path}: holds {found}; expected {self._what} of {json.dumps(self._header)}")
        with self.path.open("r+b") as file:
            file.truncate(sound)
        self._end = sound
        return lines[1:]

    def append(self, line: Mapping[str, Any]) -> None:
        """Add a line.

        Raises:
            InvalidInputError: The disk is full, or the file cannot be written for another reason; ``resume`` goes on.
        """
        self._end = append_bytes(self.path, self._line(line), self._end)

    def _line(self, line: Mapping[str, Any]) -> bytes:
        separators = (",", ":") if self._packed else None
        text = json.dumps(line, default=plain_json, allow_nan=False, separators=separators) + "\n"
        return gzip.compress(text.encode(), mtime=0) if self._packed else text.encode()


def append_bytes(path: Path | str, content: bytes, start: int | None = None) -> int:
    """Put bytes at the end of a file, or at ``start``, so that they are on the disk; return where they end.

    Raises:
        InvalidInputError: They cannot be written; the file is as long as it was.
    """
    try:
        with open(path, "r+b", buffering=0) as file:
            size = file.seek(0, os.SEEK_END)
            begin = size if start is None else file.seek(start)
            try:
                write_all(file.fileno(), content)
                os.fsync(file.fileno())
            except OSError:
                with contextlib.suppress(OSError):
                    file.truncate(size)
                raise
    except OSError as error:
        raise InvalidInputError(
            f"{path}: cannot be written: {error.strerror}; what it held is kept, so that the work can be gone on with"
        ) from error
    return begin + len(content)


def check_not_begun(path: Path) -> None:
    """Raise ``InvalidInputError`` if there is a file of records already."""
    if os.path.exists(path):
        raise InvalidInputError(f"{path}: is already there; expected another folder, or --resume to go on")


def read_lines(path: Path, *, packed: bool = False) -> list[Any]:
    """Return the lines of a file; a part of a line at the end is left out.

    Raises:
        InvalidInputError: It cannot be read.
    """
    return _sound_lines(path, packed=packed)[0]


def _sound_lines(path: Path, *, packed: bool) -> tuple[list[Any], int]:
    """Return all whole lines, and how many bytes they are."""
    lines: list[Any] = []
    sound = 0
    content = read_bytes_file(path)
    try:
        for text, end in gzip_members(content, path) if packed else _text_lines(content):
            # What was unpacked and packed again is one member of many lines.
            for line in text.removesuffix(b"\n").split(b"\n"):
                lines.append(parse_json(line.decode(), f"{path}: line {len(lines) + 1}"))
            sound = end
    except (zlib.error, UnicodeError) as error:
        raise InvalidInputError(f"{path}: cannot be read: {error}; expected what --records or --log wrote") from error
    return lines, sound


def _text_lines(data: bytes) -> Iterator[tuple[bytes, int]]:
    """Yield whole lines and where each ends. Only a line feed ends one: JSON may hold other separators of lines."""
    end = 0
    for line in data.split(b"\n")[:-1]:
        end += len(line) + 1
        yield line, end
