"""Named pipes and devices, whose other end may not be there: opened without waiting, read and written in place."""

from __future__ import annotations

import errno
import os
import stat
import time
from pathlib import Path
from typing import IO, Final

from atg_fg.core.errors import InvalidInputError

#: Seconds in which someone must open the other end of a named pipe; who has it open may take their time.
PIPE_WAIT: Final = 5.0
#: Bytes that are read at once from what has no size, and seconds between two looks whether someone writes.
PART: Final = 2**20
_POLL: Final = 0.02
#: Flag of opening that does not wait for the other end; Windows has no such pipes.
_NOT_WAITING: Final = getattr(os, "O_NONBLOCK", 0)


def open_without_waiting(path: str, flags: int) -> int:
    """Open a file, a named pipe even if no one writes to it yet."""
    return os.open(path, flags | _NOT_WAITING)


def begin_of_pipe(file: IO[bytes], path: Path | str, status: os.stat_result) -> bytes:
    """Return the first bytes of a pipe, nothing of other files, and let all that is read from now on be waited for.

    Raises:
        InvalidInputError: No one writes to the pipe within ``PIPE_WAIT`` seconds.
    """
    begin, end = b"", time.monotonic() + PIPE_WAIT
    while stat.S_ISFIFO(status.st_mode) and not begin:
        try:
            begin = os.read(file.fileno(), PART)
        except BlockingIOError:
            break  # someone has it open, and has not written yet
        if not begin and time.monotonic() > end:
            raise InvalidInputError(
                f"{path}: a pipe to which no one writes for {PIPE_WAIT:g} s; expected a file, or a pipe with a writer"
            )
        time.sleep(0 if begin else _POLL)
    if _NOT_WAITING:
        os.set_blocking(file.fileno(), True)
    return begin


def write_in_place(path: Path | str, content: bytes) -> None:
    """Write to a device or a named pipe.

    Raises:
        InvalidInputError: No one reads from the pipe within ``PIPE_WAIT`` seconds.
    """
    end = time.monotonic() + PIPE_WAIT
    while True:
        try:
            descriptor = os.open(path, os.O_WRONLY | _NOT_WAITING)
            break
        except OSError as error:
            if error.errno != errno.ENXIO or not stat.S_ISFIFO(os.stat(path).st_mode):
                raise
        if time.monotonic() > end:
            raise InvalidInputError(
                f"{path}: a pipe from which no one reads for {PIPE_WAIT:g} s; expected a file, or a pipe with a reader"
            )
        time.sleep(_POLL)
    # A file object would write what is left once more when Ctrl-C ends it.
    try:
        if _NOT_WAITING:
            os.set_blocking(descriptor, True)
        write_all(descriptor, content)
    finally:
        os.close(descriptor)


def write_all(descriptor: int, content: bytes) -> None:
    """Write all of some bytes to an open descriptor."""
    left = memoryview(content)
    while left:
        left = left[os.write(descriptor, left) :]
