"""Bags of ROS as recordings: rosbag2 (SQLite or MCAP) and ROS 1, read by the pure-Python `rosbags`, without ROS.

A file of topics says where labels, actions, trials and objects are published, and in which field::

    {"slots": {"label": {"topic": "/detections", "label": "detections.*.results.*.hypothesis.class_id",
                         "confidence": "detections.*.results.*.hypothesis.score"}},
     "action": {"topic": "/did", "label": "data"},
     "trial": {"topic": "/trial", "label": "data"}}
"""

from __future__ import annotations

import errno
import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final, NamedTuple

from atg_fg.core.checks import brief, plain_text
from atg_fg.core.errors import AtgError, InvalidInputError, needed_by
from atg_fg.core.recordings import RecordedLook, RecordedTrial, Recording, used_labels
from atg_fg.storage.checked_json import parse_json, read_object
from atg_fg.storage.limits import refuse_size, unpacked_limit
from atg_fg.storage.plain_files import read_text_file

#: Looks of one bag, at most.
MAX_LOOKS: Final = 1_000_000
_LONGEST: Final = 1000


class TopicField(NamedTuple):
    """Where something is published.

    Attributes:
        topic: Name of it.
        label: Path of the field: names and indices with dots between them, ``*`` for all of a list; a text with more of
            the path to come is read as JSON.
        confidence: Path of how sure the detector is of each label, if it says so.
    """

    topic: str
    label: str
    confidence: str | None = None


class BagTopics(NamedTuple):
    """Where all that a recording needs is published.

    Attributes:
        slots: Of each slot.
        action: What was done, after it was done, or when it began: it ends the look before it.
        trial: Begins a new trial, named so; without, the bag is one trial.
        object: What is presented in the present trial, for scoring and teaching.
    """

    slots: Mapping[str, TopicField]
    action: TopicField
    trial: TopicField | None = None
    object: TopicField | None = None


def read_topics(path: Path | str) -> BagTopics:
    """Return what a file of topics says.

    Raises:
        InvalidInputError: It cannot be read, or anything in it is not as it should be.
    """
    fields = read_object(
        parse_json(read_text_file(path), str(path)), str(path), ("slots", "action"), ("trial", "object")
    )
    slots = fields["slots"]
    if not isinstance(slots, dict) or not slots:
        raise InvalidInputError(f"{path}: slots: {brief(slots)}; expected an object with a topic for each slot")
    return BagTopics(
        {slot: _topic_field(value, f"{path}: slots: {slot}") for slot, value in slots.items()},
        _topic_field(fields["action"], f"{path}: action"),
        *(_topic_field(fields[key], f"{path}: {key}") if key in fields else None for key in ("trial", "object")),
    )


def _topic_field(value: Any, place: str) -> TopicField:
    fields = read_object(value, place, ("topic", "label"), ("confidence",))
    return TopicField(**{key: plain_text(text, f"{place}: {key}") for key, text in fields.items()})


def read_bag(path: Path, topics: BagTopics) -> Recording:
    """Return the recording in a bag, read here: ``bag_process.read_bag`` reads what comes from strangers.

    Of several messages between two actions the label of the greatest confidence counts, the last one where none is
    stated.

    Raises:
        InvalidInputError: The bag cannot be read, has no such topic, a type that is not known, or no such field.
        MissingDependencyError: `rosbags` is not installed.
    """
    with needed_by("bags", "rosbags", "ros"):
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    with ExitStack() as stack:
        try:
            if not all(os.path.isfile(each) or os.path.isdir(each) for each in _parts_of(path)):
                raise OSError(errno.EINVAL, "no plain file" if os.path.exists(path) else "no such file")
            folder = stack.enter_context(_folder_of(path)) if path.suffix == ".mcap" else path
            reader = stack.enter_context(AnyReader([folder], default_typestore=get_typestore(Stores.LATEST)))
        except Exception as error:  # whatever the library makes of what is no bag
            raise unreadable(path, error) from error
        trials = _Trials(path, topics)
        for number, (topic, message) in enumerate(_messages(reader, path, topics)):
            trials.take(topic, message, f"{path}: message {number} of {topic}")
        return trials.recording()


@contextmanager
def _folder_of(path: Path) -> Iterator[Path]:
    """Give a folder of rosbag2 that has an MCAP file which lies by itself."""
    from rosbags.rosbag2.storage_mcap import McapReader

    mcap = McapReader(path)
    mcap.open()
    topics = [
        {
            "topic_metadata": {"name": each.topic, "type": each.msgtype, "serialization_format": "cdr"},
            "message_count": each.msgcount,
        }
        for each in mcap.connections
    ]
    about = mcap.metadata
    mcap.close()
    document = {
        "version": 5,
        "storage_identifier": "mcap",
        "relative_file_paths": [path.name],
        "duration": {"nanoseconds": about.duration},
        "starting_time": {"nanoseconds_since_epoch": about.start_time},
        "message_count": about.message_count,
        "topics_with_message_count": topics,
    }
    with tempfile.TemporaryDirectory(prefix="atg-fg-") as name:
        (Path(name) / path.name).symlink_to(path.resolve())
        # YAML takes JSON as it is.
        (Path(name) / "metadata.yaml").write_text(json.dumps({"rosbag2_bagfile_information": document}))
        yield Path(name)


def size_of(path: Path) -> int:
    """Return how many bytes there are in a bag: a file, or the files of a folder."""
    return sum(each.stat().st_size for each in _parts_of(path) if os.path.isfile(each))


def _parts_of(path: Path) -> list[Path]:
    """Return a bag and, if it is a folder, what lies in it."""
    return [path, *(path.iterdir() if os.path.isdir(path) else ())]


def unreadable(path: Path, error: Exception) -> AtgError:
    """Return the error about a bag that its library cannot read."""
    if isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno == errno.EFBIG):
        return refuse_size(path, unpacked_limit(size_of(path)))
    reason = (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
    return InvalidInputError(
        f"{path}: cannot be read: {' '.join(reason.split()):.200}; "
        "expected a bag: a folder of rosbag2, an .mcap file, or a .bag of ROS 1"
    )


def _messages(reader: Any, path: Path, topics: BagTopics) -> Iterator[tuple[str, Any]]:
    """Yield topic and message of all that matters, in the order of time."""
    wanted = {each.topic for each in (*topics.slots.values(), topics.action, topics.trial, topics.object) if each}
    there = {connection.topic: connection.msgtype for connection in reader.connections}
    for topic in sorted(wanted):
        if topic not in there:
            raise InvalidInputError(f"{path}: no topic {topic!r}; expected one of: {', '.join(sorted(there))}")
        if there[topic] not in reader.typestore.fielddefs:
            raise InvalidInputError(
                f"{path}: topic {topic!r}: type {there[topic]!r} is not known; expected a bag that holds its definition"
            )
    connections = [connection for connection in reader.connections if connection.topic in wanted]
    messages = reader.messages(connections=connections)
    while True:
        try:
            connection, _, raw = next(messages)
            message = reader.deserialize(raw, connection.msgtype)
        except StopIteration:
            return
        except Exception as error:  # whatever the library makes of damaged data
            raise unreadable(path, error) from error
        yield connection.topic, message


class _Trials:
    """Makes trials of messages as they come."""

    def __init__(self, path: Path, topics: BagTopics) -> None:
        self._path, self._topics = path, topics
        self._done: dict[str, RecordedTrial] = {}
        self._n_looks = 0
        self._begin(path.stem)

    def _begin(self, name: str) -> None:
        self._name = name
        self._object: str | None = None
        self._looks: list[RecordedLook] = []
        self._actions: list[str] = []
        self._seen: dict[str, tuple[str, float | None]] = {}
        self._looked = False

    def take(self, topic: str, message: Any, place: str) -> None:
        """Take in the next message; one topic may have several fields."""
        topics = self._topics
        if topics.trial is not None and topics.trial.topic == topic:
            self._end_trial(place)
            self._begin(_one_text(message, topics.trial, place))
        if topics.object is not None and topics.object.topic == topic:
            self._object = _one_text(message, topics.object, place)
        for slot, field in topics.slots.items():
            if field.topic == topic:
                self._look(slot, field, message, place)
        if topics.action.topic == topic:
            self._end_look()
            self._actions.append(_one_text(message, topics.action, place))

    def _look(self, slot: str, field: TopicField, message: Any, place: str) -> None:
        self._looked = True
        labels = list(_values(message, field.label, place))
        stated = list(_values(message, field.confidence, place)) if field.confidence else []
        if stated and len(stated) != len(labels):
            raise InvalidInputError(f"{place}: {len(labels)} labels, {len(stated)} confidences; expected one for each")
        for value, sure in zip_longest(labels, stated):
            label, confidence = _text(value, place), None if sure is None else _confidence(sure, place)
            before = self._seen.get(slot)
            if label and (before is None or (confidence or 0.0) >= (before[1] or 0.0)):
                self._seen[slot] = label, confidence

    def _end_look(self) -> None:
        found = [self._seen.get(slot, (None, None)) for slot in self._topics.slots]
        self._looks.append(RecordedLook(tuple(label for label, _ in found), tuple(sure for _, sure in found)))
        self._seen, self._looked = {}, False
        self._n_looks += 1
        if self._n_looks > MAX_LOOKS:
            raise InvalidInputError(f"{self._path}: more than {MAX_LOOKS:,} looks; expected fewer")

    def _end_trial(self, place: str) -> None:
        if not (self._looked or self._actions):
            return
        self._end_look()
        if self._name in self._done:
            raise InvalidInputError(f"{place}: trial {brief(self._name)} again; expected unique names of trials")
        self._done[self._name] = RecordedTrial(self._name, tuple(self._looks), tuple(self._actions), self._object)

    def recording(self) -> Recording:
        """Return all trials, the last one ended."""
        self._end_trial(str(self._path))
        trials = tuple(self._done.values())
        if not trials:
            raise InvalidInputError(f"{self._path}: no looks in its topics; expected at least one")
        actions = tuple(sorted({action for trial in trials for action in trial.actions}))
        return Recording(
            tuple(self._topics.slots), actions, tuple(sorted(used_labels(trials))), trials, place=str(self._path)
        )


def _values(value: Any, path: str, place: str) -> Iterator[Any]:
    """Yield what is at a path in a message."""
    name, _, rest = path.partition(".")
    if isinstance(value, str):
        value = parse_json(value, place)
    if name == "*":
        if not hasattr(value, "__len__") or isinstance(value, Mapping):
            raise InvalidInputError(f"{place}: {brief(value)}; expected a list, for the path {path!r}")
        found = list(value)
    elif isinstance(value, Mapping):
        found = [value.get(name)] if name in value else _no_field(name, list(value), place)
    elif name.isdigit() and hasattr(value, "__len__"):
        found = [value[int(name)]] if int(name) < len(value) else []
    elif hasattr(value, "__dataclass_fields__") and name in value.__dataclass_fields__:
        found = [getattr(value, name)]
    else:
        found = _no_field(name, [each for each in getattr(value, "__dataclass_fields__", ()) if each[0] != "_"], place)
    for each in found:
        if rest:
            yield from _values(each, rest, place)
        else:
            yield each


def _no_field(name: str, known: list[str], place: str) -> list[Any]:
    raise InvalidInputError(f"{place}: no field {name!r}; expected one of: {', '.join(map(str, known)) or 'none'}")


def _one_text(message: Any, field: TopicField, place: str) -> str:
    found = list(_values(message, field.label, place))
    if len(found) != 1 or not (text := _text(found[0], place)):
        raise InvalidInputError(f"{place}: {field.label}: {brief(found)}; expected one name")
    return text


def _text(value: Any, place: str) -> str:
    """Return a name: a text, or the number that stands for one, as a marker's; empty for nothing."""
    if value is None:
        return ""
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, (str, int)) or len(str(value)) > _LONGEST:
        raise InvalidInputError(f"{place}: {brief(value)}; expected a name or a whole number")
    text = str(value).strip()
    return plain_text(text, place) if text else ""


def _confidence(value: Any, place: str) -> float:
    found = float(value) if isinstance(value, (int, float)) or hasattr(value, "item") else -1.0
    if not 0 <= found <= 1:
        raise InvalidInputError(f"{place}: confidence {brief(value)}; expected a number from 0 to 1")
    return found


def is_bag(path: Path) -> bool:
    """Return whether a path is that of a bag, by its name: a folder with ``metadata.yaml``, ``.mcap`` or ``.bag``."""
    return path.suffix in (".mcap", ".bag", ".db3") or (os.path.isdir(path) and os.path.exists(path / "metadata.yaml"))
