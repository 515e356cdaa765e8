"""How often is a recording of one's own detector recognised rightly, told nothing but how many objects there are?

Run with ``python benchmarks/own_recordings.py [SEEDS] [FIRST] [FILE ...]``: of recordings FILE, with the truth in their
column ``object``; or else of SEEDS recordings simulated in world ``detector``, from seed FIRST (0) on, at each of three
levels of noise: 8 objects, 48 trials of 8 random actions, a confidence with each label. Each goes the way of
``atg-fg recognise FILE --learn --objects 8``: through a file, into a memory that is empty at first. Verdicts *given*
are by what was learned until then, *mended* ones are what the memory holds in the end. 95 % Wilson intervals over
trials.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from atg_fg.core.memory import RobotMemory
from atg_fg.core.recordings import Recording
from atg_fg.core.statistics import wilson_interval
from atg_fg.experiments.recorded_trials import recognise
from atg_fg.experiments.scores import Score
from atg_fg.experiments.simulated_recording import simulated_recording
from atg_fg.learning.structured_memory import memory_for
from atg_fg.storage.presets import preset
from atg_fg.storage.recordings import read_recording, write_recording

N_OBJECTS, N_TRIALS, N_ACTIONS = 8, 48, 8
LEVELS = ((0.0, 0.0), (0.05, 0.05), (0.2, 0.1))


class Count(NamedTuple):
    """What came of a recording."""

    trials: int
    given: int
    mended: int
    graphs: int
    looks: int
    seconds: float


def counted(recording: Recording) -> Count:
    """Return what comes of a recording, learned trial by trial in processor time."""
    parameters = preset("learned")
    memory = memory_for(parameters, RobotMemory(recording.assumptions(recording.n_objects or N_OBJECTS)))
    scores, start = Score({}), time.process_time()
    recognise(recording, memory, "learned-structure", parameters, learn=True, scores=scores)
    seconds, looks = time.process_time() - start, sum(len(trial.looks) for trial in recording.trials)
    mended = scores.successes if scores.mended is None else scores.mended
    return Count(scores.n_trials, scores.successes, mended, len(memory), looks, seconds)


def simulated(seed: int, wrong: float, missing: float) -> Recording:
    """Return a recording as it is read from a file."""
    made = simulated_recording(
        "detector", N_OBJECTS, N_TRIALS, N_ACTIONS, seed, wrong=wrong, missing=missing, confidences=True
    )
    with tempfile.TemporaryDirectory() as folder:
        write_recording(made, Path(folder) / "looks.csv")
        return read_recording(Path(folder) / "looks.csv")


def main() -> None:
    """Print the table."""
    numbers = [int(argument) for argument in sys.argv[1:3] if argument.isdecimal()]
    files = sys.argv[1 + len(numbers) :]
    n_seeds, first = [*numbers, *(2, 0)[len(numbers) :]]
    table = Table(title="Recordings learned trial by trial, preset learned", title_justify="left")
    for heading in ("recording", "trials", "given, %", "mended, %", "ATGs", "looks a second"):
        table.add_column(heading, justify="left" if heading == "recording" else "right")
    for file in files:
        _add(table, Path(file).stem, [counted(read_recording(file))])
    for wrong, missing in () if files else LEVELS:
        counts = [counted(simulated(seed, wrong, missing)) for seed in range(first, first + n_seeds)]
        _add(table, f"{wrong:.0%} wrong, {missing:.0%} missing, seeds {first}-{first + n_seeds - 1}", counts)
    Console(highlight=False, width=120).print(table)


def _add(table: Table, name: str, counts: list[Count]) -> None:
    n_trials = sum(count.trials for count in counts)
    table.add_row(
        name,
        str(n_trials),
        _share(sum(count.given for count in counts), n_trials),
        _share(sum(count.mended for count in counts), n_trials),
        f"{sum(count.graphs for count in counts) / len(counts):.1f}",
        f"{sum(count.looks for count in counts) / sum(count.seconds for count in counts):.1f}",
    )


def _share(hits: int, of: int) -> str:
    low, high = wilson_interval(hits, of)
    return f"{hits}: {100 * hits / of:.1f} ({100 * low:.1f}-{100 * high:.1f})"


if __name__ == "__main__":
    main()
