"""A process that has loaded what trials need, and forks workers: they begin in milliseconds, and share its memory."""

from __future__ import annotations

import atexit
import io
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import forkserver, reduction, resource_tracker
from multiprocessing.context import SpawnProcess, set_spawning_popen
from multiprocessing.popen_forkserver import Popen
from multiprocessing.spawn import get_preparation_data
from multiprocessing.util import Finalize
from typing import Any, Final

import numpy as np

from atg_fg.experiments.executors.starting import ONE_THREAD, start_of_process

#: What it imports.
PRELOADED: Final = "atg_fg.experiments.preloaded"
#: What Python reads for its path. Without the second it would look into the present folder first.
_PATH: Final = ("PYTHONPATH", "PYTHONSAFEPATH")


class WorkerServer:
    """A fork server of its own, which begins to load when it is made.

    It has one thread, so that a fork takes all of it along, and is deaf to Ctrl-C, as its workers are. It leaves when
    this process and all of its workers have left.

    Attributes:
        environment: The environment of workers.
    """

    def __init__(self) -> None:
        self._surroundings = _surroundings()
        self._server = forkserver.ForkServer()
        self._server.set_forkserver_preload([PRELOADED])
        self._has_forked = False
        try:
            resource_tracker.ensure_running()  # it would let Ctrl-C through
            with start_of_process():
                self.environment = dict(os.environ)
                with _path_as_here():
                    self._server.ensure_running()
        except BaseException:
            self.stop()
            raise

    def is_of_here(self) -> bool:
        """Return whether it is this process's own, and one that is begun now would find and load the same."""
        return self._surroundings == _surroundings()

    def fork(self, descriptors: list[int], message: bytes) -> tuple[int, int, int]:
        """Begin a process that does what a message says; wait until the server has loaded.

        Returns:
            Its id; a descriptor that tells when it has ended, and how; one that it lives as long as.

        Raises:
            OSError: The server is dead.
            EOFError: It died, or was stopped.
        """
        told, tell = self._server.connect_to_new_process(descriptors)
        try:
            with open(os.dup(tell), "wb") as file:
                file.write(message)
            process = forkserver.read_signed(told)
        except BaseException:
            _close(told, tell)
            raise
        self._has_forked = True
        return process, told, tell

    def process(self, *arguments: Any, **options: Any) -> SpawnProcess:
        """Make a process that this server is to fork."""
        process = ForkedProcess(*arguments, **options)
        process.server = self
        return process

    def give_up_loading(self) -> None:
        """End a server that has not forked yet, which may take long to load; ``fork`` raises ``EOFError`` then."""
        if not self._has_forked:
            self._kill()

    def stop(self) -> None:
        """End it; there are no workers any more."""
        self._kill()
        if self._surroundings[0] == os.getpid():
            with suppress(ChildProcessError):  # somebody has waited for it
                self._server._stop()  # type: ignore[attr-defined]

    def _kill(self) -> None:
        process = self._server._forkserver_pid  # type: ignore[attr-defined]
        if process is not None and self._surroundings[0] == os.getpid():
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)


def _close(*descriptors: int) -> None:
    for each in descriptors:
        os.close(each)


def _surroundings() -> tuple[Any, ...]:
    """Return what a server's workers inherit from this process."""
    return os.getpid(), dict(os.environ), list(sys.path), signal.pthread_sigmask(signal.SIG_BLOCK, ())


@contextmanager
def _path_as_here() -> Iterator[None]:
    """Let a Python that is begun in a ``with`` block find modules where this one does."""
    before = {name: os.environ.get(name) for name in _PATH}
    os.environ.update(zip(_PATH, (os.pathsep.join(get_preparation_data("server")["sys_path"]), "1"), strict=True))
    try:
        yield
    finally:
        for name, value in before.items():
            del os.environ[name]
            if value is not None:
                os.environ[name] = value


def is_possible() -> bool:
    """Return whether there can be a server, one that has a single thread and finds the modules that this process finds.

    Elsewhere than on Linux libraries of the system may have threads of their own.
    """
    single = all(os.environ.get(name, value) == value for name, value in ONE_THREAD.items())
    return sys.platform == "linux" and single and not sys.flags.ignore_environment


#: A server that no campaign has; at most one.
_idle: Final[list[WorkerServer]] = []


def take_server() -> WorkerServer | None:
    """Return a server for one campaign, that of the last one if nothing has changed since; ``None`` if not possible."""
    while _idle:
        server = _idle.pop()
        if server.is_of_here():
            return server
        server.stop()
    return WorkerServer() if is_possible() else None


def give_back(server: WorkerServer) -> None:
    """Keep a server that has no workers any more for the next campaign of this process."""
    _idle.append(server)
    for other in _idle[:-1]:
        _idle.remove(other)
        other.stop()


def begin_early() -> None:
    """Begin a server for a campaign that is going to be, so that it loads beside this process."""
    server = take_server()
    if server is not None:
        give_back(server)


@atexit.register
def _stop_idle() -> None:
    while _idle:
        _idle.pop().stop()


def differ_from_other_forks(environment: dict[str, str]) -> None:
    """Give a forked process this environment, and random numbers of its own where a library keeps a generator."""
    os.environ.clear()
    os.environ.update(environment)
    np.random.seed()  # noqa: NPY002


class ForkedProcess(SpawnProcess):
    """A process that a server forks; in it, what begins processes by itself spawns them, as in a spawned one."""

    server: WorkerServer | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "server"}

    @staticmethod
    def _Popen(process_obj: Any) -> Any:  # noqa: N802
        return _ForkedPopen(process_obj)


class _ForkedPopen(Popen):
    """Begins a process as ``multiprocessing.popen_forkserver.Popen`` does, with a server of its own."""

    _fds: list[int]

    def _launch(self, process_obj: ForkedProcess) -> None:
        assert process_obj.server is not None
        message = io.BytesIO()
        set_spawning_popen(self)
        try:
            reduction.dump(get_preparation_data(process_obj.name), message)
            reduction.dump(process_obj, message)
        finally:
            set_spawning_popen(None)
        self.pid, self.sentinel, end = process_obj.server.fork(self._fds, message.getvalue())
        self.finalizer = Finalize(self, _close, (end, self.sentinel))
