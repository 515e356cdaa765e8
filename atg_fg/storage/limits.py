"""How much a file from anywhere may hold: small files that unfold to gigabytes are refused while they are read."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from atg_fg.core.errors import InvalidInputError, TooLargeError

#: What a compressed file may unfold to, and what a pipe may bring; or the size of the file itself, if that is more.
MAX_UNPACKED_BYTES: Final = 64 * 2**20
#: The size of a file that is read at once.
MAX_FILE_BYTES: Final = 2**31
#: Environment variable: a number of bytes in place of both limits.
LIMIT_VARIABLE: Final = "ATG_FG_MAX_BYTES"
_GZIP: Final = 31  # zlib's name for data with a gzip header
#: Bytes that are made, and taken in, at once: what a member leaves over is copied, so that it must not be all the rest.
_PART: Final = 2**20
_FED: Final = 2**16
#: Zeros at the end by which it is told that a member was not written: no sound one ends with as many.
_UNWRITTEN: Final = 9


def byte_limit(usual: int) -> int:
    """Return the limit that the environment variable gives, or else the usual one.

    Raises:
        InvalidInputError: The variable is no whole number of at least 1.
    """
    given = os.environ.get(LIMIT_VARIABLE, "")
    if not given:
        return usual
    if not (given.isascii() and given.isdigit() and len(given) < 20 and int(given)):
        raise InvalidInputError(f"{LIMIT_VARIABLE}: {given!r}; expected a whole number of bytes, at least 1")
    return int(given)


def refuse_size(path: Path | str, limit: int) -> TooLargeError:
    """Return the error about a file that holds more than ``limit`` bytes."""
    return TooLargeError(
        f"{path}: holds more than {limit:,} bytes; expected less, or a higher limit in the environment variable "
        f"{LIMIT_VARIABLE}"
    )


def unpacked_limit(packed: int) -> int:
    """Return how many bytes a file of ``packed`` bytes may unfold to."""
    return max(byte_limit(MAX_UNPACKED_BYTES), packed)


def gzip_members(content: bytes, path: Path | str) -> Iterator[tuple[bytes, int]]:
    """Yield what each whole gzip member unfolds to, and where it ends; half a member at the end is left out.

    So is what a power cut can leave of the last one on some file systems: zeros in place of all, or of the rest, of it.

    Args:
        content: Of the file.
        path: For error messages.

    Raises:
        TooLargeError: All of them together unfold to more than ``unpacked_limit``.
        zlib.error: Something else than a gzip member.
    """
    limit = left = unpacked_limit(len(content))
    data, at = memoryview(content), 0
    while at < len(data):
        member, parts, asked, start = zlib.decompressobj(_GZIP), [b""], 0, at
        # Once all is taken in there may still be something to come out.
        while not member.eof and (at < len(data) or len(parts[-1]) == asked > 0):
            fed, asked = data[at : at + _FED], min(_PART, left + 1)
            try:
                parts.append(member.decompress(fed, asked))
            except zlib.error:
                if not any(data[max(start, len(data) - _UNWRITTEN) :]):
                    return
                raise
            at += len(fed) - len(member.unused_data if member.eof else member.unconsumed_tail)
            left -= len(parts[-1])
            if left < 0:
                raise refuse_size(path, limit)
        if not member.eof:
            return
        yield b"".join(parts), at
