"""Processes that each run one piece of work at a time, and are replaced when they die."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import parent_process
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import TYPE_CHECKING, Any

from atg_fg.core.errors import WorkerLostError
from atg_fg.experiments.executors.starting import answered_later, start_of_process
from atg_fg.experiments.executors.steps import tell_steps_to

if TYPE_CHECKING:
    from atg_fg.experiments.executors.fork_server import WorkerServer


class WorkerProcesses:
    """Pools of one process each: a pool of several is broken as a whole when one of its processes dies.

    A server forks them (``WorkerServer``), or else they are spawned; neither inherits half of a library's state, as a
    fork of this process would.

    Args:
        slots: How many there are at most; each begins when there is something for it to do.
    """

    attempts = 3

    def __init__(self, slots: int) -> None:
        self.slots = slots
        self._idle: list[_Worker] = []
        self._busy: dict[Future[Any], _Worker] = {}
        self._all: list[_Worker] = []
        self._server = _take_server()

    def submit(self, function: Callable[[Any], Any], piece: Any) -> Future[Any]:
        """Begin a piece."""
        while self._idle:
            worker = self._idle.pop()
            try:
                return self._begin(worker, function, piece)
            except BrokenProcessPool:  # it died while it was idle
                worker.pool.shutdown()
        if self._server is not None:
            try:
                return self._begin(self._new_worker(), function, piece)
            except (EOFError, OSError):  # the server died
                self._server.stop()
                self._server = None
        return self._begin(self._new_worker(), function, piece)

    def _new_worker(self) -> _Worker:
        with start_of_process():
            self._all.append(_Worker(self._server))
        return self._all[-1]

    def _begin(self, worker: _Worker, function: Callable[[Any], Any], piece: Any) -> Future[Any]:
        # An interruption waits until the worker is in the list: all workers in the list are ended after it.
        with start_of_process() if worker.server is None else answered_later(worker.server.give_up_loading):
            future = worker.pool.submit(function, piece)
            self._busy[future] = worker
        return future

    def result(self, future: Future[Any]) -> Any:
        """Return what came of a piece that has ended, or raise what it raised.

        Raises:
            WorkerLostError: Its process died.
        """
        worker = self._busy.pop(future)
        try:
            result = future.result()
        except BrokenProcessPool as error:
            worker.pool.shutdown()
            raise WorkerLostError(
                f"its process died {self.attempts} times over; expected it to end (out of memory?)"
            ) from error
        self._idle.append(worker)
        return result

    def steps(self) -> int:
        """Return how many steps all pieces have done so far."""
        return sum(worker.steps.value for worker in self._all)

    def close(self) -> None:
        """End all processes, those at once that are busy."""
        workers = [*self._idle, *self._busy.values()]
        for worker in self._busy.values():
            worker.terminate()
        for worker in workers:
            worker.pool.shutdown(cancel_futures=True)
        if self._server is not None:
            from atg_fg.experiments.executors.fork_server import give_back

            give_back(self._server)
            self._server = None


def _take_server() -> WorkerServer | None:
    if sys.platform != "linux":  # elsewhere there may be nothing that this import needs
        return None
    from atg_fg.experiments.executors.fork_server import take_server

    return take_server()


class _Worker:
    """A pool of one process, and that process."""

    def __init__(self, server: WorkerServer | None) -> None:
        self.server = server
        self._context = _RecordingContext(server)
        # Only its process writes to it. So it needs no lock, which a killed process might hold for ever.
        self.steps = self._context.RawValue(ctypes.c_uint64, 0)
        told = (self.steps, None if server is None else server.environment)
        self.pool = ProcessPoolExecutor(1, mp_context=self._context, initializer=_prepare, initargs=told)

    def terminate(self) -> None:
        for process in self._context.processes:
            if process.pid is not None:
                process.terminate()


class _RecordingContext(SpawnContext):
    """Keeps the processes that a pool makes with it; the pool itself does not give them out."""

    def __init__(self, server: WorkerServer | None) -> None:
        super().__init__()
        self._server = server
        self.processes: list[SpawnProcess] = []

    def Process(self, *arguments: Any, **options: Any) -> SpawnProcess:  # type: ignore[override]  # noqa: N802
        """Make a process, as the class of this name in a context does."""
        process = (
            SpawnProcess(*arguments, **options) if self._server is None else self._server.process(*arguments, **options)
        )
        self.processes.append(process)
        return process


def _prepare(steps: Any, environment: dict[str, str] | None) -> None:
    """Prepare a worker: it counts its steps, ignores Ctrl-C, and leaves when the process that began it is gone.

    Args:
        steps: Where it counts.
        environment: What it has, if it is not inherited.
    """

    def tell() -> None:
        steps.value += 1

    if environment is not None:
        from atg_fg.experiments.executors.fork_server import differ_from_other_forks

        differ_from_other_forks(environment)
    tell_steps_to(tell)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _leave_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
