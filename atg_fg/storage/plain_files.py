"""Files on disk: written whole or not at all, checked when they are read, never pickled.

A path may stand for something else than a file of its own. Symbolic links are followed. A device, a pipe, or an open
descriptor (``/dev/stdout``, ``/dev/fd/63`` as a shell makes it of ``>(…)``) is written to as it is, since there is
nothing to replace.
"""

from __future__ import annotations

import codecs
import contextlib
import os
import secrets
import stat
import sys
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Final

from atg_fg.core.errors import AtgError, InvalidInputError, TooLargeError
from atg_fg.storage.limits import MAX_FILE_BYTES, MAX_UNPACKED_BYTES, byte_limit, gzip_members, refuse_size
from atg_fg.storage.named_pipes import PART, begin_of_pipe, open_without_waiting, write_all, write_in_place

try:
    import fcntl
except ImportError:  # not on Windows: there, what a killed writer leaves behind stays
    fcntl = None  # type: ignore[assignment]

#: How a gzipped file begins.
GZIP: Final = b"\x1f\x8b"
#: How a file is named while it is written.
_TEMPORARY: Final = (".atg-fg-", ".tmp")
#: Links that are followed in search of an open descriptor; the kernel follows no more.
_MOST_LINKS: Final = 40


def read_bytes_file(path: Path | str) -> bytes:
    """Return the content of a file, or all that comes through a pipe.

    Raises:
        InvalidInputError: It cannot be read.
        TooLargeError: More than ``MAX_FILE_BYTES``, or than ``MAX_UNPACKED_BYTES`` from what has no size.
    """
    try:
        with open(path, "rb", opener=open_without_waiting) as file:
            status = os.fstat(file.fileno())
            plain = stat.S_ISREG(status.st_mode)
            limit = byte_limit(MAX_FILE_BYTES if plain else MAX_UNPACKED_BYTES)
            if plain and status.st_size > limit:
                raise refuse_size(path, limit)
            begin = begin_of_pipe(file, path, status)
            content = file.read() if plain else begin + _at_most(file, limit + 1)
    except (OSError, ValueError, MemoryError) as error:
        if isinstance(error, (InvalidInputError, TooLargeError)):
            raise
        raise cannot_read(path, error) from error
    if len(content) > limit:
        raise refuse_size(path, limit)
    return content


def read_text_file(path: Path | str, *, packed: bool = False) -> str:
    """Return the text of a UTF-8 file.

    Args:
        path: The file.
        packed: Whether it may be gzipped, or UTF-16 with a byte order mark, as spreadsheets write it.

    Raises:
        InvalidInputError: It cannot be read, or is not UTF-8.
        TooLargeError: As for ``read_bytes_file``, or it unfolds to more than ``limits.unpacked_limit``.
    """
    content = read_bytes_file(path)
    if packed and content.startswith(GZIP):
        content = _unpacked(content, path, "expected a gzipped text file")
    content = content.removeprefix(codecs.BOM_UTF8)  # as some editors begin a file
    encoding = "utf-16" if packed and content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8"
    try:
        return content.decode(encoding).replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        what = f"line {line}: byte 0x{content[error.start]:02x}, not {encoding.upper()}"
        what = "a gzipped file" if content.startswith(GZIP) else what
        raise InvalidInputError(f"{path}: {what}; expected a UTF-8 text file") from error


def starts_with(path: Path | str, start: bytes) -> bool:
    """Return whether there is a plain file at ``path`` that begins with these bytes; nothing is taken from a pipe."""
    if not is_plain_file(path):
        return False
    try:
        with open(path, "rb") as file:
            return file.read(len(start)) == start
    except OSError:
        return False


def read_gzipped_text(path: Path | str, expected: str) -> str:
    """Return the UTF-8 text that a gzipped file unfolds to.

    Args:
        path: The file.
        expected: What it should be, for error messages.

    Raises:
        InvalidInputError: It cannot be read, or is no such file.
        TooLargeError: It unfolds to more than ``limits.unpacked_limit``.
    """
    try:
        return _unpacked(read_bytes_file(path), path, expected).decode()
    except UnicodeError as error:
        raise InvalidInputError(f"{path}: cannot be read: {error}; {expected}") from error


def _unpacked(content: bytes, path: Path | str, expected: str) -> bytes:
    """Return what gzipped content unfolds to; raise ``InvalidInputError`` if it is cut off or none."""
    try:
        parts = list(gzip_members(content, path))
        if not parts or parts[-1][1] < len(content):
            raise ValueError("cut off")
        return b"".join(part for part, _ in parts)
    except (zlib.error, ValueError) as error:
        if isinstance(error, TooLargeError):
            raise
        raise InvalidInputError(f"{path}: cannot be read: {error}; {expected}") from error


def is_plain_file(path: Path | str) -> bool:
    """Return whether there is a file at ``path``, links followed; what comes through a pipe can be read only once."""
    try:
        return stat.S_ISREG(os.stat(path).st_mode)
    except (OSError, ValueError):
        return False


@contextmanager
def readable_again(path: Path) -> Iterator[Path]:
    """Give a path that can be read more than once: the file itself, or a copy of what came through a pipe.

    Raises:
        InvalidInputError: The pipe cannot be read.
        TooLargeError: As for ``read_bytes_file``.
    """
    if is_plain_file(path) or not os.path.exists(path) or os.path.isdir(path):
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="atg-fg-") as folder:
        copy = Path(folder) / (path.name or "pipe")
        copy.write_bytes(read_bytes_file(path))
        try:
            yield copy
        except AtgError as error:
            raise type(error)(str(error).replace(str(copy), str(path))) from error


def write_bytes_atomically(path: Path | str, content: bytes) -> None:
    """Write a file so that at any moment its path holds the old content or the new one, never a part.

    Links are followed; a file that is there keeps its mode and its owner, a new one gets those that the umask allows.
    What is no plain file is written to in place.

    Raises:
        InvalidInputError: The folder does not exist or cannot be written, and the old file is as it was; or no one
            reads from a named pipe within ``PIPE_WAIT`` seconds.
        BrokenPipeError: Whoever reads from a pipe has gone.
    """
    with _writing_to(path):
        path = os.fspath(path) or "."  # nothing stands for this folder
        descriptor = _descriptor_of(path)
        if descriptor is not None:
            _write_to_descriptor(descriptor, content)
            return
        status = _status(path)
        if status is not None and stat.S_ISDIR(status.st_mode):
            raise _is_folder(path)
        if status is not None and not stat.S_ISREG(status.st_mode):
            write_in_place(path, content)
            return
        _replace(Path(os.path.realpath(path)), content, status)


def check_writable(path: Path | str) -> None:
    """Raise ``InvalidInputError`` if a file could not be written at ``path``; leave nothing behind.

    Called before long work, so that its result is not lost at the end.
    """
    with _writing_to(path):
        path = os.fspath(path) or "."  # nothing stands for this folder
        descriptor = _descriptor_of(path)
        status = _status(path) if descriptor is None else os.fstat(descriptor)
        if status is not None and stat.S_ISDIR(status.st_mode):
            raise _is_folder(path)
        if status is not None and not os.access(path, os.W_OK):
            raise PermissionError(0, "Permission denied")
        if descriptor is None and (status is None or stat.S_ISREG(status.st_mode)):
            with tempfile.TemporaryFile(dir=Path(os.path.realpath(path)).parent):
                pass


def make_folder(path: Path | str) -> Path:
    """Make a folder for output if it is not there, and return it.

    Raises:
        InvalidInputError: It cannot be made or written.
    """
    folder = Path(path)
    with _writing_to(path):
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    return folder


def cannot_read(path: Path | str, error: Exception, expected: str = "a file that can be read") -> InvalidInputError:
    """Return the error about a file that cannot be read."""
    reason = error.strerror if isinstance(error, OSError) else str(error) or "not enough memory"
    return InvalidInputError(f"{path}: cannot be read: {reason}; expected {expected}")


def _at_most(file: IO[bytes], n_bytes: int) -> bytes:
    """Return what a stream holds, but not more than so many bytes of it."""
    parts, left = [], n_bytes
    while left and (part := file.read(min(left, PART))):
        parts.append(part)
        left -= len(part)
    return b"".join(parts)


def _status(path: Path | str) -> os.stat_result | None:
    try:
        return os.stat(path)
    except FileNotFoundError:
        return None


def _descriptor_of(path: Path | str) -> int | None:
    """Return the open descriptor that a path such as ``/dev/stdout`` stands for, if it does."""
    at = Path(path)
    for _ in range(_MOST_LINKS):
        folder = os.path.realpath(at.parent)
        if folder in (f"/proc/{os.getpid()}/fd", "/dev/fd"):
            return int(at.name) if at.name.isascii() and at.name.isdigit() else None
        if not at.is_symlink():
            return None
        at = Path(folder) / os.readlink(at)
    return None


def _write_to_descriptor(descriptor: int, content: bytes) -> None:
    """Write where the descriptor stands; what was printed before comes before it."""
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    write_all(descriptor, content)


def _replace(target: Path, content: bytes, status: os.stat_result | None) -> None:
    """Write a file beside the one at ``target``, and put it in its place; ``status`` is of that, if there is one."""
    if status is not None and not os.access(target, os.W_OK):
        raise PermissionError(0, "Permission denied")
    with _temporary_beside(target) as (file, temporary):
        file.write(content)
        file.flush()
        if status is not None:
            # Only root may give a file away; the mode comes after it, as a change of the owner may take some of it.
            with contextlib.suppress(OSError):
                os.chown(file.fileno(), status.st_uid, status.st_gid)
            os.chmod(temporary, stat.S_IMODE(status.st_mode))
        os.fsync(file.fileno())
        os.replace(temporary, target)
    _sync_folder(target.parent)


@contextmanager
def _temporary_beside(target: Path) -> Iterator[tuple[IO[bytes], Path]]:
    """Give a new file in the folder of ``target``; it is removed if there is an error.

    While it is written it is locked. So one that is not locked was left by a writer that was killed, and is removed.
    """
    _remove_left_behind(target.parent)
    while True:
        temporary = target.parent / secrets.token_hex(8).join(_TEMPORARY)
        with os.fdopen(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666), "wb") as file:
            if fcntl is not None:
                with contextlib.suppress(OSError):  # some network file systems know no locks
                    fcntl.flock(file, fcntl.LOCK_EX)
            if not _is_at(file, temporary):
                continue  # another writer took it for left behind before it was locked
            try:
                yield file, temporary
            except BaseException:
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(temporary)
                raise
            return


def _is_at(file: IO[bytes], path: Path) -> bool:
    status = _status(path)
    return status is not None and os.path.samestat(status, os.fstat(file.fileno()))


def _remove_left_behind(folder: Path) -> None:
    """Remove what writers that were killed have left in a folder; nothing goes wrong if that cannot be done."""
    if fcntl is None:
        return
    start, end = _TEMPORARY
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        left = [entry.path for entry in entries if entry.name.startswith(start) and entry.name.endswith(end)]
        for path in left:
            with contextlib.suppress(OSError), open(path, "rb") as file:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.unlink(path)


def _sync_folder(folder: Path) -> None:
    """Let the new name of a file be on the disk, where the file system can do so."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _is_folder(path: Path | str) -> InvalidInputError:
    return InvalidInputError(f"{path}: is a folder; expected the path of a file")


@contextmanager
def _writing_to(path: Path | str) -> Iterator[None]:
    """Say which path it is that cannot be written, but for a pipe whose reader has gone."""
    try:
        yield
    except (InvalidInputError, BrokenPipeError):
        raise
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        expected = "expected a path in a folder that can be written"
        raise InvalidInputError(f"{path}: cannot be written: {reason}; {expected}") from error
