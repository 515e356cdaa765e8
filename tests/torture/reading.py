"""Damaged files are read in other processes: only this project's errors, in bounded time and RAM.

A process that dies did so of the file that it said it was at. A file that takes twenty seconds of processor time
kills it, too.
"""

from __future__ import annotations

import signal

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_DFL)

import atexit
import gc
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import AtgError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.recordings import RecordedLook, Recording
from atg_fg.experiments.ablation import AblationLog, Cell
from atg_fg.experiments.goals import GoalRunFile
from atg_fg.experiments.recorded_trials import recognise
from atg_fg.experiments.replay import replay
from atg_fg.experiments.rescore import rescore
from atg_fg.inference.elimination.queries import log_partition, marginals
from atg_fg.report.page import page
from atg_fg.report.reading import read_report
from atg_fg.senses.tags import TagDetector, Tags
from atg_fg.senses.video import read_image
from atg_fg.storage import memory_files, memory_json, plain_files, rosbag_recordings
from atg_fg.storage.bag_process import read_bag
from atg_fg.storage.camera_files import read_calibration, read_tags
from atg_fg.storage.database.checking import faults_of_database
from atg_fg.storage.database.connection import writing
from atg_fg.storage.database.copying import add_records, records_in_log
from atg_fg.storage.database.repairing import repair_database
from atg_fg.storage.growing_file import read_lines
from atg_fg.storage.memory_files import open_memory
from atg_fg.storage.presets import preset
from atg_fg.storage.recorded_test import recorded_tests
from atg_fg.storage.recordings import check_recording, read_recording, read_spec, write_recording
from atg_fg.storage.rosbag_recordings import read_topics
from atg_fg.storage.scripted_trial import read_script
from atg_fg.storage.trial_log import TrialLog
from atg_fg.storage.uai import read_evidence, read_model
from sim.bodies.robot_mapping import read_mapping
from sim.bodies.urdf_reader import read_urdf
from sim.noise_calibration import calibrate, read_counts
from tests.torture.address_space import limit_address_space, peak
from tests.torture.mutations import FAST, mutated
from tests.torture.originals import originals
from tests.torture.recorded import BAG_TOPICS, bag_in_sqlite

#: What a file may take: seconds of processor time, and bytes beyond what the process had before.
MAX_SECONDS = 1.0
MAX_BYTES = 200 * 2**20
_HANGS = 20
#: Entries of the tables for a UAI model; 8 bytes each.
_LIMIT = 2**18
#: Objects times steps times patterns up to which a script is replayed.
_SHORT = 20_000
#: Trials, and patterns, up to which a test is rescored.
_FEW_TRIALS, _FEW_PATTERNS = 10, 200


def read_damaged(n_files: int, seed: int, processes: int = 1) -> dict[str, Any]:
    """Return how many files of each kind were read or refused, the most that one took, and all that went wrong."""
    shares = [range(first, n_files, processes) for first in range(min(processes, n_files))]
    with ThreadPoolExecutor(len(shares)) as executor:
        parts = list(executor.map(lambda share: _Reader(share, seed).collect(), shares))
    return {
        "files": sum((part["files"] for part in parts), Counter()),
        "read": sum((part["read"] for part in parts), Counter()),
        "faults": [fault for part in parts for fault in part["faults"]],
        "seconds": max(part["seconds"] for part in parts),
        "bytes": max(part["bytes"] for part in parts),
    }


class _Reader:
    """A process that reads some of the files, and others after it where it dies."""

    def __init__(self, share: range, seed: int) -> None:
        self._share, self._seed = share, seed
        self._process = self._started(0)

    def _started(self, done: int) -> subprocess.Popen[str]:
        share = self._share
        numbers = [str(share.start + done * share.step), str(share.stop), str(share.step)]
        command = [sys.executable, "-m", "tests.torture.reading", str(self._seed), *numbers]
        return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)

    def collect(self) -> dict[str, Any]:
        """Return what came of all of them."""
        result: dict[str, Any] = {"files": Counter(), "read": Counter(), "faults": [], "seconds": 0.0, "bytes": 0}
        done, at = 0, None
        while done < len(self._share):
            output = self._process.stdout
            assert output is not None
            for line in output:
                entry = json.loads(line)
                if "at" in entry:
                    at = entry
                    continue
                done, at = done + 1, None
                result["files"][entry["kind"]] += 1
                result["read"][entry["kind"]] += entry["fault"] is None and entry["read"]
                result["seconds"] = max(result["seconds"], entry["seconds"])
                result["bytes"] = max(result["bytes"], entry["bytes"])
                if entry["fault"] is not None:
                    result["faults"].append(f"file {entry['number']} ({entry['kind']}): {entry['fault']}")
            status = self._process.wait()
            output.close()
            if done < len(self._share):
                number = self._share[done]
                what = "process ended" if at is None else f"process died in file {number} ({at['kind']})"
                result["faults"].append(f"{what}, status {status}")
                result["files"]["died"] += 1
                done, at = done + 1, None
                if done < len(self._share):
                    self._process = self._started(done)
        return result


def main() -> None:
    """Read the files from FIRST to below STOP by STEP, of SEED; arguments SEED FIRST STOP STEP."""
    seed, *numbers = map(int, sys.argv[1:])
    with tempfile.TemporaryDirectory(dir=FAST) as folder:
        warm_up(Path(folder))
        gc.freeze()
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        for number in range(*numbers):
            kind, content = mutated(seed, number)
            _say({"at": number, "kind": kind})
            result = measured(kind, content, Path(folder))
            if result["seconds"] > MAX_SECONDS:  # loops for a size that no file had before may have been compiled
                result = measured(kind, content, Path(folder))
            _say({"number": number, "kind": kind, **result})


def warm_up(folder: Path) -> None:
    """Read a sound file of each kind: loops that are compiled when they are first used are no matter of a file."""
    for kind in READERS:
        with suppress(AtgError):
            read_as(kind, originals()[kind][-1], folder)


def measured(kind: str, content: bytes, folder: Path) -> dict[str, Any]:
    """Read a file as it may be read; return whether it could be, what went wrong, and what it took."""
    fault, read = None, False
    limit_address_space()
    before = peak(reset=True)
    start = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, _HANGS)
    try:
        read_as(kind, content, folder)
        read = True
    except AtgError as error:
        if len(str(error)) > 2500:
            fault = f"a message of {len(str(error))} characters: {str(error)[:200]!r}"
    except BaseException as error:
        fault = f"{type(error).__name__}: {str(error)[:300]}"
    signal.setitimer(signal.ITIMER_PROF, 0)
    seconds, taken = time.process_time() - start, peak() - before
    if fault is None and seconds > MAX_SECONDS:
        fault = f"{seconds:.2f} s"
    if fault is None and taken > MAX_BYTES:
        fault = f"{taken / 2**20:.0f} MiB"
    return {"read": read, "fault": fault, "seconds": seconds, "bytes": taken}


def read_as(kind: str, content: bytes, folder: Path) -> None:
    """Do with a file what commands do with files of its kind."""
    for each in folder.iterdir():
        each.unlink()
    path = folder / f"damaged{SUFFIXES.get(kind, '')}"
    path.write_bytes(content)
    READERS[kind](path)


def _use_memory(path: Path) -> None:
    memory_json.memory_to_json(memory_files.load_memory(path))


def _replay(path: Path) -> None:
    script = read_script(plain_files.read_text_file(path), str(path))
    # A sound script may ask for a long trial among many objects. To answer it is work, and no failure.
    if (len(script.memory) + 1) * len(script.steps) * len(script.memory.assumptions.alphabet) <= _SHORT:
        replay(script, "gtsam", smooth=True)


def _solve(path: Path) -> None:
    model = read_model(plain_files.read_text_file(path), str(path), note=lambda _: None)
    log_partition(model, limit=_LIMIT)
    marginals(model, limit=_LIMIT)


def _use_evidence(path: Path) -> None:
    evidence = read_evidence(plain_files.read_text_file(path), str(path), note=lambda _: None)
    original = read_model(originals()["UAI model"][-1].decode())
    original.check_evidence(evidence)


def _report(path: Path) -> None:
    page(read_report(path))


def _all_of(*uses: Callable[[Path], object]) -> Callable[[Path], None]:
    """Return what does all of these: what one of them refuses the next ones must refuse or survive, too."""

    def use_all(path: Path) -> None:
        errors: list[AtgError] = []
        for use in uses:
            try:
                use(path)
            except AtgError as error:
                errors.append(error)
        if errors:
            raise errors[0]

    return use_all


def _rescore(path: Path) -> None:
    for test in recorded_tests(path):
        if len(test.trials) <= _FEW_TRIALS and len(test.assumptions.alphabet) <= _FEW_PATTERNS:
            rescore(test, "bayes-filter", ModelParameters())


def _import(path: Path) -> None:
    """Import a log into a database, which must be sound afterwards."""
    into = path.with_name("into.db")
    experiment, trials = records_in_log(path)
    with writing(into, create=True) as connection:
        add_records(connection, str(into), [(experiment, trials)])
    faults = faults_of_database(into)
    assert not faults, faults


def _resume(path: Path) -> None:
    """Go on with a log under its own header, so that all of its lines are read."""
    header = read_lines(path, packed=True)[:1]
    if header and isinstance(header[0], dict):
        TrialLog(path, header[0], arcube_assumptions()).resume()


def _learn_in_place(path: Path) -> None:
    with closing(open_memory(path)) as memory:
        list(memory.experiments())
        n_trials = sum(1 for _ in memory.trials())
        memory.learn([0, 1, 2], [0, 0], None)
        assert sum(1 for _ in memory.trials()) == n_trials
        if len(memory) > 1:
            memory.merge(memory.names[0], memory.names[1])


def _convert(path: Path) -> None:
    """Check a recording, learn from it, and write it in both forms: each must be read as what was written."""
    recording, faults = check_recording(path)
    if any(fault.fatal for fault in faults):
        read_recording(path)
        raise AssertionError("a fatal fault, and no error")
    _written_again(recording, path)
    if len(recording.trials) * len(recording.labels) ** len(recording.slots) <= _SHORT:
        with_number = recording if recording.n_objects else replace(recording, n_objects=4)
        memory = RobotMemory(with_number.assumptions())
        recognise(with_number, memory, "bayes-filter", ModelParameters(), learn=True)


def _written_again(recording: Recording, path: Path) -> None:
    for suffix in (".csv", ".jsonl"):
        again = path.with_name(f"again{suffix}")
        write_recording(recording, again)
        assert _said(read_recording(again)) == _said(recording), suffix


def _said(recording: Recording) -> list[Any]:
    """What a recording says in whatever form: no confidence is none of each, and a label of weight 0 is none."""
    return [trial._replace(looks=tuple(map(_plain_look, trial.looks))) for trial in recording.trials]


def _plain_look(look: RecordedLook) -> RecordedLook:
    weights = tuple(slot and {label: weight for label, weight in slot.items() if weight} for slot in look.weights)
    return look._replace(confidences=look.confidences if any(look.confidences) else (), weights=weights)


def _read_bag(path: Path) -> None:
    """Read a bag in this process, so that damage to it does not cost a process each."""
    _written_again(rosbag_recordings.read_bag(path, BAG_TOPICS), path)


def _read_sqlite_bag(content: str, read: Callable[[Path], None], path: Path) -> None:
    """Read a bag of rosbag2 of which one file, whose suffix is ``content``, is damaged."""
    folder = path.with_name("bag")
    shutil.copytree(_sound_bag(), folder)
    (there,) = folder.glob(f"*{content}")
    path.replace(there)
    try:
        read(folder)
    finally:
        shutil.rmtree(folder)


@cache
def _sound_bag() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="bag-", dir=FAST))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return bag_in_sqlite(folder / "bag")


def _look(path: Path) -> None:
    TagDetector(Tags("DICT_5X5_50", 0.04)).detect(read_image(path))


#: What is done with files of each kind.
READERS: Final[dict[str, Callable[[Path], None]]] = {
    "memory": _use_memory,
    "structured memory": _use_memory,
    "compact memory": _use_memory,
    "script": _replay,
    "UAI model": _solve,
    "UAI evidence": _use_evidence,
    "database": _all_of(
        faults_of_database, memory_files.load_memory, _rescore, _report, repair_database, _learn_in_place
    ),
    "structured database": _all_of(faults_of_database, memory_files.load_memory, _report, _learn_in_place),
    "test log": _all_of(_report, _rescore, _import, _resume),
    "trial record": _report,
    "goal run": _all_of(_report, lambda path: GoalRunFile(path, {"seed": 0, "run": 0}).read()),
    "result": _report,
    "ablation log": lambda path: AblationLog(path, 5).get(Cell("default", "ideal", "ideal", 4), 0) and None,
    "preset": lambda path: preset(str(path)) and None,
    "counts": lambda path: calibrate(read_counts([path])) and None,
    "tags": lambda path: read_tags(path) and None,
    "calibration": lambda path: read_calibration(path) and None,
    "URDF": lambda path: read_urdf(path) and None,
    "mapping": lambda path: read_mapping(path) and None,
    "picture": _look,
    "recorded table": _convert,
    "recorded lines": _convert,
    "recording spec": lambda path: read_spec(path) and None,
    "bag topics": lambda path: read_topics(path) and None,
    "MCAP bag": _read_bag,
    "bag of ROS 1": _read_bag,
    "SQLite bag": partial(_read_sqlite_bag, ".db3", _read_bag),
    # A few lines of YAML can take seconds.
    "bag metadata": partial(_read_sqlite_bag, ".yaml", lambda folder: read_bag(folder, BAG_TOPICS) and None),
}
SUFFIXES: Final = {
    "compact memory": ".npz",
    "test log": ".jsonl.gz",
    "goal run": ".json.gz",
    "trial record": ".jsonl",
    "preset": ".json",
    "URDF": ".urdf",
    "mapping": ".toml",
    "picture": ".png",
    "MCAP bag": ".mcap",
    "bag of ROS 1": ".bag",
}


def _say(entry: dict[str, Any]) -> None:
    os.write(1, (json.dumps(entry) + "\n").encode())


if __name__ == "__main__":
    main()
