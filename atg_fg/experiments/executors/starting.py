"""How processes are begun: with one thread for linear algebra, and deaf to Ctrl-C."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

#: What libraries of linear algebra read when they are loaded. There is a process for each processor already, so threads
#: of theirs would only take turns; and a sum must not depend on how many there are.
ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)


@contextmanager
def start_of_process() -> Iterator[None]:
    """Let processes that are begun in a ``with`` block have one thread for linear algebra, and ignore Ctrl-C.

    Both are inherited, and so hold from the first moment; what the user has set in the environment stays. A terminal
    sends Ctrl-C to all processes, but only this one shall answer, and not before the block has ended: a process that
    was told only a half of what it is to do would complain.
    """
    added = {name: value for name, value in ONE_THREAD.items() if name not in os.environ}
    os.environ.update(added)
    blockable = hasattr(signal, "pthread_sigmask")  # not on Windows
    with answered_later():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if blockable else None
        try:
            yield
        finally:
            for name in added:
                del os.environ[name]
            if before is not None:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def answered_later(at_once: Callable[[], None] | None = None) -> Iterator[None]:
    """Answer Ctrl-C after the block, in which it only calls ``at_once``.

    To block the signal is not enough: then another thread takes it, and Python answers it in this one all the same.
    """
    answer = signal.getsignal(signal.SIGINT)
    if not callable(answer) or threading.current_thread() is not threading.main_thread():
        yield  # nobody answers, or another thread does
        return
    met: list[int] = []

    def note(number: int, _: FrameType | None) -> None:
        met.append(number)
        if at_once is not None:
            at_once()

    signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, answer)
        if met:
            signal.raise_signal(signal.SIGINT)
