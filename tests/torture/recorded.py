"""Sound recordings of every form; damaged ones are made from them."""

from __future__ import annotations

import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from rosbags.rosbag1 import Writer as OldWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from atg_fg.core.recordings import RecordedLook, Recording
from atg_fg.experiments.simulated_recording import simulated_recording
from atg_fg.storage.recordings import write_recording
from atg_fg.storage.rosbag_recordings import BagTopics, TopicField

_TOPICS: dict[str, Any] = {
    "slots": {"label": {"topic": "/seen", "label": "data.found.*.name", "confidence": "data.found.*.sure"}},
    "action": {"topic": "/did", "label": "data"},
    "trial": {"topic": "/trial", "label": "data"},
    "object": {"topic": "/shown", "label": "data"},
}
BAG_TOPICS = BagTopics(
    {"label": TopicField(**_TOPICS["slots"]["label"])},
    *(TopicField(**_TOPICS[key]) for key in ("action", "trial", "object")),
)
_SPEC: dict[str, Any] = {
    "slots": ["label"],
    "actions": ["rotate", "tip"],
    "labels": ["cup", "lid", "logo"],
    "objects": 4,
    "aspects": 6,
    "exclusive": False,
}
_SAID = (
    *(("/trial", "first"), ("/shown", "cup"), ("/seen", [("cup", 0.9), ("lid", 0.2)]), ("/did", "tip")),
    *(("/seen", []), ("/did", "rotate"), ("/seen", [("lid", 0.5)]), ("/trial", "second"), ("/seen", [("logo", 1.0)])),
    *(("/did", "tip"), ("/seen", [("cup", 0.75)])),
)


def recordings() -> dict[str, list[bytes]]:
    """Recordings as tables, as lines, as bags of each kind, and what is said beside them."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plain, sure = _recording(), _recording(confidences=True)
        forms = (plain, sure, _soft(plain))
        return {
            "recorded table": [_written(each, folder / "r.csv") for each in forms],
            "recorded lines": [_written(each, folder / "r.jsonl") for each in forms],
            "recording spec": [json.dumps(_SPEC).encode()],
            "bag topics": [json.dumps(_TOPICS).encode()],
            "MCAP bag": [next(_bag(folder / "mcap", StoragePlugin.MCAP).glob("*.mcap")).read_bytes()],
            "SQLite bag": [next(bag_in_sqlite(folder / "sqlite").glob("*.db3")).read_bytes()],
            "bag metadata": [(bag_in_sqlite(folder / "said" / "bag") / "metadata.yaml").read_bytes()],
            "bag of ROS 1": [_old_bag(folder / "old.bag").read_bytes()],
        }


def _recording(**options: Any) -> Recording:
    return simulated_recording("detector", 3, 6, 4, 0, wrong=0.1, missing=0.1, **options)


def _soft(recording: Recording) -> Recording:
    """The recording, with the likelihood of each label in place of every second one."""
    labels = recording.labels
    trials = []
    for trial in recording.trials:
        looks = [
            RecordedLook((None,), (None,), ({label: 0.7, labels[0]: 0.2},)) if step % 2 and (label := look.labels[0])
            else look
            for step, look in enumerate(trial.looks)
        ]  # fmt: skip
        trials.append(trial._replace(looks=tuple(looks)))
    return replace(recording, trials=tuple(trials))


def _written(recording: Recording, path: Path) -> bytes:
    write_recording(recording, path)
    return path.read_bytes()


def bag_in_sqlite(folder: Path) -> Path:
    """Write a sound bag of rosbag2 in SQLite."""
    return _bag(folder, StoragePlugin.SQLITE3)


def _bag(folder: Path, plugin: StoragePlugin) -> Path:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        _say(writer, store, lambda message, kind: store.serialize_cdr(message, kind), typestore=store)
    return folder


def _old_bag(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    with OldWriter(path) as writer:
        _say(writer, store, lambda message, kind: store.serialize_ros1(message, kind), typestore=store)
    return path


def _say(writer: Any, store: Any, serialised: Any, **options: Any) -> None:
    """Publish what was said, what was found as JSON in a text."""
    kind = "std_msgs/msg/String"
    connections = {topic: writer.add_connection(topic, kind, **options) for topic in dict.fromkeys(t for t, _ in _SAID)}
    for second, (topic, what) in enumerate(_SAID):
        text = what if isinstance(what, str) else json.dumps({"found": [{"name": n, "sure": s} for n, s in what]})
        writer.write(connections[topic], second * 10**9, serialised(store.types[kind](text), kind))
