"""Recordings of a user's own detector on disk (``atg-fg/recording``): CSV, or JSON lines with a header.

Both say the same. A header, or a spec file beside a CSV, says what rows do not: slots, actions, labels, the number of
objects and of aspects, whether slots exclude each other, and what is known of senses of the object beforehand.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from atg_fg.core.checks import brief, distinct_names, listed, number, plain_text, whole_number
from atg_fg.core.errors import InvalidInputError, placed
from atg_fg.core.object_sense import GREATEST_READING, ObjectSense
from atg_fg.core.patterns import Measured
from atg_fg.core.recordings import RecordedLook, RecordedTrial, Recording, senses_of, used_labels
from atg_fg.storage.checked_json import check_format, parse_json, read_entries, read_list, read_object, without_none
from atg_fg.storage.object_sense_json import read_object_senses, write_object_sense
from atg_fg.storage.plain_files import read_text_file, write_bytes_atomically
from atg_fg.storage.recording_csv import CsvReader, Fault
from atg_fg.storage.recording_csv_writing import write_csv
from atg_fg.storage.recording_oddities import oddities

RECORDING_FORMAT: Final = "atg-fg/recording"


class RecordingSpec(NamedTuple):
    """What rows alone do not say of a recording; ``None`` of what is found in them.

    Attributes:
        slots: Names of the slots.
        actions: All that may occur.
        labels: All that may occur.
        n_objects: |O|.
        n_aspects: |G|.
        exclusive: Whether a label is in one slot only.
        senses: Of the object: what is known of each, or its name.
    """

    slots: tuple[str, ...] | None = None
    actions: tuple[str, ...] | None = None
    labels: tuple[str, ...] | None = None
    n_objects: int | None = None
    n_aspects: int | None = None
    exclusive: bool | None = None
    senses: tuple[ObjectSense | str, ...] | None = None


_KEYS: Final = ("slots", "actions", "labels", "objects", "aspects", "exclusive", "senses")


def read_spec(path: Path | str) -> RecordingSpec:
    """Return what a spec file says: a JSON object with some of the keys of a header.

    Raises:
        InvalidInputError: It cannot be read, or anything in it is not as it should be.
    """
    return _spec(parse_json(read_text_file(path), str(path)), str(path))


def _spec(value: Any, place: str, keys: tuple[str, ...] = ()) -> RecordingSpec:
    fields = read_object(value, place, keys, tuple(key for key in _KEYS if key not in keys))
    names = {
        key: _names(read_list(fields[key], f"{place}: {key}"), f"{place}: {key}")
        for key in ("slots", "actions", "labels")
        if key in fields
    }
    numbers = {
        key: whole_number(fields[key], f"{place}: {key}", least=1) for key in ("objects", "aspects") if key in fields
    }
    if names.get("slots") == ():
        raise InvalidInputError(f"{place}: slots: []; expected at least one")
    exclusive = fields.get("exclusive")
    if exclusive is not None and not isinstance(exclusive, bool):
        raise InvalidInputError(f"{place}: exclusive: {brief(exclusive)}; expected true or false")
    return RecordingSpec(
        **names,
        n_objects=numbers.get("objects"),
        n_aspects=numbers.get("aspects"),
        exclusive=exclusive,
        senses=_senses(fields["senses"], f"{place}: senses") if "senses" in fields else None,
    )


def _senses(value: Any, place: str) -> tuple[ObjectSense | str, ...]:
    senses = tuple(
        plain_text(each, place) if isinstance(each, str) else read_object_senses([each], place)[0]
        for each in read_list(value, place)
    )
    if senses:
        distinct_names([each if isinstance(each, str) else each.name for each in senses], place)
    return senses


def _names(values: Sequence[Any], place: str) -> tuple[str, ...]:
    """Return names, or raise ``InvalidInputError`` unless they are texts, all different; there may be none."""
    names = [plain_text(name, f"{place}[{index}]") for index, name in enumerate(values)]
    return distinct_names(names, place) if names else ()


def merged_spec(*specs: RecordingSpec) -> RecordingSpec:
    """Return what several say; of what two say the first counts."""
    return RecordingSpec(
        *(next((each for each in found if each is not None), None) for found in zip(*specs, strict=True))
    )


def read_recording(path: Path | str, spec: RecordingSpec | None = None) -> Recording:
    """Return the recording in a file: CSV, or JSON lines; either may be gzipped.

    Args:
        path: The file.
        spec: What it does not say itself, or says otherwise.

    Raises:
        InvalidInputError: It cannot be read, or something in it is not as it should be; the message names line, column
            and value.
    """
    recording, faults = _read(path, spec or RecordingSpec())
    fatal = next((fault for fault in faults if fault.fatal), None)
    if fatal is not None:
        raise InvalidInputError(f"{path}: {fatal}")
    return recording


def check_recording(path: Path | str, spec: RecordingSpec | None = None) -> tuple[Recording, list[Fault]]:
    """Return what can be made of a recording, and all that is odd in it.

    Raises:
        InvalidInputError: It cannot be read at all.
    """
    recording, faults = _read(path, spec or RecordingSpec())
    return recording, [*faults, *oddities(recording)]


def completed(recording: Recording, spec: RecordingSpec) -> Recording:
    """Return a recording with what a spec says of it besides.

    Raises:
        InvalidInputError: It has other slots, or labels or actions that the spec does not know.
    """
    if spec.slots not in (None, recording.slots):
        raise InvalidInputError(
            f"{recording.place}: slots {listed(recording.slots)}; expected {listed(spec.slots or ())}"
        )
    for kind, found, known in (("label", recording.labels, spec.labels), ("action", recording.actions, spec.actions)):
        for name in found:
            if known is not None and name not in known:
                raise InvalidInputError(f"{recording.place}: {kind} {brief(name)}; expected one of: {listed(known)}")
    own = RecordingSpec(
        recording.slots,
        recording.actions,
        recording.labels,
        recording.n_objects,
        recording.n_aspects,
        recording.exclusive or None,
        recording.senses,
    )
    return _made(recording.trials, merged_spec(spec, own), recording.labels, recording.place)


def write_recording(recording: Recording, path: Path | str) -> None:
    """Write a recording, atomically: JSON lines if the name ends in ``.jsonl``, else CSV.

    Raises:
        InvalidInputError: The file cannot be written.
    """
    if str(path).endswith(".jsonl"):
        lines = [header_of(recording), *map(trial_document, recording.trials)]
        text = "".join(f"{json.dumps(line)}\n" for line in lines)
    else:
        text = write_csv(recording)
    write_bytes_atomically(path, text.encode())


def _read(path: Path | str, spec: RecordingSpec) -> tuple[Recording, list[Fault]]:
    text = read_text_file(path, packed=True)
    if text.lstrip(" \n").startswith("{"):
        return _of_lines(text, str(path), spec), []
    with placed(str(path)):
        reader = CsvReader(text, spec.slots, spec.labels, spec.actions, spec.senses or ())
        trials = reader.trials()
    columns = [name for weights in reader.columns.weights for _, name in weights]
    senses = _with_found(spec.senses or (), [name for _, name in reader.columns.readings])
    return _made(trials, spec._replace(slots=reader.columns.slots, senses=senses), columns, str(path)), reader.faults


def _with_found(senses: Sequence[ObjectSense | str], found: Iterable[str]) -> tuple[ObjectSense | str, ...]:
    """Return senses, and after them the names of those that were found and are not among them."""
    by_name = {each if isinstance(each, str) else each.name: each for each in senses}
    return tuple({**{name: name for name in found if name not in by_name}, **by_name}.values())


def _made(trials: Sequence[RecordedTrial], spec: RecordingSpec, labels: Sequence[str], place: str) -> Recording:
    """Return trials with what the spec says, and else with what occurs in them."""
    actions = spec.actions or tuple(sorted({action for trial in trials for action in trial.actions if action}))
    return Recording(
        spec.slots or (),
        actions or ("wait",),
        spec.labels or tuple(sorted({*labels, *used_labels(trials)})) or ("nothing",),
        tuple(trials),
        spec.n_objects,
        spec.n_aspects,
        bool(spec.exclusive),
        place,
        _with_found(spec.senses or (), senses_of(trials)),
    )


def _of_lines(text: str, place: str, spec: RecordingSpec) -> Recording:
    lines = enumerate(text.split("\n"), 1)
    places = ((f"{place}: line {index}", line) for index, line in lines if line.strip())
    head, first = next(places)
    header = parse_json(first, head)
    if not isinstance(header, dict) or "format" not in header:
        raise InvalidInputError(f"{head}: {brief(header)}; expected a header with format {RECORDING_FORMAT!r}")
    return recording_of(header, head, ((where, parse_json(line, where)) for where, line in places), place, spec)


def recording_of(
    header: Any, head: str, documents: Iterable[tuple[str, Any]], place: str, spec: RecordingSpec
) -> Recording:
    """Return the recording in a header and trials as JSON knows them.

    Args:
        header: What is said of all trials.
        head: Where that stands, for error messages.
        documents: Each trial, with its place.
        place: Of the recording.
        spec: What it does not say itself, or says otherwise.
    """
    check_format({"version": None, **header}, RECORDING_FORMAT, head)
    own = {name: value for name, value in header.items() if name not in ("format", "version")}
    spec = merged_spec(spec, _spec(own, head, ("slots",)))
    trials = [_read_trial(document, where, spec) for where, document in documents]
    if not trials:
        raise InvalidInputError(f"{head}: no trials after it; expected at least one")
    name, times = Counter(trial.name for trial in trials).most_common(1)[0]
    if times > 1:
        raise InvalidInputError(f"{place}: trial {name!r} is repeated; expected unique names of trials")
    return _made(trials, spec, (), place)


def _read_trial(value: Any, place: str, spec: RecordingSpec) -> RecordedTrial:
    fields = read_object(value, place, ("trial", "actions", "looks"), ("object", "confidences", "measured"))
    slots = spec.slots or ()
    looks = read_list(fields["looks"], f"{place}: looks")
    actions = read_entries(fields["actions"], f"{place}: actions")
    if not looks or len(actions) != len(looks) - 1:
        raise InvalidInputError(f"{place}: {len(looks)} looks, {len(actions)} actions; expected one look more")
    for action, where in actions:
        plain_text(action, where)
        if spec.actions is not None and action not in spec.actions:
            raise InvalidInputError(f"{where}: {brief(action)}; expected one of: {listed(spec.actions)}")
    stated = read_list(fields.get("confidences", [[]] * len(looks)), f"{place}: confidences", len(looks))
    felt = read_list(fields.get("measured", [None] * len(looks)), f"{place}: measured", len(looks))
    made = tuple(
        _read_look(look, sure, slots, f"{place}: look {index}", spec)._replace(
            measured=_read_measured(readings, spec, f"{place}: look {index}: measured")
        )
        for index, (look, sure, readings) in enumerate(zip(looks, stated, felt, strict=True))
    )
    presented = fields.get("object")
    name = (
        fields["trial"] if isinstance(fields["trial"], str) else str(whole_number(fields["trial"], f"{place}: trial"))
    )
    return RecordedTrial(
        plain_text(name, f"{place}: trial"),
        made,
        tuple(action for action, _ in actions),
        None if presented is None else plain_text(presented, f"{place}: object"),
    )


def _read_look(value: Any, sure: Any, slots: tuple[str, ...], place: str, spec: RecordingSpec) -> RecordedLook:
    entries = [None] * len(slots) if value is None else read_list(value, place)
    stated = read_list([] if sure is None else sure, f"{place}: confidences")
    if len(entries) != len(slots) or len(stated) not in (0, len(slots)):
        raise InvalidInputError(
            f"{place}: {brief(value)}, {brief(sure)}; expected an entry for each of {listed(slots)}"
        )
    labels: list[str | None] = []
    weights: list[Mapping[str, float] | None] = []
    for slot, entry in zip(slots, entries, strict=True):
        where = f"{place}, slot {slot!r}"
        given = entry if isinstance(entry, dict) else {} if entry is None else {plain_text(entry, where): 1.0}
        for label, weight in given.items():
            number(weight, f"{where}: {plain_text(label, where)}", 0.0)
            if spec.labels is not None and label not in spec.labels:
                raise InvalidInputError(f"{where}: {brief(label)}; expected one of: {listed(spec.labels)}")
        if isinstance(entry, dict) and not any(given.values()):
            raise InvalidInputError(f"{where}: {brief(entry)}; expected a likelihood above 0")
        labels.append(entry if isinstance(entry, str) else None)
        weights.append(given if isinstance(entry, dict) else None)
    sureness = [None if each is None else number(each, f"{place}: confidences", 0.0, 1.0) for each in stated]
    # As in a table, a confidence without a label says nothing.
    confidences = tuple(each if label else None for each, label in zip(sureness, labels, strict=False))
    return RecordedLook(tuple(labels), confidences, tuple(weights) if any(weights) else ())


def _read_measured(value: Any, spec: RecordingSpec, place: str) -> Measured:
    readings = {} if value is None else value
    if not isinstance(readings, dict):
        raise InvalidInputError(f"{place}: {brief(value)}; expected readings by name, or null")
    known = {each.name: each for each in spec.senses or () if isinstance(each, ObjectSense)}
    found = {
        plain_text(name, place): number(reading, f"{place}: {name}", -GREATEST_READING, GREATEST_READING)
        for name, reading in readings.items()
    }
    return tuple((name, known[name].check(value, place) if name in known else value) for name, value in found.items())


def header_of(recording: Recording) -> dict[str, Any]:
    """Return what is said of all trials as JSON knows it."""
    return without_none(
        {
            "format": RECORDING_FORMAT,
            "version": 1,
            "slots": list(recording.slots),
            "actions": list(recording.actions),
            "labels": list(recording.labels),
            "objects": recording.n_objects,
            "aspects": recording.n_aspects,
            "exclusive": recording.exclusive or None,
            "senses": [each if isinstance(each, str) else write_object_sense(each) for each in recording.senses]
            or None,
        }
    )


def trial_document(trial: RecordedTrial) -> dict[str, Any]:
    """Return a trial as JSON knows it."""
    looks = [
        [
            dict(look.weights[slot] or {}) if look.weights and look.weights[slot] else label
            for slot, label in enumerate(look.labels)
        ]
        for look in trial.looks
    ]
    sure = any(value is not None for look in trial.looks for value in look.confidences)
    confidences = [list(look.confidences) for look in trial.looks] if sure else None
    measured = [dict(look.measured) or None for look in trial.looks]
    return without_none(
        {
            "trial": trial.name,
            "object": trial.object,
            "actions": list(trial.actions),
            "looks": looks,
            "confidences": confidences,
            "measured": measured if any(measured) else None,
        }
    )
