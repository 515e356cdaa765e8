"""Spawned processes that each run one piece of work at a time, and are replaced when they die."""

from __future__ import annotations

import ctypes
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import parent_process
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any, Final

from atg_fg.core.errors import WorkerLostError
from atg_fg.experiments.executors.steps import tell_steps_to

#: What libraries of linear algebra read when they are loaded. There is a process for each processor already, so threads
#: of theirs would only take turns; and a sum must not depend on how many there are.
_ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)


class WorkerProcesses:
    """Pools of one process each: a pool of several is broken as a whole when one of its processes dies.

    They are spawned, and so cannot inherit half of a library's state, which a fork does.

    Args:
        slots: How many there are at most; each begins when there is something for it to do.
    """

    attempts = 3

    def __init__(self, slots: int) -> None:
        self.slots = slots
        self._idle: list[_Worker] = []
        self._busy: dict[Future[Any], _Worker] = {}
        self._all: list[_Worker] = []

    def submit(self, function: Callable[[Any], Any], piece: Any) -> Future[Any]:
        """Begin a piece."""
        while self._idle:
            worker = self._idle.pop()
            try:
                return self._begin(worker, function, piece)
            except BrokenProcessPool:  # it died while it was idle
                worker.pool.shutdown()
        with _start_of_process():
            self._all.append(_Worker())
        return self._begin(self._all[-1], function, piece)

    def _begin(self, worker: _Worker, function: Callable[[Any], Any], piece: Any) -> Future[Any]:
        # An interruption waits until the worker is in the list: all workers in the list are ended after it.
        with _start_of_process():
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


class _Worker:
    """A pool of one process, and that process."""

    def __init__(self) -> None:
        self._context = _RecordingContext()
        # Only its process writes to it. So it needs no lock, which a killed process might hold for ever.
        self.steps = self._context.RawValue(ctypes.c_uint64, 0)
        self.pool = ProcessPoolExecutor(1, mp_context=self._context, initializer=_prepare, initargs=(self.steps,))

    def terminate(self) -> None:
        for process in self._context.processes:
            if process.pid is not None:
                process.terminate()


class _RecordingContext(SpawnContext):
    """Keeps the processes that a pool makes with it; the pool itself does not give them out."""

    def __init__(self) -> None:
        super().__init__()
        self.processes: list[SpawnProcess] = []

    def Process(self, *arguments: Any, **options: Any) -> SpawnProcess:  # type: ignore[override]  # noqa: N802
        """Make a process, as the class of this name in a context does."""
        process = SpawnProcess(*arguments, **options)
        self.processes.append(process)
        return process


@contextmanager
def _start_of_process() -> Iterator[None]:
    """Let processes that are begun in a ``with`` block have one thread for linear algebra, and ignore Ctrl-C.

    Both are inherited, and so hold from the first moment; what the user has set in the environment stays. A terminal
    sends Ctrl-C to all processes, but only this one shall answer, and not before the block has ended: a process that
    was told only a half of what it is to do would complain.
    """
    added = {name: value for name, value in _ONE_THREAD.items() if name not in os.environ}
    os.environ.update(added)
    blockable = hasattr(signal, "pthread_sigmask")  # not on Windows
    with _answered_later():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if blockable else None
        try:
            yield
        finally:
            for name in added:
                del os.environ[name]
            if before is not None:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _answered_later() -> Iterator[None]:
    """Answer Ctrl-C after the block.

    To block the signal is not enough: then another thread takes it, and Python answers it in this one all the same.
    """
    answer = signal.getsignal(signal.SIGINT)
    if not callable(answer) or threading.current_thread() is not threading.main_thread():
        yield  # nobody answers, or another thread does
        return
    met: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: met.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, answer)
        if met:
            signal.raise_signal(signal.SIGINT)


def _prepare(steps: Any) -> None:
    """Prepare a worker: it counts its steps, ignores Ctrl-C, and leaves when the process that began it is gone."""

    def tell() -> None:
        steps.value += 1

    tell_steps_to(tell)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _leave_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
