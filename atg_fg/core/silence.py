"""What libraries print from C, kept from the streams of a command: its errors are one line, its output JSON alone."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def silenced(stream: int) -> Iterator[None]:
    """Drop what C code prints on standard output (1) or standard error (2) meanwhile.

    PyBullet tells on standard output what it thinks of a robot, image codecs on standard error what of a file.
    """
    flush = ctypes.CDLL(None).fflush if os.name == "posix" else lambda _: None
    flush(None)
    kept, nowhere = os.dup(stream), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, stream)
        yield
    finally:
        flush(None)
        os.dup2(kept, stream)
        os.close(kept)
        os.close(nowhere)
