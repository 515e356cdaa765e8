"""How long does a trial of the preset ``learned`` take once it knows 100 objects? Beside the preset ``default``.

Run with ``python benchmarks/sampled_trials.py [TRIALS]``. Cubes with 10 % wrong looks and 10 % of symbols missing, 10
actions by the entropy policy, seed 0: each trial with all that is learned from it. Medians over the 25 trials up to
each number. ``python benchmarks/sampled_trials.py sweep`` tells how long one sweep takes compiled, and with the
environment variable ``NUMBA_DISABLE_JIT=1``, how long in plain Python. Seconds are of the processor.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.core.records import TrialRecord
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.learning.chain import Chain
from atg_fg.learning.detector_noise import DetectorNoise
from atg_fg.learning.raw_trials import Recording
from atg_fg.learning.sampling_task import Structure, Task
from atg_fg.storage.presets import preset

NOISE = {"wrong": 0.1, "missing": 0.1}
WINDOW = 25
ENGINES = {"default": "bayes-filter", "learned": "learned-structure"}


def seconds_a_trial(name: str, n_trials: int) -> tuple[list[float], list[int]]:
    """Return how long each trial took, and how many objects the robot knew when it began."""
    taken: list[float] = []
    known: list[int] = []
    last = time.process_time()

    def on_trial(number: int, record: TrialRecord) -> None:
        nonlocal last
        now = time.process_time()
        taken.append(now - last)
        known.append(len(record.names))
        last = now

    plan = TestPlan(engine=ENGINES[name], parameters=preset(name), n_trials=n_trials, world_options=NOISE)
    run_test(plan, 0, on_trial=on_trial)
    return taken, known


def seconds_a_sweep(n_trials: int = 12, n_sweeps: int = 20) -> float:
    """Return the median time of one sweep over trials of a detector takes, successors of the automaton included."""
    rng = np.random.default_rng(0)
    labels, actions = rng.integers(8, size=(n_trials, 9, 1)), rng.integers(2, size=(n_trials, 9))
    recording = Recording(labels, np.full(labels.shape, np.nan), actions, np.full(n_trials, 9), 8)
    task = Task.of(recording, DetectorNoise.unknown(8), 8)
    automaton = Structure(rng.integers(8, size=(2, 8)), np.arange(8)[:, None], 8)
    chain = Chain(automaton, 0.0, 8)
    chain.admit(task)
    chain.scatter(rng)
    chain.sweep(task, rng, automaton=True)
    taken = []
    for _ in range(n_sweeps):
        begin = time.process_time()
        chain.sweep(task, rng, automaton=True)
        taken.append(time.process_time() - begin)
    return float(np.median(taken))


def main() -> None:
    """Print the table."""
    if sys.argv[1:] == ["sweep"]:
        print(f"{1000 * seconds_a_sweep():.2f} ms a sweep of 12 trials")
        return
    n_trials = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    run_test(TestPlan(engine=ENGINES["learned"], parameters=preset("learned"), n_trials=12, world_options=NOISE), 1)
    table = Table(title="processor seconds a trial, learning included (median)", title_justify="left")
    headings = ("trials", *(f"{name}: {what}" for name in ENGINES for what in ("objects", "s")), "ratio")
    for heading in headings:
        table.add_column(heading, justify="right")
    found = {name: seconds_a_trial(name, n_trials) for name in ENGINES}
    for end in range(WINDOW, n_trials + 1, 3 * WINDOW):
        medians = {name: float(np.median(taken[end - WINDOW : end])) for name, (taken, _) in found.items()}
        cells = [cell for name in ENGINES for cell in (str(found[name][1][end - 1]), f"{medians[name]:.3f}")]
        table.add_row(str(end), *cells, f"{medians['learned'] / medians['default']:.1f}")
    Console(highlight=False, width=120).print(table)


if __name__ == "__main__":
    main()
