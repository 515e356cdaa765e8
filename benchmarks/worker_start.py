"""How long users wait for two worker processes: those of a command, and those of campaigns in one Python process."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from typing import Any, Final

from benchmarks.measuring import Clock, Sample, alternate, spread

#: Processes that are begun.
N_WORKERS: Final = 2
#: A command in which each has one trial.
COMMAND: Final = f"table1 --engine bayes-filter --tests {N_WORKERS} --trials 1 --json -".split()
#: Two campaigns of the same trials, the second of which finds the server of the first. It prints the seconds of each.
CAMPAIGNS: Final = f"""
import json, time
from atg_fg.experiments.table1 import TestPlan, run_tests

def seconds():
    start = time.perf_counter()
    run_tests([(TestPlan(engine="bayes-filter", n_trials=1), seed) for seed in range({N_WORKERS})], {N_WORKERS})
    return time.perf_counter() - start

if __name__ == "__main__":
    print(json.dumps({{"first": seconds(), "later": seconds()}}))
"""


def measure(n_rounds: int, clock: Clock) -> dict[str, Any]:
    """Time the start of two worker processes, with a trial of ``bayes-filter`` by each.

    ``command`` is a command from its start to its end, and ``serial`` the same with one job, so without workers;
    ``added`` is the difference of a round. ``first`` and ``later`` are two campaigns of one Python process, which has
    imported the library before, from the call of ``run_tests`` to its results.

    Args:
        n_rounds: How often.
        clock: Tells the time.
    """

    def command(jobs: int) -> Sample:
        start = clock()
        run = [sys.executable, "-c", "from atg_fg_program import main; main()", *COMMAND, "--jobs", str(jobs)]
        subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
        return {"seconds": clock() - start}

    def campaigns() -> Sample:
        done = subprocess.run([sys.executable, "-c", CAMPAIGNS], check=True, capture_output=True, text=True)
        seconds: Sample = json.loads(done.stdout)
        return seconds

    command(1)  # not counted: it may compile
    taken = alternate(
        {"command": partial(command, N_WORKERS), "serial": partial(command, 1), "both": campaigns}, n_rounds
    )
    rounds = {"command": taken["command"]["seconds"], "serial": taken["serial"]["seconds"]}
    rounds["added"] = [own - other for own, other in zip(rounds["command"], rounds["serial"], strict=True)]
    rounds |= taken["both"]
    return {
        "processes": N_WORKERS,
        "rounds": rounds,
        "seconds": {quantity: spread(values) for quantity, values in rounds.items()},
    }
