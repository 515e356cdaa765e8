"""Bags of ROS as recordings: written here with the library that reads them.

What bags mean is read in this process; what may be wrong with them, in the process of its own that users have.
"""

import json
import resource
import sqlite3
import sys
from contextlib import closing

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install atg-fg[ros]")
from rosbags.rosbag1 import Writer as OldWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from atg_fg.core.errors import InvalidInputError
from atg_fg.storage import rosbag_recordings
from atg_fg.storage.bag_process import read_bag
from atg_fg.storage.rosbag_recordings import is_bag, read_topics

TYPES = {
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score",
    "vision_msgs/msg/ObjectHypothesisWithPose": "vision_msgs/ObjectHypothesis hypothesis",
    "vision_msgs/msg/Detection2D": "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results",
    "vision_msgs/msg/Detection2DArray": "std_msgs/Header header\nvision_msgs/Detection2D[] detections",
    "markers/msg/Marker": "uint32 id\nfloat32 confidence",
    "markers/msg/MarkerArray": "markers/Marker[] markers",
}
SECOND = 10**9


@pytest.fixture(scope="module")
def store():
    found = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in TYPES.items():
        found.register(get_types_from_msg(text, name))
    return found


@pytest.fixture
def bag(tmp_path, store):
    """Write a bag of (topic, type, message) in this order, a second from each to the next."""

    def write(messages, plugin=StoragePlugin.SQLITE3, name="bag"):
        with Writer(tmp_path / name, version=9, storage_plugin=plugin) as writer:
            connections = {}
            for second, (topic, kind, message) in enumerate(messages):
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=store)
                writer.write(connections[topic], second * SECOND, store.serialize_cdr(message, kind))
        return tmp_path / name

    return write


@pytest.fixture
def topics(tmp_path):
    def write(**fields):
        path = tmp_path / "topics.json"
        path.write_text(json.dumps(fields))
        return read_topics(path)

    return write


@pytest.fixture
def text(store):
    return lambda topic, words: (topic, "std_msgs/msg/String", store.types["std_msgs/msg/String"](words))


def described(trial):
    return trial.name, [look.labels for look in trial.looks], trial.actions, trial.object


LABEL = {"topic": "/seen", "label": "data"}
DID = {"topic": "/did", "label": "data"}


@pytest.mark.parametrize("plugin", StoragePlugin)
def test_texts_are_looks_and_actions_in_the_order_of_time(bag, topics, text, plugin):
    path = bag(
        [
            *(text("/trial", "a"), text("/object", "cup"), text("/seen", "logo"), text("/did", "turn")),
            *(text("/did", "tip"), text("/seen", "lid"), text("/trial", "b"), text("/seen", "text")),
            *(text("/did", "turn"), text("/seen", "base")),
        ],
        plugin,
    )
    spec = topics(
        slots={"label": LABEL},
        action=DID,
        trial={"topic": "/trial", "label": "data"},
        object={"topic": "/object", "label": "data"},
    )
    recording = read_bag(path, spec)
    assert [described(trial) for trial in recording.trials] == [
        ("a", [("logo",), (None,), ("lid",)], ("turn", "tip"), "cup"),
        ("b", [("text",), ("base",)], ("turn",), None),
    ]
    assert (recording.slots, recording.actions) == (("label",), ("tip", "turn"))
    assert is_bag(path)


def test_an_mcap_file_may_lie_by_itself(bag, topics, text, tmp_path):
    folder = bag([text("/seen", "logo"), text("/did", "turn"), text("/seen", "lid")], StoragePlugin.MCAP)
    alone = tmp_path / "alone.mcap"
    next(folder.glob("*.mcap")).rename(alone)
    (trial,) = rosbag_recordings.read_bag(alone, topics(slots={"label": LABEL}, action=DID)).trials
    assert described(trial) == ("alone", [("logo",), ("lid",)], ("turn",), None)


def test_a_bag_of_ros_1_is_read_too(topics, tmp_path):
    store = get_typestore(Stores.ROS1_NOETIC)
    with OldWriter(tmp_path / "old.bag") as writer:
        connections = {
            topic: writer.add_connection(topic, "std_msgs/msg/String", typestore=store) for topic in ("/seen", "/did")
        }
        for second, (topic, words) in enumerate([("/seen", "logo"), ("/did", "turn"), ("/seen", "lid")], 1):
            message = store.types["std_msgs/msg/String"](words)
            writer.write(connections[topic], second * SECOND, store.serialize_ros1(message, "std_msgs/msg/String"))
    (trial,) = rosbag_recordings.read_bag(tmp_path / "old.bag", topics(slots={"label": LABEL}, action=DID)).trials
    assert described(trial) == ("old", [("logo",), ("lid",)], ("turn",), None)


def test_of_many_detections_the_surest_counts(bag, topics, text, store):
    def detections(*found):
        types = store.types
        header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), "camera")
        results = [
            types["vision_msgs/msg/Detection2D"](
                header,
                [
                    types["vision_msgs/msg/ObjectHypothesisWithPose"](
                        types["vision_msgs/msg/ObjectHypothesis"](label, score)
                    )
                ],
            )
            for label, score in found
        ]
        name = "vision_msgs/msg/Detection2DArray"
        return "/detections", name, types[name](header, results)

    path = bag(
        [
            *(detections(("logo", 0.4), ("text", 0.75)), detections(("lid", 0.5)), text("/did", "turn")),
            *(detections(), text("/did", "turn"), detections(("lid", 0.25))),
        ]
    )
    field = "detections.*.results.*.hypothesis"
    spec = {"topic": "/detections", "label": f"{field}.class_id", "confidence": f"{field}.score"}
    (trial,) = rosbag_recordings.read_bag(path, topics(slots={"label": spec}, action=DID)).trials
    assert [(look.labels, look.confidences) for look in trial.looks] == [
        (("text",), (0.75,)),
        ((None,), (None,)),
        (("lid",), (0.25,)),
    ]


def test_numbers_of_markers_are_labels(bag, topics, text, store):
    marker, name = store.types["markers/msg/Marker"], "markers/msg/MarkerArray"
    found = store.types[name]([marker(23, np.float32(0.5)), marker(40, np.float32(0.25))])
    path = bag([("/markers", name, found), text("/did", "turn"), ("/markers", name, store.types[name]([]))])
    spec = {"topic": "/markers", "label": "markers.*.id", "confidence": "markers.*.confidence"}
    (trial,) = rosbag_recordings.read_bag(path, topics(slots={"tag": spec}, action=DID)).trials
    assert [look.labels for look in trial.looks] == [("23",), (None,)]


def test_json_in_a_text_is_read(bag, topics, text):
    say = json.dumps
    path = bag(
        [
            text("/seen", say({"front": {"name": "logo", "sure": 0.5}, "top": {"name": None, "sure": None}})),
            text("/did", say({"action": "turn"})),
            text("/seen", say({"front": {"name": "lid", "sure": 1}, "top": {"name": "base", "sure": 0.25}})),
        ]
    )
    slots = {
        slot: {"topic": "/seen", "label": f"data.{slot}.name", "confidence": f"data.{slot}.sure"}
        for slot in ("front", "top")
    }
    (trial,) = rosbag_recordings.read_bag(
        path, topics(slots=slots, action={"topic": "/did", "label": "data.action"})
    ).trials
    assert [look.labels for look in trial.looks] == [("logo", None), ("lid", "base")]
    assert trial.actions == ("turn",)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"action": {"topic": "/done", "label": "data"}}, r"bag: no topic '/done'; expected one of: /did, /seen"),
        ({"slots": {"label": {"topic": "/seen", "label": "text"}}}, "no field 'text'; expected one of: data"),
        ({"slots": {"label": {"topic": "/seen", "label": "data.name"}}}, "message 0 of /seen: not valid JSON"),
        ({"slots": {"label": {"topic": "/seen", "label": "*.x"}}}, "expected a list, for the path"),
    ],
)
def test_what_is_not_there_is_one_line(bag, topics, text, change, message):
    path = bag([text("/seen", "logo"), text("/did", "turn"), text("/seen", "lid")])
    with pytest.raises(InvalidInputError, match=message):
        rosbag_recordings.read_bag(path, topics(**{"slots": {"label": LABEL}, "action": DID, **change}))


def test_half_a_character_is_no_name(bag, topics, text):
    path = bag([text("/seen", json.dumps({"name": "\ud800"})), text("/did", "turn"), text("/seen", '{"name": "lid"}')])
    with pytest.raises(InvalidInputError, match=r"message 0 of /seen: .*expected a text of whole characters"):
        rosbag_recordings.read_bag(path, topics(slots={"label": {"topic": "/seen", "label": "data.name"}}, action=DID))


def test_an_unknown_type_is_one_line(bag, topics, text):
    path = bag([text("/seen", "logo"), text("/did", "turn")])
    meta = path / "metadata.yaml"
    meta.write_text(meta.read_text().replace("std_msgs/msg/String", "my_msgs/msg/Label", 1))
    with pytest.raises(InvalidInputError, match="type 'my_msgs/msg/Label' is not known; expected a bag that holds its"):
        rosbag_recordings.read_bag(path, topics(slots={"label": LABEL}, action=DID))


@pytest.mark.parametrize(
    "damage",
    [
        lambda folder: (folder / "metadata.yaml").unlink(),
        lambda folder: (folder / "metadata.yaml").write_text("rosbag2_bagfile_information: [1"),
        lambda folder: next(folder.glob("*.db3")).write_bytes(b"no database"),
        lambda folder: next(folder.glob("*.db3")).unlink(),
    ],
)
def test_a_damaged_bag_is_one_line(bag, topics, text, damage):
    path = bag([text("/seen", "logo"), text("/did", "turn"), text("/seen", "lid")])
    damage(path)
    with pytest.raises(InvalidInputError, match=r"bag: cannot be read: .*expected a bag: a folder of rosbag2"):
        read_bag(path, topics(slots={"label": LABEL}, action=DID))


def test_a_file_that_is_no_mcap_is_one_line(topics, tmp_path):
    (tmp_path / "no.mcap").write_bytes(b"nothing")
    with pytest.raises(InvalidInputError, match=r"no\.mcap: cannot be read"):
        read_bag(tmp_path / "no.mcap", topics(slots={"label": LABEL}, action=DID))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"slots": {}, "action": DID}, "slots: .*; expected an object with a topic for each slot"),
        ({"slots": {"label": {"topic": "/seen"}}, "action": DID}, "slots: label: key 'label' is missing"),
        ({"slots": {"label": LABEL}}, "key 'action' is missing"),
        ({"slots": {"label": {**LABEL, "label": 3}}, "action": DID}, "label: 3; expected a text"),
    ],
)
def test_a_file_of_topics_is_checked(topics, fields, message):
    with pytest.raises(InvalidInputError, match=message):
        topics(**fields)


class TestBombs:
    """Small bags that would unfold to many times what they may, or be read for ever."""

    @pytest.fixture
    def plain(self, bag, text):
        return bag([text("/seen", "logo"), text("/did", "turn"), text("/seen", "lid")])

    @staticmethod
    def say(folder, *lines):
        """Say more of a bag in its metadata."""
        meta = folder / "metadata.yaml"
        kept = [line for line in meta.read_text().split("\n") if "compression" not in line]
        meta.write_text("\n".join([kept[0], *(f"  {line}" for line in lines), *kept[1:]]))

    @staticmethod
    def zeros(n_bytes):
        from rosbags.rosbag2.reader import zstd

        packer = zstd.ZstdCompressor()
        part = bytes(2**24)
        return b"".join(packer.compress(part) for _ in range(n_bytes // 2**24)) + packer.flush()

    def refused(self, folder, topics):
        begun = resource.getrusage(resource.RUSAGE_CHILDREN)
        with pytest.raises(InvalidInputError) as error:
            read_bag(folder, topics(slots={"label": LABEL}, action=DID))
        ended = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert "\n" not in str(error.value)
        return str(error.value), ended.ru_utime - begun.ru_utime

    def test_a_file_that_is_packed_does_not_fill_the_disk(self, plain, topics):
        file = next(plain.glob("*.db3"))
        self.say(plain, "compression_mode: FILE", "compression_format: zstd")
        file.write_bytes(self.zeros(2**28))
        message, seconds = self.refused(plain, topics)
        assert "holds more than 67,108,864 bytes" in message
        assert seconds < 5

    def test_a_message_that_is_packed_does_not_fill_the_memory(self, plain, topics):
        self.say(plain, "compression_mode: MESSAGE", "compression_format: zstd")
        with closing(sqlite3.connect(next(plain.glob("*.db3")))) as database, database:
            database.execute("UPDATE messages SET data = ?", (self.zeros(2**29),))
        message, seconds = self.refused(plain, topics)
        assert "holds more than 67,108,864 bytes" in message
        assert seconds < 10

    @pytest.mark.parametrize(
        ("signal", "said"),
        [("KILL", "takes longer than its size"), ("ALRM", "takes longer than its size"), ("SEGV", "status -11")],
    )
    def test_a_reader_that_is_ended_is_one_line(self, signal, said, plain, topics, tmp_path, monkeypatch):
        """By the limit of its processor time, or of all of its time, or by a fault of the library."""
        stub = tmp_path / "python"
        stub.write_text(f"#!/bin/sh\nkill -{signal} $$\n")
        stub.chmod(0o755)
        monkeypatch.setattr(sys, "executable", str(stub))
        assert said in self.refused(plain, topics)[0]

    def test_a_bag_whose_table_is_a_view_without_end_is_none(self, plain, topics):
        with closing(sqlite3.connect(next(plain.glob("*.db3")))) as database, database:
            database.execute("ALTER TABLE messages RENAME TO real")
            database.execute(
                "CREATE VIEW messages AS WITH n(id) AS (SELECT 1 UNION ALL SELECT id FROM n) SELECT * FROM n"
            )
        assert "cannot be read" in self.refused(plain, topics)[0]
