"""A disk that is full, at many points of a write, and a folder that cannot be written: the old state stays.

Root, for whom no folder is read-only, gets a file system
of its own in a mount namespace of its own (``unshare --mount``): a tmpfs of 8 MiB that is filled up, and mounted anew
read-only. Others, and root where mounting is not allowed, get a limit to the size of files (``RLIMIT_FSIZE``), and a
folder without the right to write, as the user *nobody* if they are root.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import AtgError
from atg_fg.core.memory import RobotMemory
from atg_fg.storage import memory_files, memory_json
from atg_fg.storage.database.checking import faults_of_database
from atg_fg.storage.memory_files import open_memory
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern
from tests.torture.commands import COMMANDS, command_outcomes

SIZE = 2**23
MOUNTED = "tmpfs of 8 MiB in a mount namespace"
LIMITED = "RLIMIT_FSIZE, and a folder without the right to write"
_NOBODY = 65534
#: Bytes that are left on the disk when a write begins: none, a page, … more than it needs.
LEFT = (0, 4096, 8192, 16384, 32768, 65536, 98304, 131072, 196608, 262144, 393216)


def main() -> None:
    """Run all scenarios in a folder and print what came of them; arguments mounted|limited FOLDER POINTS COMMANDS."""
    way, folder, n_points, n_commands = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    if way == "limited" and os.geteuid() == 0:
        os.setgroups([])
        os.setgid(_NOBODY)
        os.setuid(_NOBODY)
    json.dump(outcomes(folder, n_points, n_commands, mounted=way == "mounted"), sys.stdout)


def run_scenarios(n_points: int = len(LEFT), n_commands: int = len(COMMANDS), *, mount: bool = True) -> dict[str, Any]:
    """Run all scenarios in another process; return the way it was done and how many came out well or not.

    Args:
        n_points: At how many points of a write the disk is full.
        n_commands: How many of the commands that write are run on it.
        mount: Try to mount a file system.
    """
    with tempfile.TemporaryDirectory() as folder:
        return _run_scenarios(folder, [str(n_points), str(n_commands)], try_to_mount=mount)


def _run_scenarios(folder: str, numbers: list[str], *, try_to_mount: bool) -> dict[str, Any]:
    command = [sys.executable, "-m", "tests.torture.disk"]
    mount = f"mount -t tmpfs -o size={SIZE} tmpfs '{folder}'"
    if try_to_mount and os.geteuid() == 0 and shutil.which("unshare") and shutil.which("mount"):
        script = f'{mount} && exec "$@"'
        inside = ["unshare", "--mount", "sh", "-c", script, "sh", *command, "mounted", folder, *numbers]
        done = subprocess.run(inside, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            return {"way": MOUNTED, **json.loads(done.stdout)}
    os.chmod(folder, 0o777)
    done = subprocess.run([*command, "limited", folder, *numbers], capture_output=True, text=True, check=True)
    return {"way": LIMITED, **json.loads(done.stdout)}


def outcomes(folder: Path, n_points: int, n_commands: int, *, mounted: bool) -> dict[str, Any]:
    """Return how many scenarios of each kind came out well, and what went wrong in the others."""
    disk = Mounted(folder) if mounted else Limited(folder)
    well: Counter[str] = Counter()
    faults: list[str] = []
    for number, left in enumerate(LEFT[:n_points]):
        for name, scenario in (("full, database", full_database), ("full, JSON", full_json)):
            place = disk.folder / f"{name[6]}{number}"
            place.mkdir()
            fault = scenario(place, disk, left)
            well[name] += fault is None
            faults += [] if fault is None else [f"{name}, {left} bytes left: {fault}"]
            shutil.rmtree(place)
    for name, fault in command_outcomes(disk, n_points, n_commands):
        well[f"full, atg-fg {name}"] += fault is None
        faults += [] if fault is None else [f"full, {fault}"]
    for name, write in READ_ONLY.items():
        fault = read_only(disk, write)
        well[f"read-only, {name}"] += fault is None
        faults += [] if fault is None else [f"read-only, {name}: {fault}"]
    return {"well": dict(well), "faults": faults}


class Mounted:
    """A small file system, filled up by a file, and mounted anew to be read only."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @contextmanager
    def full(self, left: int) -> Iterator[None]:
        ballast = self.folder / "ballast"
        free = os.statvfs(self.folder).f_bavail * os.statvfs(self.folder).f_bsize
        ballast.write_bytes(bytes(max(free - left, 0)))
        try:
            yield
        finally:
            ballast.unlink()

    @contextmanager
    def closed(self, folder: Path) -> Iterator[None]:
        subprocess.run(["mount", "-o", "remount,ro", str(self.folder)], check=True)
        try:
            yield
        finally:
            subprocess.run(["mount", "-o", "remount,rw", str(self.folder)], check=True)


class Limited:
    """A limit to the size of each file, and a folder that is closed to this user."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @contextmanager
    def full(self, left: int) -> Iterator[None]:
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (left, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    @contextmanager
    def closed(self, folder: Path) -> Iterator[None]:
        folder.chmod(0o555)
        try:
            yield
        finally:
            folder.chmod(0o755)


def learn(memory: RobotMemory, number: int) -> None:
    """Learn all of a cube that there is to see."""
    (cube,) = make_arcubes(1, seed=number)
    alphabet, here, actions = memory.assumptions.alphabet, 0, [0, 1, 1, 2, 0, 2, 1, 0] * 3
    patterns: list[int | None] = [alphabet.index(shown_pattern(cube, here))]
    for action in actions:
        here = SUCCESSORS[here][action]
        patterns.append(alphabet.index(shown_pattern(cube, here)))
    memory.learn(patterns, actions, None)


def full_database(place: Path, disk: Mounted | Limited, left: int) -> str | None:
    """Learn until the disk is full; the last good state stays, and learning goes on when there is room."""
    file = place / "robot.db"
    with open_memory(file, arcube_assumptions()) as memory:
        learn(memory, 0)
        failed = False
        with disk.full(left):
            for number in range(1, 300):
                before = memory_json.memory_to_json(memory)
                try:
                    learn(memory, number)
                except AtgError as error:
                    failed = True
                    if "cannot be written" not in str(error):
                        return f"error {error}"
                    break
            if failed and memory_json.memory_to_json(memory) != before:
                return "the memory is not as it was before the trial that failed"
        if not failed:
            return "the disk was never full"
        if memory_json.memory_to_json(memory_files.load_memory(file)) != before:
            return "the file is not as it was before the trial that failed"
        learn(memory, 400)
        after = memory_json.memory_to_json(memory)
    faults = faults_of_database(file)
    if faults or memory_json.memory_to_json(memory_files.load_memory(file)) != after:
        return f"after there was room again: {faults}"
    return None


def full_json(place: Path, disk: Mounted | Limited, left: int) -> str | None:
    """Save a memory that is larger than what is left; the old file stays as it was, and no other is left behind."""
    file = place / "memory.json"
    memory = RobotMemory(arcube_assumptions())
    learn(memory, 0)
    memory_files.save_memory(memory, file)
    before = file.read_bytes()
    while len(memory_json.memory_to_json(memory)) <= left + 65536:
        learn(memory, len(memory))
    with disk.full(left):
        try:
            memory_files.save_memory(memory, file)
        except AtgError as error:
            if "cannot be written" not in str(error):
                return f"error {error}"
        else:
            return "the disk was never full"
        if file.read_bytes() != before or [each.name for each in place.iterdir()] != [file.name]:
            return "the folder is not as it was"
    return None


def _learn_in_place(place: Path) -> None:
    with open_memory(place / "robot.db") as memory:
        learn(memory, 1)


def _make_database(place: Path) -> None:
    open_memory(place / "new.db", arcube_assumptions()).close()


def _save_over_database(place: Path) -> None:
    memory_files.save_memory(RobotMemory(arcube_assumptions()), place / "robot.db")


def _save_json(place: Path) -> None:
    memory_files.save_memory(RobotMemory(arcube_assumptions()), place / "memory.json")


READ_ONLY: dict[str, Callable[[Path], None]] = {
    "learn in place": _learn_in_place,
    "a new database": _make_database,
    "save over a database": _save_over_database,
    "save over JSON": _save_json,
}


def read_only(disk: Mounted | Limited, write: Callable[[Path], None]) -> str | None:
    """Write in a folder that cannot be written; its files can be read before and after, and are as they were."""
    place = disk.folder / "closed"
    place.mkdir()
    memory = RobotMemory(arcube_assumptions())
    learn(memory, 0)
    for name in ("robot.db", "memory.json"):
        memory_files.save_memory(memory, place / name)
    before = {each.name: each.read_bytes() for each in place.iterdir()}
    fault = None
    with disk.closed(place):
        try:
            write(place)
            fault = "was written"
        except AtgError as error:
            if not any(word in str(error) for word in ("cannot be written", "cannot be opened")):
                fault = f"error {error}"
        for name in ("robot.db", "memory.json"):
            if memory_files.load_memory(place / name) != memory:
                fault = f"{name} is read as another memory"
        if {each.name: each.read_bytes() for each in place.iterdir()} != before:
            fault = "the folder is not as it was"
    shutil.rmtree(place)
    return fault


if __name__ == "__main__":
    main()
