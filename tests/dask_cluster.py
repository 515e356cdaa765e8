"""A real dask scheduler with workers, begun by the commands that the documentation gives."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[1]


def begin(*arguments):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-m", "distributed.cli." + arguments[0], *map(str, arguments[1:])],
        env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip


@contextmanager
def scheduler(folder):
    """Begin a scheduler; give its process and its address."""
    file = Path(folder) / "scheduler.json"
    # Both leave by themselves if the tests are killed.
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--idle-timeout", "10 minutes"]
    process = begin("dask_scheduler", *options, "--scheduler-file", file)
    try:
        yield process, wait_for(lambda: address_in(file))
    finally:
        process.kill()
        process.wait()


def address_in(file):
    try:
        return json.loads(file.read_text())["address"].replace("tcp://", "dask://")
    except (OSError, ValueError):
        return None


@contextmanager
def workers(address, folder, number=2, *, threads=False):
    """Begin worker processes, each watched over by a nanny that begins it anew when it dies; or threads of one."""
    options = ["--nworkers", number, "--nthreads", "1"] if not threads else ["--no-nanny", "--nthreads", number]
    options += ["--no-dashboard", "--local-directory", folder, "--death-timeout", "60"]
    process = begin("dask_worker", address.replace("dask://", "tcp://"), *options)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def wait_for_workers(address, number):
    """Wait until a scheduler has so many workers."""
    import distributed

    with distributed.Client(address.replace("dask://", "tcp://"), set_as_default=False) as client:
        client.wait_for_workers(number, timeout=60)


def wait_for(condition, seconds=60):
    """Wait until a condition holds and return what it gives."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.02)
    raise TimeoutError(f"{condition} did not come to hold in {seconds} s")
