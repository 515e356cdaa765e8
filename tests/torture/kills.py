"""Processes that write trials and are killed at random moments; then the file has every trial they said was written.

Writers are forked from one warm process, so that a kill costs milliseconds. A writer says over a pipe when it begins
and when it has ended each trial. After the kill the file must hold the trials that were said to have ended, or one
more, and exactly what a memory has learned that went through as many trials.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sqlite3
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import AtgError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.records import TrialRecord, TrialSummary
from atg_fg.engines import begin_trial
from atg_fg.experiments.ablation import AblationLog, Cell
from atg_fg.experiments.scores import TestResult
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.structured_memory import StructuredMemory, memory_for
from atg_fg.policies import RandomPolicy
from atg_fg.storage import memory_files, memory_json, plain_files
from atg_fg.storage.checked_json import plain_json
from atg_fg.storage.memory_files import open_memory
from atg_fg.storage.trial_log import TrialLog, to_line
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.registry import make_world

#: Trials until a writer begins with a new file.
N_TRIALS = 40
#: A kill comes at most so many seconds after the fork, or after the first trial was begun.
LONGEST = 0.06
KINDS = ("database", "database with structure", "JSON", "arrays", "log of trials", "log of results")
_SUFFIXES = {"JSON": ".json", "arrays": ".npz", "log of trials": ".jsonl.gz", "log of results": ".jsonl"}
_CELL = Cell("default", "ideal", "ideal", 8)
_PLAIN = ModelParameters()
_LEARNED = ModelParameters(learn_structure=True)


class Course:
    """Trials, and the memory after each of them."""

    def __init__(self, *, structured: bool) -> None:
        self.parameters = _LEARNED if structured else _PLAIN
        memory = self.empty()
        self.records: list[TrialRecord] = []
        self.states = [memory_json.memory_to_json(memory)]
        with closing(make_world("ideal", cubes=make_arcubes(12, seed=0))) as world:
            for number in range(N_TRIALS):
                inference = begin_trial("bayes-filter", RobotMemory(memory.assumptions, memory), _PLAIN)
                record = run_trial(world, inference, RandomPolicy(), 8, np.random.default_rng(number))
                learn_from(record, memory)
                self.records.append(record)
                self.states.append(memory_json.memory_to_json(memory))

    def empty(self) -> RobotMemory:
        return self.prepared(RobotMemory(arcube_assumptions()))

    def prepared(self, memory: RobotMemory) -> RobotMemory:
        """The memory, ready to learn what this course is about."""
        memory = memory_for(self.parameters, memory)
        if isinstance(memory, StructuredMemory):
            # No search: it is the writing that is to be cut off.
            learn = memory.learner.learn
            memory.learner.learn = lambda owner, trial, rests: learn(owner, trial, rests=True)
        return memory


def kill_writers(n_kills: int, seed: int) -> tuple[Counter[str], list[str]]:
    """Return how many kills of each kind of file came out well, under its name, and what went wrong otherwise."""
    rng = random.Random(seed)
    courses = {"database": Course(structured=False), "database with structure": Course(structured=True)}
    courses |= {kind: courses["database"] for kind in KINDS if kind not in courses}
    outcomes: Counter[str] = Counter()
    faults: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        written = dict.fromkeys(KINDS, 0)
        generation = Counter(KINDS)
        for number in range(n_kills):
            kind = KINDS[number % len(KINDS)]
            course, path = courses[kind], _path(folder, kind, generation[kind])
            delay, at_work = rng.uniform(0.0, LONGEST), rng.random() < 0.7
            begun, ended = _run_and_kill(kind, path, course, written[kind], delay, at_work=at_work)
            fault, found = _fault(kind, path, course, written[kind], begun, ended)
            outcomes[kind] += fault is None
            if begun > ended:
                outcomes[f"{kind}: in the middle of a trial"] += 1
                outcomes[f"{kind}: in the middle of a trial, which was there"] += found > ended
            if fault is not None:
                faults.append(f"kill {number} ({kind}, {delay:.4f} s): {fault}")
            written[kind] = found
            if fault is not None or found == N_TRIALS:
                generation[kind] += 1
                written[kind] = 0
        # The next writer in a folder removes what those before it have left.
        plain_files.write_bytes_atomically(Path(folder) / "last", b"")
        faults += [f"{each} was left behind" for each in Path(folder).glob(".atg-fg-*")]
    return outcomes, faults


def _path(folder: str, kind: str, generation: int) -> Path:
    return Path(folder) / f"{kind.replace(' ', '-')}-{generation}{_SUFFIXES.get(kind, '.db')}"


def _run_and_kill(
    kind: str, path: Path, course: Course, written: int, delay: float, *, at_work: bool
) -> tuple[int, int]:
    """Return how many trials the writer had begun and ended, those before it included.

    The delay counts from the fork, or, if ``at_work``, from when the writer begins its first trial.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        status = 1
        try:
            WRITERS[kind](path, course, written, writing)
            status = 0
        finally:
            os._exit(status)
    os.close(writing)
    with open(reading, "rb") as pipe:
        first = pipe.read(1) if at_work else b""
        time.sleep(delay)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        said = Counter((first + pipe.read()).decode())
    return written + said["b"], written + said["e"]


def _write_database(path: Path, course: Course, written: int, pipe: int) -> None:
    with course.prepared(open_memory(path, arcube_assumptions())) as memory:
        memory.begin_experiment("torture", {"trials": N_TRIALS}, seed=0)
        for record in course.records[written:]:
            os.write(pipe, b"b")
            learn_from(record, memory)
            os.write(pipe, b"e")


def _write_whole(path: Path, course: Course, written: int, pipe: int) -> None:
    for state in course.states[written + 1 :]:
        memory = memory_json.memory_from_json(state)
        os.write(pipe, b"b")
        memory_files.save_memory(memory, path)
        os.write(pipe, b"e")


def _write_log(path: Path, course: Course, written: int, pipe: int) -> None:
    log = trial_log(path)
    log.resume()
    for record in course.records[written:]:
        os.write(pipe, b"b")
        log.append(TrialSummary.of(record))
        os.write(pipe, b"e")


def _write_results(path: Path, course: Course, written: int, pipe: int) -> None:
    log = AblationLog(path, N_TRIALS)
    for number in range(written, len(course.records)):
        os.write(pipe, b"b")
        log.add(_CELL, TestResult(number, (1, 2), (2, 3), (1, 3)))
        os.write(pipe, b"e")


def trial_log(path: Path) -> TrialLog:
    """A log of the trials of a course."""
    return TrialLog(path, {"seed": 0}, arcube_assumptions())


#: What is killed, for each kind of file.
WRITERS: dict[str, Callable[[Path, Course, int, int], None]] = {
    "database": _write_database,
    "database with structure": _write_database,
    "JSON": _write_whole,
    "arrays": _write_whole,
    "log of trials": _write_log,
    "log of results": _write_results,
}


def _fault(kind: str, path: Path, course: Course, before: int, begun: int, ended: int) -> tuple[str | None, int]:
    """Return what is wrong with the file, if anything, and how many trials it holds."""
    if not path.exists() or path.stat().st_size == 0:
        return (None if ended == 0 else f"{ended} trials ended, but there is no file"), 0
    try:
        found, n_records = _FOUND.get(kind, found_in_database)(path, course)
    except (AtgError, sqlite3.Error) as error:
        return f"{error}", before
    if found == -1 or n_records != found:
        return f"{n_records} records, and the memory after {found} trials", before
    if found not in (ended, begun):
        return f"{found} trials found, {ended} ended, {begun} begun", before
    return None, found


def _found_whole(path: Path, course: Course) -> tuple[int, int]:
    text = memory_json.memory_to_json(memory_files.load_memory(path))
    found = course.states.index(text) if text in course.states else -1
    return found, found


def found_in_log(path: Path, course: Course) -> tuple[int, int]:
    """Return how many trials of the course a log holds, −1 if others, and how many it holds at all."""
    trials = trial_log(path).resume()
    expected = [to_line(TrialSummary.of(record)) for record in course.records[: len(trials)]]
    same = [to_line(trial) for trial in trials] == json.loads(json.dumps(expected, default=plain_json))
    return (len(trials) if same else -1), len(trials)


def found_in_results(path: Path, course: Course) -> tuple[int, int]:
    """Return how many results a log holds, twice; they are the same in every course."""
    del course
    log = AblationLog(path, N_TRIALS)
    found = sum(log.get(_CELL, number) == TestResult(number, (1, 2), (2, 3), (1, 3)) for number in range(N_TRIALS))
    return found, found


_FOUND = {
    "JSON": _found_whole,
    "arrays": _found_whole,
    "log of trials": found_in_log,
    "log of results": found_in_results,
}


def found_in_database(path: Path, course: Course) -> tuple[int, int]:
    """Return after how many trials the memory is what it is, −1 if after none, and how many records there are."""
    with closing(sqlite3.connect(path)) as connection:
        if connection.execute("SELECT count(*) FROM sqlite_master").fetchone() == (0,):
            return 0, 0  # killed before the tables were made
        if connection.execute("PRAGMA integrity_check").fetchall() != [("ok",)]:
            return -1, 0
        if connection.execute("PRAGMA foreign_key_check").fetchall():
            return -1, 0
    with open_memory(path, arcube_assumptions()) as memory:
        n_records = sum(1 for _ in memory.trials())
        if not isinstance(memory, StructuredMemory) and course.parameters.learn_structure and n_records == 0:
            return 0, 0
        state = memory_json.memory_to_json(memory)
    return (course.states.index(state) if state in course.states else -1), n_records
