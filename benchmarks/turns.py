"""One side of a comparison: takes turns as lines of JSON on standard input say, with the library of its environment.

``benchmarks.against`` runs it, also with the library of another revision: it uses what all of them have.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from benchmarks.contestants import EngineContestant, follow, large_memory
from benchmarks.memories import course_for, remembered

#: Those of Figure 3.
POINTS: Final = range(4, 21)


@cache
def _contestant(engine: str, preset: str, n_objects: int) -> tuple[Any, Any]:
    memory = remembered(n_objects)
    is_large = engine == "large-memory"
    contestant = large_memory(preset, memory) if is_large else EngineContestant(engine, preset, memory)
    return contestant, course_for(memory, 10)


def trial(engine: str, preset: str, n_objects: int, repeats: int) -> dict[str, list[float]]:
    """Return the seconds of each quantity of a trial of 10 actions, of each of several trials."""
    samples = [follow(*_contestant(engine, preset, n_objects), time.perf_counter) for _ in range(repeats)]
    return {quantity: [sample[quantity] for sample in samples] for quantity in samples[0]}


def test(engine: str, parameters: str, n_trials: int) -> dict[str, list[float]]:
    """Return the seconds of a test from an empty memory, seed 0."""
    preset = _module("atg_fg.storage.presets", "atg_fg.presets").preset(parameters)
    return _seconds([_tests().TestPlan(engine=engine, n_trials=n_trials, parameters=preset)], 1)


def figure3(n_trials: int, n_tests: int) -> dict[str, list[float]]:
    """Return the seconds of so many tests at each point of Figure 3, by two processes, their start included."""
    plans = [
        _tests().TestPlan(engine="bayes-filter", policy=policy, n_actions=n_actions, n_trials=n_trials)
        for policy in ("entropy", "random")
        for n_actions in reversed(POINTS)  # the longest first, as the command has them
        for _ in range(n_tests)
    ]
    return _seconds(plans, 2)


def _seconds(plans: list[Any], jobs: int) -> dict[str, list[float]]:
    start = time.perf_counter()
    for _ in _tests().run_tests([(plan, 0) for plan in plans], jobs):
        pass
    return {"seconds": [time.perf_counter() - start]}


def _module(*places: str) -> Any:
    """Return the first module that there is: revisions differ in where things are."""
    try:
        return import_module(places[0])
    except ModuleNotFoundError:
        return _module(*places[1:])


def _tests() -> Any:
    return _module("atg_fg.experiments.table1", "atg_fg.experiments")


def peak() -> dict[str, list[float]]:
    """Return the most bytes of memory that this process has held."""
    status = Path("/proc/self/status")
    if status.exists():  # the other way Linux counts what the process that began this one held, too
        (kilobytes,) = (line.split()[1] for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
        return {"bytes": [1024.0 * float(kilobytes)]}
    unit = 1 if sys.platform == "darwin" else 1024
    return {"bytes": [float(unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)]}


TURNS: Final[dict[str, Callable[..., dict[str, list[float]]]]] = {
    "trial": trial,
    "test": test,
    "figure3": figure3,
    "peak": peak,
}

if __name__ == "__main__":
    for line in sys.stdin:
        name, arguments = json.loads(line)
        print(json.dumps(TURNS[name](**arguments)), flush=True)
