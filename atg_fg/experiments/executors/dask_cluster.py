"""A cluster of machines as a place to run pieces of work: a dask scheduler and its workers."""

from __future__ import annotations

import asyncio
import logging
import sys
from collections.abc import Callable
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from typing import Any, Final

from atg_fg.core.errors import InvalidInputError, WorkerLostError, needed_by
from atg_fg.core.version import __version__

#: How long to wait for an answer of the scheduler, and for its first worker, seconds.
PATIENCE: Final = 5


class Cluster:
    """The workers of a dask scheduler.

    If one is lost, the scheduler itself gives what it was at to another, as often as its setting
    ``distributed.scheduler.allowed-failures`` says.

    Args:
        address: ``dask://host:port``.

    Raises:
        InvalidInputError: No scheduler answers, it has no workers, or they have another version of this library.
        MissingDependencyError: dask is not installed.
    """

    attempts = 1
    # The scheduler takes all pieces at once. It hands them out in order, also to workers that join later.
    slots = sys.maxsize

    def __init__(self, address: str) -> None:
        with needed_by(f"executor {address!r}", "dask", "cluster"):
            import distributed
        self._address = address
        self._killed: type[Exception] = distributed.KilledWorker
        url = address.replace("dask://", "tcp://")
        # This is checked first: a client that finds no scheduler does not end cleanly. A thread runs the check, for a
        # notebook has an event loop of its own.
        with ThreadPoolExecutor(1) as pool:
            pool.submit(asyncio.run, _check_scheduler(distributed, address, url)).result()
        self._client = distributed.Client(url, timeout=PATIENCE, set_as_default=False)
        # When the scheduler dies, dask tells of each attempt to find it again; the error here says it once.
        self._log = logging.getLogger("distributed")
        self._level = self._log.level
        self._log.setLevel(logging.CRITICAL)
        try:
            self._check_workers()
            self._executor = self._client.get_executor(pure=False)
        except BaseException:
            self.close()
            raise

    def _check_workers(self) -> None:
        try:
            self._client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError as error:
            raise InvalidInputError(
                f"executor {self._address!r}: has no workers; expected some, each begun with: dask worker HOST:PORT"
            ) from error
        try:
            versions = self._client.run(_version)
        except ImportError as error:
            raise InvalidInputError(
                f"executor {self._address!r}: a worker says: {error}; expected atg-fg installed there as it is here"
            ) from error
        for worker, version in versions.items():
            if version != __version__:
                raise InvalidInputError(
                    f"executor {self._address!r}: worker {worker} has atg-fg {version}; expected {__version__}"
                )

    def submit(self, function: Callable[[Any], Any], piece: Any) -> Future[Any]:
        """Begin a piece."""
        future: Future[Any] = self._executor.submit(function, piece)
        return future

    def result(self, future: Future[Any]) -> Any:
        """Return what came of a piece that has ended, or raise what it raised.

        Raises:
            WorkerLostError: One worker after the other was lost, or the scheduler was.
        """
        try:
            return future.result()
        except self._killed as error:
            raise WorkerLostError(f"{error}") from error
        except CancelledError as error:
            raise WorkerLostError(
                f"executor {self._address!r}: the scheduler is gone; expected it to stay until the end"
            ) from error

    def steps(self) -> int:
        """Return 0: workers elsewhere tell nothing before a piece has ended."""
        return 0

    def close(self) -> None:
        """Leave the cluster. Pieces that have not begun are given up; the results of the others are lost."""
        self._client.close()
        self._log.setLevel(self._level)


async def _check_scheduler(distributed: Any, address: str, url: str) -> None:
    try:
        connection = await distributed.comm.connect(url, timeout=PATIENCE)
    except Exception as error:  # of any kind: whatever listens there is free to answer with nonsense
        raise InvalidInputError(
            f"executor {address!r}: no scheduler answered within {PATIENCE} s; "
            "expected the address that `dask scheduler` printed"
        ) from error
    await connection.close()


def _version() -> str:
    return __version__
