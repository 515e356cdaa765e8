"""What a piece of work and whoever runs it say to each other while it runs: that a step is done, that it shall stop."""

from __future__ import annotations

import threading
from collections.abc import Callable

#: What the piece that runs in this thread has to tell, and to obey.
piece_here = threading.local()


def step_done() -> None:
    """Tell that a piece has done a step of its work, such as a trial; long pieces call this after each.

    Raises:
        SystemExit: Nobody waits for the piece any more. A process is ended from outside, but a thread has to leave by
            itself.
    """
    stop: threading.Event | None = getattr(piece_here, "stop", None)
    if stop is not None and stop.is_set():
        raise SystemExit
    tell: Callable[[], None] | None = getattr(piece_here, "tell", None)
    if tell is not None:
        tell()


def tell_steps_to(tell: Callable[[], None] | None) -> None:
    """Let ``step_done`` call a function wherever it is called in this thread."""
    piece_here.tell = tell
