"""Coverage-guided fuzzing of all readers with atheris: ``python -m tests.torture.fuzz --seconds 3600``.

An input is a byte that says the kind of the file, and what is in it. What files of that kind are packed in (gzip
members, an archive) is put around it, so that the readers behind it are reached. An input that leads to anything but an
error of this project is kept in a folder and named. ``--keep`` adds what reached new code to the corpus that is begun
with (``tests/torture/corpus``).
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from tests.torture.originals import packed

CORPUS = Path(__file__).parent / "corpus"
#: Kinds in the order of the byte that says them; a new one is put at the end, as the corpus tells them by number.
KINDS = (
    *("memory", "structured memory", "compact memory", "script", "UAI model", "UAI evidence", "database", "test log"),
    *("trial record", "goal run", "result", "ablation log", "preset", "counts", "tags", "calibration", "URDF"),
    *("recorded table", "recorded lines", "recording spec", "bag topics", "MCAP bag", "SQLite bag", "bag of ROS 1"),
    *("mapping",),
)
#: Longer inputs are not made.
_MAX_BYTES = 20_000
#: Bytes that the corpus in the repository may have.
_MOST_KEPT = 250_000
#: What one input may take: seconds of the clock, beside other work, and MiB of RAM of the whole process.
_SECONDS, _MEBIBYTES = 60, 2048


#: Kinds whose lines are packed each by itself.
_PACKED = ("test log", "goal run")


def as_file(data: bytes) -> tuple[str, bytes]:
    """Return kind and content of the file that an input stands for."""
    kind, content = KINDS[data[0] % len(KINDS)], data[1:]
    return kind, packed(content.split(b"\n")) if kind in _PACKED else content


def main() -> int:
    """Fuzz for some time, print what came of it, and return 1 if a fault was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.torture.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=int, default=3600)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="add what reached new code to the corpus in the repository")
    given = parser.parse_args()
    result = fuzz(given.seconds, given.seed, keep=given.keep)
    print(result["line"])
    for fault in result["faults"]:
        print(fault)
    return 1 if result["faults"] else 0


def fuzz(seconds: int, seed: int, *, keep: bool = False) -> dict[str, Any]:
    """Fuzz for so many seconds in other processes, one after the other where one dies; return what came of it."""
    begun, n_runs, covered, faults = time.monotonic(), 0, 0, []
    with tempfile.TemporaryDirectory() as folder:
        grown, found = Path(folder) / "grown", Path(folder) / "found"
        grown.mkdir()
        found.mkdir()
        while (left := int(seconds - (time.monotonic() - begun))) > 0 and len(faults) < 10:
            options = [f"-max_total_time={left}", f"-seed={seed + len(faults)}", f"-artifact_prefix={found}/"]
            options += [f"-max_len={_MAX_BYTES}", f"-timeout={_SECONDS}", f"-rss_limit_mb={_MEBIBYTES}"]
            output = _fuzzer(*options, "-print_final_stats=1", str(grown), str(CORPUS))
            n_runs += sum(map(int, re.findall(r"stat::number_of_executed_units: (\d+)", output)))
            covered = max([covered, *map(int, re.findall(r"cov: (\d+)", output))])
            artifacts = [each for each in found.iterdir() if each.stat().st_size]
            if not artifacts:
                if seconds - (time.monotonic() - begun) > _SECONDS:
                    faults.append(f"ended early: {output[-300:]!r}")
                break
            for artifact in artifacts:
                said = re.findall(r"^(?:\w+Error|\w+Exception|ERROR|==\d+==).*$", output, re.MULTILINE)
                kept = Path(tempfile.gettempdir()) / f"fuzz-{artifact.name}"
                artifact.replace(kept)
                faults.append(f"{kept}: {said[0] if said else output[-300:]!r}")
        if keep:
            _keep_smallest(grown)
        n_corpus = sum(1 for _ in grown.iterdir())
    line = (
        f"fuzzing: {n_runs} inputs in {time.monotonic() - begun:.0f} s, {covered} places in the code reached, "
        f"{n_corpus} inputs that reached new ones; {len(faults)} faults"
    )
    return {"line": line, "runs": n_runs, "faults": faults}


def _keep_smallest(grown: Path) -> None:
    """Add what reached new code to the corpus in the repository, the smallest first, as long as that stays small."""
    room = _MOST_KEPT - sum(path.stat().st_size for path in CORPUS.iterdir())
    for path in sorted(grown.iterdir(), key=lambda path: path.stat().st_size):
        room -= path.stat().st_size
        if room < 0:
            return
        (CORPUS / path.name[:16]).write_bytes(path.read_bytes())


def _fuzzer(*options: str) -> str:
    command = [sys.executable, "-m", "tests.torture.fuzz_target", *options]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False, env=_environment())
    return done.stdout + done.stderr


def _environment() -> dict[str, str]:
    return {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


if __name__ == "__main__":
    sys.exit(main())
