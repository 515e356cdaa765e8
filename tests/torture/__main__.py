"""``make torture``: all of the torture, and its figures."""

from __future__ import annotations

import signal

# Ctrl-C ends all of it, children too, at once and without a word.
signal.signal(signal.SIGINT, signal.SIG_DFL)

import argparse
import os
import re
import sys
from collections import Counter
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

from atg_fg.core.statistics import wilson_interval
from tests.torture.commands import COMMANDS
from tests.torture.disk import LEFT, run_scenarios
from tests.torture.fuzz import fuzz
from tests.torture.kills import KINDS, kill_writers
from tests.torture.power import cut_power
from tests.torture.reading import MAX_BYTES, MAX_SECONDS, read_damaged


def main(arguments: Sequence[str]) -> int:
    """Run what was asked for, print the figures, and return 1 if anything went wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.torture", description=__doc__)
    parser.add_argument("--kills", type=int, default=1000, help="writers that are killed")
    parser.add_argument("--cuts", type=int, default=12, help="trials that are written while the power may be cut")
    parser.add_argument("--files", type=int, default=50000, help="damaged files that are read")
    parser.add_argument("--fuzz", type=int, default=3600, help="seconds of fuzzing")
    parser.add_argument("--points", type=int, default=len(LEFT), help="points at which the disk is full")
    parser.add_argument("--commands", type=int, default=len(COMMANDS), help="commands that write when it is")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)), help="processes that read files")
    given = parser.parse_args(arguments)
    faults: list[str] = []
    if given.kills:
        faults += _tell_kills(given.kills, given.seed)
    if given.cuts:
        faults += _tell_cuts(cut_power(given.cuts, given.seed))
    if given.points:
        faults += _tell_disk(run_scenarios(given.points, given.commands))
    if given.files:
        faults += _tell_files(read_damaged(given.files, given.seed, given.jobs))
    if given.fuzz:
        faults += _tell_fuzzing(given.fuzz, given.seed)
    for fault in faults:
        print(fault)
    print(f"{len(faults)} faults, seed {given.seed}")
    return 1 if faults else 0


def _tell_kills(n_kills: int, seed: int) -> list[str]:
    outcomes, faults = kill_writers(n_kills, seed)
    good = sum(outcomes[kind] for kind in KINDS)
    print(f"kill -9 while trials are written: {_rate(good, n_kills)} files with all that was said to be written")
    for kind in KINDS:
        amid = f"{kind}: in the middle of a trial"
        there = outcomes[f"{amid}, which was there"]
        print(f"  {kind}: {outcomes[kind]} well; {outcomes[amid]} in the middle of a trial, {there} of these had it")
    return faults


def _tell_cuts(result: dict[str, Any]) -> list[str]:
    faults: list[str] = result["faults"]
    total = sum(result["disks"].values())
    print(f"power cuts: {_rate(total - len(faults), total)} disks left with all trials that were said to be kept")
    for kind, number in result["disks"].items():
        print(f"  {kind}: {number} disks")
    return faults


def _tell_fuzzing(seconds: int, seed: int) -> list[str]:
    if find_spec("atheris") is None:
        print("fuzzing: left out, as atheris is not installed (pip install --group torture)")
        return []
    result = fuzz(seconds, seed)
    print(result["line"])
    faults: list[str] = result["faults"]
    return faults


def _tell_disk(result: dict[str, Any]) -> list[str]:
    print(f"full disk and read-only folder ({result['way']}): the old state, and this project's error")
    for name, number in result["well"].items():
        print(f"  {name}: {number} well")
    faults: list[str] = result["faults"]
    return faults


def _tell_files(result: dict[str, Any]) -> list[str]:
    files: Counter[str] = result["files"]
    total, faults = files.total(), result["faults"]
    print(f"damaged files: {_rate(total - len(faults), total)} read, or refused with an error of this project")
    for kind, number in sorted(files.items()):
        print(f"  {kind}: {number} files, {result['read'][kind]} of them could be read all the same")
    seconds, mebibytes = result["seconds"], result["bytes"] / 2**20
    limits = f"at most {MAX_SECONDS:g} s and {MAX_BYTES / 2**20:.0f} MiB are allowed"
    print(f"  the slowest took {seconds:.2f} s of processor time, the largest {mebibytes:.1f} MiB more RAM; {limits}")
    hangs = sum(fault.endswith(f"status {-signal.SIGPROF}") for fault in faults)
    crashes = sum(fault.startswith("process ") for fault in faults) - hangs
    passed = sum(re.search(r"\): [0-9.]+ (s|MiB)$", fault) is not None for fault in faults)
    tracebacks = len(faults) - hangs - crashes - passed
    print(f"  crashes {crashes}, hangs {hangs}, tracebacks {tracebacks}, limits passed {passed}")
    return faults


def _rate(good: int, total: int) -> str:
    low, high = wilson_interval(good, total)
    return f"{good} of {total} ({100 * low:.2f}-{100 * high:.2f} %)"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
