"""Many pieces of work at once, in processes, in threads or on a cluster; their results in the order of the pieces."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import closing
from typing import Any, Final, Protocol, TypeVar
from urllib.parse import urlsplit

from atg_fg.core.errors import InvalidInputError, WorkerLostError
from atg_fg.experiments.executors.steps import piece_here, tell_steps_to

Piece = TypeVar("Piece")
Result = TypeVar("Result")
#: What is accepted as an executor.
EXECUTORS: Final = "process, thread or dask://host:port"
#: Seconds between two questions, while pieces run, how many steps they have done.
_SECONDS: Final = 0.2


class Workers(Protocol):
    """Where pieces are run.

    Attributes:
        slots: How many pieces may be there at once.
        attempts: How many times a piece is begun; after that its workers' deaths count as its own fault.
    """

    slots: int
    attempts: int

    def submit(self, function: Callable[[Any], Any], piece: Any) -> Future[Any]:
        """Begin a piece."""

    def result(self, future: Future[Any]) -> Any:
        """Return what came of a piece that has ended, or raise what it raised.

        Raises:
            WorkerLostError: Its worker died in the middle.
        """

    def steps(self) -> int:
        """Return how many steps all pieces have done so far, as far as that is known before they end."""

    def close(self) -> None:
        """End all workers; what they are at is given up."""


def run_pieces(
    function: Callable[[Piece], Result],
    pieces: Sequence[Piece],
    executor: str = "process",
    jobs: int = 1,
    on_result: Callable[[int, Result], None] | None = None,
    on_steps: Callable[[int], None] | None = None,
) -> list[Result]:
    """Run a function on every piece and return the results in the order of the pieces.

    The pieces are begun in their order, so that the longest should come first. One whose worker dies is run again, the
    others are not touched; so a function must come to the same when it is run again after it was killed. If a piece
    raises an exception, or this process is interrupted, all workers are ended before it is passed on.

    Args:
        function: Of one piece. For processes and clusters it, the pieces and the results must be picklable.
        pieces: Its arguments.
        executor: ``process``, ``thread``, or the address of a dask scheduler as ``dask://host:port``.
        jobs: Processes or threads; with 1 all are done here, one after the other. A cluster has as many as it has.
        on_result: Called in this thread with the number and the result of each piece as soon as it has ended.
        on_steps: Called in this thread, now and then, with the number of steps that pieces have done since the last
            call (``step_done``). A cluster does not tell. Steps of a piece that is run again count again.

    Raises:
        InvalidInputError: ``jobs`` or ``executor`` is not as it should be, or no scheduler answers.
        MissingDependencyError: A cluster is asked for and dask is not installed.
        WorkerLostError: The workers of one piece died again and again.
    """
    check_executor(executor)
    if jobs < 1:
        raise InvalidInputError(f"jobs: {jobs}; expected a whole number of at least 1")
    results: dict[int, Result] = {}

    def keep(number: int, result: Result) -> None:
        results[number] = result
        if on_result is not None:
            on_result(number, result)

    jobs = min(jobs, len(pieces))
    if not is_cluster(executor) and jobs <= 1:
        tell_steps_to(None if on_steps is None else lambda: on_steps(1))
        try:
            for number, piece in enumerate(pieces):
                keep(number, function(piece))
        finally:
            tell_steps_to(None)
    elif pieces:
        with closing(_open(executor, jobs)) as workers:
            _run_on(workers, function, pieces, keep, on_steps)
    return [results[number] for number in range(len(pieces))]


def _run_on(
    workers: Workers,
    function: Callable[[Piece], Result],
    pieces: Sequence[Piece],
    keep: Callable[[int, Result], None],
    on_steps: Callable[[int], None] | None,
) -> None:
    """Keep all slots busy until each piece has its result."""
    told = 0
    waiting = deque(range(len(pieces)))
    running: dict[Future[Result], int] = {}
    losses: Counter[int] = Counter()
    while waiting or running:
        # Only as many pieces as can run at once are handed over: a lost worker then tells which piece it had.
        while waiting and len(running) < workers.slots:
            number = waiting.popleft()
            running[workers.submit(function, pieces[number])] = number
        patience = None if on_steps is None else _SECONDS
        ended = wait(running, patience, return_when=FIRST_COMPLETED).done
        done = workers.steps()  # asked once, since pieces go on meanwhile
        if on_steps is not None and done > told:
            on_steps(done - told)
            told = done
        for future in ended:
            number = running.pop(future)
            try:
                result = workers.result(future)
            except WorkerLostError as error:
                losses[number] += 1
                if losses[number] == workers.attempts:
                    raise WorkerLostError(f"piece {number + 1} of {len(pieces)}: {error}") from error
                waiting.appendleft(number)
            else:
                keep(number, result)


def is_cluster(executor: str) -> bool:
    """Return whether an executor is the address of a cluster."""
    return executor not in ("process", "thread")


def check_executor(executor: str, name: str = "executor") -> None:
    """Raise ``InvalidInputError`` that names ``name`` if an executor is none of ``EXECUTORS``."""
    if not is_cluster(executor):
        return
    try:
        address = urlsplit(executor)
        sound = address.scheme == "dask" and bool(address.hostname) and bool(address.port)
        sound = sound and executor == f"dask://{address.netloc}" and "@" not in address.netloc
    except ValueError:  # a port that is no number, or brackets that do not close
        sound = False
    if not sound:
        raise InvalidInputError(f"{name}: {executor!r}; expected {EXECUTORS}")


def _open(executor: str, jobs: int) -> Workers:
    if executor == "thread":
        return _Threads(jobs)
    if executor == "process":
        from atg_fg.experiments.executors.processes import WorkerProcesses

        return WorkerProcesses(jobs)
    from atg_fg.experiments.executors.dask_cluster import Cluster

    return Cluster(executor)


class _Threads:
    """Threads of this process. They do not die alone, and Python lets one of them run at a time."""

    attempts = 1

    def __init__(self, slots: int) -> None:
        self.slots = slots
        self._stop = threading.Event()
        self._steps: list[None] = []  # to append is one operation, whatever other threads do
        self._pool = ThreadPoolExecutor(slots, initializer=self._begin_thread)

    def _begin_thread(self) -> None:
        piece_here.stop = self._stop
        tell_steps_to(lambda: self._steps.append(None))

    def submit(self, function: Callable[[Any], Any], piece: Any) -> Future[Any]:
        return self._pool.submit(function, piece)

    def result(self, future: Future[Any]) -> Any:
        return future.result()

    def steps(self) -> int:
        return len(self._steps)

    def close(self) -> None:
        self._stop.set()
        self._pool.shutdown(cancel_futures=True)
