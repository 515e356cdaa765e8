"""Processes that tests begin: who has begun whom, whether all have gone, and Ctrl-C that a program answers itself."""

import os
import signal
from contextlib import contextmanager
from pathlib import Path


def nobody_left(group):
    """Whether all processes of a group have gone."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


def children_of(process):
    """The ids of the processes that a process has begun (Linux)."""
    return list(map(int, Path(f"/proc/{process}/task/{process}/children").read_text().split()))


def descendants(process):
    """The ids of the processes that a process has begun, and those that these have; none of one that has ended."""
    try:
        children = children_of(process)
    except OSError:
        return []
    return [*children, *(each for child in children for each in descendants(child))]


@contextmanager
def interruptions_noted():
    """Let Ctrl-C do nothing but be noted in the list that is given."""
    met = []
    handler = signal.signal(signal.SIGINT, lambda *_: met.append(1))
    try:
        yield met
    finally:
        signal.signal(signal.SIGINT, handler)
