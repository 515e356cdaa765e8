"""Power cuts, simulated: what is written is recorded write by write, and after each of them the power may be cut.

What was not synced by then may be on the disk or not: all of it, none of it, or some sectors of it. A recording layer
inside of SQLite (its VFS, hooked through the library that Python itself uses) and around ``os.write``, ``os.fsync`` and
``os.replace`` says what was written and what was synced. Each disk that may be left is opened as after a restart: it
must hold every trial that was said to be kept.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import random
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import AtgError
from atg_fg.core.records import TrialSummary
from atg_fg.experiments.ablation import AblationLog, Cell
from atg_fg.experiments.scores import TestResult
from atg_fg.experiments.trial import learn_from
from atg_fg.storage.memory_files import open_memory
from tests.torture.kills import N_TRIALS, Course, found_in_database, found_in_log, found_in_results, trial_log
from tests.torture.mutations import FAST

_SECTOR = 512


class Disk:
    """Files as they are on a disk: what is there for sure, and what was written since the last sync."""

    def __init__(self) -> None:
        self.sure: dict[str, bytes] = {}
        self.pending: dict[str, list[tuple[int, bytes | None]]] = {}

    def write(self, name: str, offset: int, content: bytes) -> None:
        self.pending.setdefault(name, []).append((offset, content))

    def truncate(self, name: str, size: int) -> None:
        self.pending.setdefault(name, []).append((size, None))

    def sync(self, name: str) -> None:
        self.sure[name] = applied(self.sure.get(name, b""), self.pending.pop(name, []))

    def remove(self, name: str) -> None:
        self.sure.pop(name, None)
        self.pending.pop(name, None)

    def move(self, old: str, new: str) -> None:
        self.sure[new] = self.sure.pop(old, b"")
        self.pending[new] = self.pending.pop(old, [])

    def left(self, rng: random.Random) -> Iterator[dict[str, bytes]]:
        """Yield what may be left of all files: all that was written, what was synced, and something between."""
        names = self.sure.keys() | self.pending.keys()
        for kept in (lambda writes: writes, lambda _: [], partial(_some, rng), partial(_torn, rng)):
            yield {
                name: applied(self.sure.get(name, b""), kept(self.pending.get(name, [])))
                for name in names
                if name in self.sure or self.pending.get(name)
            }


def applied(content: bytes, writes: list[tuple[int, bytes | None]]) -> bytes:
    """Return a file after these writes; one without bytes cuts it to the size that it says."""
    data = bytearray(content)
    for offset, part in writes:
        if part is None:
            del data[offset:]
            continue
        data.extend(bytes(max(0, offset - len(data))))
        data[offset : offset + len(part)] = part
    return bytes(data)


def _some(rng: random.Random, writes: list[tuple[int, bytes | None]]) -> list[tuple[int, bytes | None]]:
    """Some of the sectors; those that were not written are as they were, or zeros where the file has grown."""
    sectors: list[tuple[int, bytes | None]] = []
    for offset, part in writes:
        if part is None:
            sectors.append((offset, None))
            continue
        if rng.random() < 0.5:
            sectors.append((offset + len(part), b""))
        starts = range(0, len(part), _SECTOR)
        sectors += [(offset + at, part[at : at + _SECTOR]) for at in starts if rng.random() < 0.5]
    return sectors


def _torn(rng: random.Random, writes: list[tuple[int, bytes | None]]) -> list[tuple[int, bytes | None]]:
    """All but for the last write, which is cut in the middle."""
    if not writes or writes[-1][1] is None:
        return writes
    offset, part = writes[-1]
    assert part is not None
    return [*writes[:-1], (offset, part[: rng.randrange(len(part) + 1)])]


def cut_power(n_trials: int, seed: int) -> dict[str, Any]:
    """Return how many disks were left by power cuts in each kind of file, and what was wrong with some."""
    disks: dict[str, int] = {}
    faults: list[str] = []
    for kind, (write, recording, found_in, structured) in KINDS.items():
        rng = random.Random(f"{seed}:{kind}")
        course = Course(structured=structured)
        with tempfile.TemporaryDirectory(dir=FAST) as folder:
            watch = _Watch(Path(folder), kind, rng, partial(found_in, course=course))
            with recording(watch):
                write(watch, course, n_trials)
        disks[kind] = watch.n_disks
        faults += watch.faults
    return {"disks": disks, "faults": faults}


class _Watch:
    """Looks at all disks that may be left at each moment, while trials are written to a file."""

    def __init__(
        self, folder: Path, name: str, rng: random.Random, found_in: Callable[[Path], tuple[int, int]]
    ) -> None:
        (folder / "live").mkdir()
        self.path = folder / "live" / "file"
        self._after = folder / "after"
        self.disk = Disk()
        self._name, self._rng, self._found_in = name, rng, found_in
        self.begun = self.ended = self.n_disks = 0
        self.faults: list[str] = []
        self._at_rest = True

    def is_here(self, path: str) -> bool:
        return self._at_rest and Path(path).parent == self.path.parent

    def cut(self) -> None:
        """Let the power be cut here, in each of the ways; nothing that is done about it is recorded."""
        self._at_rest = False
        try:
            for files in self.disk.left(self._rng):
                self._restart(files)
        finally:
            self._at_rest = True

    def _restart(self, files: dict[str, bytes]) -> None:
        self.n_disks += 1
        with tempfile.TemporaryDirectory(dir=FAST) as folder:
            for name, content in files.items():
                (Path(folder) / name).write_bytes(content)
            path = Path(folder) / self.path.name
            try:
                found, n_records = (0, 0) if not path.exists() or not path.stat().st_size else self._found_in(path)
            except (AtgError, sqlite3.Error) as error:
                self.faults.append(f"{self._name}, {self.ended} trials ended: {error}")
                return
        if found != n_records or not self.ended <= found <= self.begun:
            self.faults.append(f"{self._name}: {found} trials found, {self.ended} ended, {self.begun} begun")


def _write_database(watch: _Watch, course: Course, n_trials: int) -> None:
    with course.prepared(open_memory(watch.path, arcube_assumptions())) as memory:
        memory.begin_experiment("torture", {"trials": N_TRIALS}, seed=0)
        for record in course.records[:n_trials]:
            watch.begun += 1
            learn_from(record, memory)
            watch.ended += 1
    watch.cut()


def _write_log(watch: _Watch, course: Course, n_trials: int) -> None:
    log = trial_log(watch.path)
    log.resume()
    for record in course.records[:n_trials]:
        watch.begun += 1
        log.append(TrialSummary.of(record))
        watch.ended += 1
    watch.cut()


def _write_results(watch: _Watch, _course: Course, n_trials: int) -> None:
    log = AblationLog(watch.path, N_TRIALS)
    for number in range(n_trials):
        watch.begun += 1
        log.add(Cell("default", "ideal", "ideal", 8), TestResult(number, (1, 2), (2, 3), (1, 3)))
        watch.ended += 1
    watch.cut()


@contextmanager
def _recorded_calls(watch: _Watch) -> Iterator[None]:
    """Record what this project itself writes to plain files."""
    write, fsync, replace = os.write, os.fsync, os.replace

    def written(descriptor: int, content: bytes) -> int:
        path = _path_of(descriptor)
        offset = os.lseek(descriptor, 0, os.SEEK_CUR) if watch.is_here(path) else 0
        count = write(descriptor, content)
        if watch.is_here(path):
            watch.disk.write(Path(path).name, offset, bytes(content[:count]))
            watch.cut()
        return count

    def synced(descriptor: int) -> None:
        path = _path_of(descriptor)
        if watch.is_here(path) and Path(path).is_file():
            name = Path(path).name
            if name not in watch.disk.sure and name not in watch.disk.pending:  # was written through a buffer
                watch.disk.write(name, 0, Path(path).read_bytes())
            watch.cut()
        fsync(descriptor)
        if watch.is_here(path) and Path(path).is_file():
            watch.disk.sync(Path(path).name)
            watch.cut()

    def replaced(old: Any, new: Any) -> None:
        replace(old, new)
        if watch.is_here(str(new)):
            watch.cut()  # the new name may not be on the disk yet
            watch.disk.move(Path(old).name, Path(new).name)
            watch.cut()

    with ExitStack() as stack:
        for name, call in (("write", written), ("fsync", synced), ("replace", replaced)):
            stack.enter_context(patch.object(os, name, call))
        yield


def _path_of(descriptor: int) -> str:
    return os.readlink(f"/proc/self/fd/{descriptor}")


class _File(ctypes.Structure):
    """``sqlite3_file``; what follows is the VFS's own."""


_Pointer = ctypes.c_void_p
_METHODS = (
    *("xClose", "xRead", "xWrite", "xTruncate", "xSync", "xFileSize", "xLock", "xUnlock", "xCheckReservedLock"),
    *("xFileControl", "xSectorSize", "xDeviceCharacteristics", "xShmMap", "xShmLock", "xShmBarrier", "xShmUnmap"),
    *("xFetch", "xUnfetch"),
)


class _Methods(ctypes.Structure):
    """``sqlite3_io_methods``, whose functions are pointers here."""

    _fields_ = [("iVersion", ctypes.c_int), *((name, _Pointer) for name in _METHODS)]


class _Vfs(ctypes.Structure):
    """The beginning of ``sqlite3_vfs``."""

    _fields_ = [
        *(("iVersion", ctypes.c_int), ("szOsFile", ctypes.c_int), ("mxPathname", ctypes.c_int), ("pNext", _Pointer)),
        *(("zName", ctypes.c_char_p), ("pAppData", _Pointer), ("xOpen", _Pointer), ("xDelete", _Pointer)),
    ]


_File._fields_ = [("pMethods", ctypes.POINTER(_Methods))]
_INT = ctypes.c_int
# A name is handed on as the pointer that it came by: SQLite keeps it, and has more behind it.
_OPEN = ctypes.CFUNCTYPE(_INT, _Pointer, _Pointer, ctypes.POINTER(_File), _INT, _Pointer)
_DELETE = ctypes.CFUNCTYPE(_INT, _Pointer, _Pointer, _INT)
_WRITE = ctypes.CFUNCTYPE(_INT, _Pointer, _Pointer, _INT, ctypes.c_int64)
_TRUNCATE = ctypes.CFUNCTYPE(_INT, _Pointer, ctypes.c_int64)
_SYNC = ctypes.CFUNCTYPE(_INT, _Pointer, _INT)


def library_of_python() -> ctypes.CDLL | None:
    """Return the SQLite library that the module ``sqlite3`` uses, ``None`` if it is a part of Python itself."""
    import _sqlite3

    with open("/proc/self/maps") as maps:
        places = {line.split()[-1] for line in maps if "libsqlite3" in line}
    return ctypes.CDLL(places.pop()) if len(places) == 1 and _sqlite3 is not None else None


@contextmanager
def _hooked_sqlite(watch: _Watch) -> Iterator[None]:
    """Record what SQLite writes, while it goes on to write to the real file."""
    library = library_of_python()
    assert library is not None
    library.sqlite3_vfs_find.restype = ctypes.POINTER(_Vfs)
    vfs = library.sqlite3_vfs_find(None).contents
    hooks = _Hooks(watch, vfs)
    before = vfs.xOpen, vfs.xDelete
    vfs.xOpen, vfs.xDelete = (ctypes.cast(hook, _Pointer).value for hook in (hooks.open, hooks.delete))
    try:
        yield
    finally:
        vfs.xOpen, vfs.xDelete = before


class _Hooks:
    """The functions that SQLite calls in place of its own; they call these."""

    def __init__(self, watch: _Watch, vfs: _Vfs) -> None:
        self._watch = watch
        self._names: dict[int, str] = {}
        self._kept: list[Any] = []
        self._open, self._delete = _OPEN(vfs.xOpen), _DELETE(vfs.xDelete)
        self.open, self.delete = _OPEN(self._on_open), _DELETE(self._on_delete)

    def _on_open(self, vfs: Any, name: int | None, file: Any, flags: int, out: Any) -> int:
        status: int = self._open(vfs, name, file, flags, out)
        path = "" if name is None else ctypes.string_at(name).decode()
        if status == 0 and name is not None and self._watch.is_here(path):
            address = ctypes.addressof(file.contents)
            self._names[address] = Path(path).name
            file.contents.pMethods = ctypes.pointer(self._hooked(file.contents.pMethods.contents))
        return status

    def _on_delete(self, vfs: Any, name: int, sync: int) -> int:
        status: int = self._delete(vfs, name, sync)
        path = ctypes.string_at(name).decode()
        if status == 0 and self._watch.is_here(path):
            self._watch.disk.remove(Path(path).name)
            self._watch.cut()
        return status

    def _hooked(self, methods: _Methods) -> _Methods:
        write, truncate, sync = _WRITE(methods.xWrite), _TRUNCATE(methods.xTruncate), _SYNC(methods.xSync)

        def on_write(file: int, content: int, count: int, offset: int) -> int:
            status: int = write(file, content, count, offset)
            self._watch.disk.write(self._names[file], offset, ctypes.string_at(content, count))
            self._watch.cut()
            return status

        def on_truncate(file: int, size: int) -> int:
            status: int = truncate(file, size)
            self._watch.disk.truncate(self._names[file], size)
            self._watch.cut()
            return status

        def on_sync(file: int, flags: int) -> int:
            status: int = sync(file, flags)
            self._watch.disk.sync(self._names[file])
            self._watch.cut()
            return status

        made = _Methods.from_buffer_copy(methods)
        hooks = _WRITE(on_write), _TRUNCATE(on_truncate), _SYNC(on_sync)
        made.xWrite, made.xTruncate, made.xSync = (ctypes.cast(hook, _Pointer).value for hook in hooks)
        self._kept += [made, hooks]
        return made


#: For each kind of file: its writer, how it is recorded, what finds the trials in it, and whether structure is learned.
KINDS: dict[str, tuple[Callable[..., None], Callable[..., Any], Callable[..., tuple[int, int]], bool]] = {
    "log of trials": (_write_log, _recorded_calls, found_in_log, False),
    "log of results": (_write_results, _recorded_calls, found_in_results, False),
}
if library_of_python() is not None:
    KINDS |= {
        "database": (_write_database, _hooked_sqlite, found_in_database, False),
        "database with structure": (_write_database, _hooked_sqlite, found_in_database, True),
    }
