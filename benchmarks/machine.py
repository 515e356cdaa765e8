"""What is measured on: processor, software, and how fast this processor reads numbers and takes logarithms."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.measuring import Clock, Sample, alternate, spread

PACKAGES: Final = ("atg-fg", "numpy", "gtsam", "jax", "inferactively-pymdp", "pyAgrum", "pgmpy")
#: Variables that say how many threads libraries may use.
THREADS: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XLA_FLAGS")
#: Arrays smaller than this would measure what a call of NumPy costs.
LEAST_BYTES: Final = 1 << 16
#: As many numbers as a core's cache holds; logarithms cost the same beyond.
N_LOGARITHMS: Final = 1 << 15


def description() -> dict[str, Any]:
    """Return processor, cores, their load, Python, packages and limits on threads; nothing that names the machine.

    ``load`` is how many processes wanted to run in the last minute: where it exceeds the cores, times say little.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "processor": processor(),
        "cores": cores,
        "load": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": {name: installed_version(name) for name in PACKAGES},
        "threads": {name: os.environ[name] for name in THREADS if name in os.environ},
    }


def processor() -> str:
    """Return the processor's model, or what the system calls it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine()


def installed_version(package: str) -> str | None:
    """Return the version of an installed package, ``None`` if it is not there."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def rates(n_bytes: int, n_rounds: int, clock: Clock) -> dict[str, dict[str, Any]]:
    """Return bytes read and logarithms taken a second, by one core in NumPy.

    Args:
        n_bytes: What is read in one go: what fits a cache is read faster than what does not.
        n_rounds: Number of rounds.
        clock: Tells the time.
    """
    numbers = np.ones(max(n_bytes, LEAST_BYTES) // 8)
    positive = np.linspace(1e-6, 1.0, N_LOGARITHMS)
    out = np.empty_like(positive)
    works: dict[str, tuple[Callable[[], object], int]] = {
        "bytes": (numbers.sum, numbers.nbytes),
        "logarithms": (lambda: np.log(positive, out=out), N_LOGARITHMS),
    }

    def seconds_of(work: Callable[[], object]) -> Callable[[], Sample]:
        def sample() -> Sample:
            work()  # brings the array into the caches that can hold it
            start = clock()
            for _ in range(3):
                work()
            return {"seconds": (clock() - start) / 3}

        return sample

    taken = alternate({name: seconds_of(work) for name, (work, _) in works.items()}, max(n_rounds, 5))
    return {name: spread([works[name][1] / each for each in taken[name]["seconds"]]) for name in works}
