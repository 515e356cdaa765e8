"""Pieces of work for tests of executors, in a module that a worker can import quickly."""

import os
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np

from atg_fg.experiments.executors.steps import step_done


def square(number):
    return number * number


def steps(number):
    """Do as many steps."""
    for _ in range(number):
        step_done()
    return number


def slow_steps(piece):
    """Do three steps; after the first, wait until the file is there, or not for ever."""
    (file,) = map(Path, piece)
    step_done()
    end = time.monotonic() + 20
    while not file.exists() and time.monotonic() < end:
        time.sleep(0.01)
    step_done()
    step_done()
    return file.exists()


def begun(folder, number):
    """Note in a file of this piece that it was begun here, and return how often it was until now."""
    with (Path(folder) / f"piece-{number}").open("a+") as file:
        file.write(f"{os.getpid()}\n")
        file.seek(0)
        return len(file.readlines())


def one_dies_once(piece):
    """Piece 1 is killed the first time, while piece 0 is at work; that ends when piece 1 was begun again, or soon."""
    folder, number = piece
    if begun(folder, number) == 1 and number == 1:
        while not times_begun(folder, 0):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGKILL)
    # Not for ever: a scheduler may have put piece 1 into the queue behind this one.
    end = time.monotonic() + 5
    while number == 0 and times_begun(folder, 1) < 2 and time.monotonic() < end:
        time.sleep(0.01)
    return number


def times_begun(folder, number):
    path = Path(folder) / f"piece-{number}"
    return len(path.read_text().splitlines()) if path.exists() else 0


def one_always_dies(piece):
    folder, number = piece
    begun(folder, number)
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)


def refuses_three(number):
    if number == 3:
        raise ValueError("three")
    return number


def waits_for_the_first(piece):
    """Piece 0 ends last."""
    folder, number = piece
    begun(folder, number)
    while number == 0 and not all((Path(folder) / f"piece-{other}").exists() for other in (1, 2, 3)):
        time.sleep(0.01)
    return number


def threads_of_linear_algebra(_number):
    return os.environ.get("OMP_NUM_THREADS"), os.environ.get("MKL_NUM_THREADS")


def thread_and_process(_number):
    time.sleep(0.05)
    return threading.get_ident(), os.getpid()


def threads_of_parent(_number):
    """Return how many threads the process has that forked this one (Linux)."""
    return len(os.listdir(f"/proc/{os.getppid()}/task"))


def parent(_number):
    time.sleep(0.05)
    return os.getppid()


def is_loaded(module):
    return module in sys.modules


def environment(_number):
    return dict(os.environ)


def global_random_numbers(_number):
    time.sleep(0.05)
    return tuple(np.random.random(3))  # noqa: NPY002


def its_server_dies_once(piece):
    """Piece 1 kills the process that forked it, the first time."""
    folder, number = piece
    if begun(folder, number) == 1 and number == 1:
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(60)
    return number
