"""Sound files of every kind that this project reads; damaged ones are made from them."""

from __future__ import annotations

import gzip
import json
import tempfile
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.records import TrialRecord
from atg_fg.engines import begin_trial
from atg_fg.experiments.ablation import AblationLog, Cell
from atg_fg.experiments.scores import TestResult
from atg_fg.experiments.table1 import TestPlan, run_tests
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.policies import EntropyPolicy, RandomPolicy
from atg_fg.senses.tags import tag_image
from atg_fg.storage import memory_files, memory_json
from atg_fg.storage.camera_files import CALIBRATION_FORMAT
from atg_fg.storage.memory_files import open_memory
from atg_fg.storage.presets import write_preset
from atg_fg.storage.scripted_trial import read_script
from atg_fg.storage.trial_log import to_json_lines
from atg_fg.storage.uai import write_evidence, write_model
from atg_fg.storage.uai_export import export_trial
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.registry import make_world
from tests.torture.recorded import recordings

_DATA = Path(__file__).parents[1] / "data"
_RESULTS = Path(__file__).parents[2] / "results"
_SCRIPT = _DATA / "scripted_trial.json"
_DOCS = Path(__file__).parents[2] / "docs"
_UAI = "MARKOV\n3\n2 3 2\n3\n2 0 1\n1 2\n3 0 1 2\n\n6\n1 2 3 4 5 6.5\n2\n0 1\n12\n" + "0.5 1e-3 2 7 0 1 " * 2 + "\n"
_TAGS = {
    "format": "atg-fg/tags",
    "version": 1,
    "dictionary": "DICT_5X5_50",
    "size_metres": 0.042,
    "ids": list(range(12)),
    "cubes": [[0, 1, 2, 3, 4, 5]],
}
_CALIBRATION = {
    "format": CALIBRATION_FORMAT,
    "version": 1,
    "image_size": [640, 480],
    "intrinsics": [[600.0, 0.0, 320.0], [0.0, 600.0, 240.0], [0.0, 0.0, 1.0]],
    "distortion": [0.1, -0.2, 0.0, 0.0, 0.0],
    "error_pixels": 0.3,
    "pictures": 9,
}
_ROBOT = """<robot name="r"><material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
<link name="base"><visual><origin xyz="0 0 1" rpy="0 0 0"/><geometry><box size="1 1 1"/></geometry></visual>
<inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="arm"><collision><geometry><sphere radius="0.2"/></geometry></collision></link>
<link name="hand"><visual><geometry><cylinder radius="0.1" length="1"/></geometry>
<material name="grey"/></visual></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="5" velocity="2"/></joint>
<joint name="wrist" type="continuous"><parent link="arm"/><child link="hand"/><mimic joint="shoulder"/></joint>
</robot>
"""


@cache
def originals() -> dict[str, list[bytes]]:
    """Sound files of each kind, and those of all versions that were ever written."""
    formats = _DATA / "formats"
    plain, structured = _memory(5), memory_files.load_memory(formats / "memory-1-structured.json")
    sensed = (formats / "memory-1-sense.json").read_bytes()
    exported = export_trial(read_script(_SCRIPT.read_text()))
    with tempfile.TemporaryDirectory() as folder:
        logs = _logs(Path(folder))
    named, sampled = (formats / f"memory-1-{what}.json" for what in ("labels", "evidence"))
    return {
        "memory": [
            *(memory_json.memory_to_json(plain).encode(), (formats / "memory-1.json").read_bytes(), sensed),
            named.read_bytes(),
        ],
        "structured memory": [(formats / "memory-1-structured.json").read_bytes(), sampled.read_bytes()],
        "compact memory": [_compact(plain)],
        "script": [_SCRIPT.read_bytes(), _long_script(), (formats / "scripted-trial-2.json").read_bytes()],
        "UAI model": [_UAI.encode(), write_model(exported.model).encode()],
        "UAI evidence": [b"2 0 1 2 0\n", b"1\n1 3 2\n", write_evidence(exported.evidence).encode()],
        "database": [
            *(_database(plain, n_trials=4), (formats / "memory-schema-1.db").read_bytes()),
            _database(memory_files.load_memory(named), n_trials=0),
        ],
        "structured database": [
            _database(structured, n_trials=0),
            _database(memory_files.load_memory(formats / "memory-1-sense.json"), n_trials=0),
            _database(memory_files.load_memory(sampled), n_trials=0),
        ],
        "test log": [*logs["test log"], (formats / "test-1.jsonl.gz").read_bytes()],
        "trial record": [_trial_record()],
        "goal run": [(formats / "goal-run-1.json.gz").read_bytes()],
        "result": [
            *_results(),
            json.dumps({"command": "sim reliability", **json.loads(_counts())}).encode(),
        ],
        "ablation log": [*logs["ablation log"], (formats / "ablation-1.jsonl").read_bytes()],
        "preset": [json.dumps(write_preset(ModelParameters())).encode(), (formats / "preset-1.json").read_bytes()],
        "counts": [_counts()],
        "tags": [json.dumps(_TAGS).encode()],
        "calibration": [json.dumps(_CALIBRATION).encode()],
        "URDF": [_ROBOT.encode()],
        "mapping": [(_DOCS / "baxter.toml").read_bytes()],
        "picture": [_picture(".png"), _picture(".jpg")],
        **recordings(),
    }


def _picture(kind: str) -> bytes:
    """A photograph of a tag."""
    image = np.full((300, 300), 255, dtype=np.uint8)
    image[75:225, 75:225] = tag_image("DICT_5X5_50", 0, 150)
    return cv2.imencode(kind, image)[1].tobytes()


def _memory(n_trials: int) -> RobotMemory:
    memory = RobotMemory(arcube_assumptions())
    _learn(memory, n_trials)
    memory.merge(memory.names[0], memory.names[-1])
    return memory


def _learn(memory: RobotMemory, n_trials: int) -> None:
    with closing(make_world("ideal", cubes=make_arcubes(4, seed=0))) as world:
        for number in range(n_trials):
            inference = begin_trial("bayes-filter", memory, ModelParameters())
            learn_from(run_trial(world, inference, RandomPolicy(), 6, np.random.default_rng(number)), memory)


def _database(memory: RobotMemory, n_trials: int) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.db"
        memory_files.save_memory(memory, path)
        with open_memory(path) as opened:
            opened.begin_experiment("torture", {"actions": 6}, seed=0)
            _learn(opened, n_trials)
        run_tests([(TestPlan(engine="bayes-filter", n_actions=2, n_trials=2), 0)], 1, path)
        return path.read_bytes()


def _compact(memory: RobotMemory) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "memory.npz"
        memory_files.save_memory(RobotMemory(memory.assumptions, memory), path)
        return path.read_bytes()


def _long_script() -> bytes:
    """A script with several ATGs and many steps."""
    document = json.loads(_SCRIPT.read_bytes())
    document["memory"] = json.loads(memory_json.memory_to_json(_memory(5)))["memory"]
    steps = [{"act": "flip"}, {"observe": [1, None]}, {"act": "left"}, {"observe": [None, 3]}]
    document["steps"] = [{"observe": [0, 1]}, *steps * 3]
    return json.dumps(document).encode()


def _logs(folder: Path) -> dict[str, list[bytes]]:
    plan = TestPlan(engine="bayes-filter", n_actions=3, n_trials=4, world_options={"slip": 0.1})
    run_tests([(plan, 0)], 1, folder)
    log = AblationLog(folder / "ablation.jsonl", 5)
    for seed in range(4):
        log.add(Cell("default", "ideal", "ideal", 4), TestResult(seed, (1, 2), (2, 3), (1, 3)))
    return {
        "test log": [(folder / "test-0000.jsonl.gz").read_bytes()],
        "ablation log": [(folder / "ablation.jsonl").read_bytes()],
    }


def _trial_record() -> bytes:
    memory = _memory(4)
    with closing(make_world("ideal", cubes=make_arcubes(4, seed=0))) as world:
        inference = begin_trial("bayes-filter", memory, ModelParameters())
        record: TrialRecord = run_trial(world, inference, EntropyPolicy(), 5, np.random.default_rng(0))
    return to_json_lines(record, engine="bayes-filter", policy="entropy", preset="default", world="ideal").encode()


def _results() -> list[bytes]:
    """Return one result of each command, the smallest that there is."""
    smallest: dict[str, bytes] = {}
    for path in sorted(_RESULTS.glob("*.json")):
        content = path.read_bytes()
        document: dict[str, Any] = json.loads(content)
        command = document.get("command")
        if command is not None and len(content) < len(smallest.get(command, bytes(100_000))):
            smallest[command] = content
    return list(smallest.values())


def _counts() -> bytes:
    return min((path.read_bytes() for path in _RESULTS.glob("reliability_*.json")), key=len)


def unpacked(content: bytes) -> list[bytes]:
    """Return the lines of a packed log, or the only one of a packed document."""
    return gzip.decompress(content).splitlines()


def packed(lines: list[bytes]) -> bytes:
    """Return lines as the members of a packed log."""
    return b"".join(gzip.compress(line + b"\n", mtime=0) for line in lines)
