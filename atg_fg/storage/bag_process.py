"""Bags of ROS are read in a process of its own, whose time, memory and files the size of the bag bounds.

What reads them is a library that unfolds what it is given, in YAML, zstd, LZ4, bzip2 and SQLite: a small bag could fill
memory or disk, or be read for ever.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from atg_fg.core.errors import AtgError, InvalidInputError, MissingDependencyError
from atg_fg.core.recordings import Recording
from atg_fg.storage import rosbag_recordings
from atg_fg.storage.limits import unpacked_limit
from atg_fg.storage.recordings import read_recording, write_recording
from atg_fg.storage.rosbag_recordings import BagTopics

#: Seconds of processor time for any bag, and bytes for each further second: a tenth of what is read in one.
_SECONDS: Final = 20
_BYTES_A_SECOND: Final = 100_000
#: How many times that it may wait for the disk, or for what is no file.
_WAITS: Final = 10
#: Bytes of memory for any bag; besides there are so many times what it may unfold to.
_LEAST_MEMORY: Final = 2**28
_COPIES: Final = 4


def read_bag(path: Path, topics: BagTopics) -> Recording:
    """Return the recording in a bag: a folder of rosbag2, an ``.mcap`` file, or a ``.bag`` of ROS 1.

    Raises:
        InvalidInputError: As for ``rosbag_recordings.read_bag``, or it takes more than its size explains.
        MissingDependencyError: `rosbags` is not installed.
    """
    if find_spec("rosbags") is None:
        raise MissingDependencyError('bags: rosbags is not installed; expected it from: pip install "atg-fg[ros]"')
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with tempfile.TemporaryDirectory(prefix="atg-fg-") as folder:
        read = Path(folder) / "recording.jsonl"
        done = subprocess.run(
            [sys.executable, "-m", "atg_fg.storage.bag_process", str(path), str(read)],
            input=pickle.dumps(topics), capture_output=True, env={**environment, "TMPDIR": folder}, check=False,
        )  # fmt: skip
        said = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        if done.returncode == 2:
            raise InvalidInputError(said)
        if done.returncode in (-signal.SIGKILL, -signal.SIGXCPU, -signal.SIGALRM):
            said = "it takes longer than its size explains"
        if done.returncode:
            raise rosbag_recordings.unreadable(path, RuntimeError(said or f"status {done.returncode}"))
        return replace(read_recording(read), place=str(path))


def _limit(size: int) -> None:
    try:
        import resource
    except ImportError:  # not on Windows
        return
    with open("/proc/self/statm") as file:
        taken = int(file.read().split()[0]) * resource.getpagesize()
    unpacked = unpacked_limit(size)
    seconds = _SECONDS + size // _BYTES_A_SECOND
    for kind, most in (
        (resource.RLIMIT_AS, taken + _LEAST_MEMORY + _COPIES * unpacked),
        (resource.RLIMIT_FSIZE, unpacked),
        (resource.RLIMIT_CPU, seconds),
    ):
        resource.setrlimit(kind, (most, most))
    signal.alarm(_WAITS * seconds)


def _main(path: str, output: str) -> int:
    topics = pickle.load(sys.stdin.buffer)  # of the process that began this one
    with suppress(OSError):  # /proc is Linux's
        _limit(rosbag_recordings.size_of(Path(path)))
    try:
        write_recording(rosbag_recordings.read_bag(Path(path), topics), output)
    except MemoryError as error:
        print(rosbag_recordings.unreadable(Path(path), error), file=sys.stderr)
        return 2
    except AtgError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
