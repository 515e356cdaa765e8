"""A sense as a section of a memory file, checked on the way in: its space, and what its classes were made from."""

from __future__ import annotations

from typing import Any

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import GREATEST, number, plain_text
from atg_fg.core.errors import InvalidInputError, placed
from atg_fg.core.sense import Sense, SensedTrial
from atg_fg.senses.appearance import AppearanceSense
from atg_fg.senses.feature_space import FeatureSpace
from atg_fg.storage.checked_json import read_entries, read_list, read_object


def write_sense(sense: Sense, assumptions: Assumptions) -> dict[str, Any]:
    """Return a sense as JSON knows it."""
    if not isinstance(sense, AppearanceSense):
        raise InvalidInputError(f"sense: {type(sense).__name__}; expected an AppearanceSense, which files can hold")
    return {**write_settings(sense), "trials": [write_sensed_trial(trial, assumptions) for trial in sense.trials]}


def write_settings(sense: AppearanceSense) -> dict[str, Any]:
    """Return all of a sense but what it has learned."""
    return {**sense.space.to_document(), "within": sense.codebook.within, "concentration": sense.codebook.concentration}


def write_sensed_trial(trial: SensedTrial, assumptions: Assumptions) -> dict[str, Any]:
    """Return a trial of a sense as JSON knows it."""
    return {
        "object": trial.owner,
        "readings": [[None if slot is None else list(slot) for slot in look] for look in trial.readings],
        "classes": [list(detection) for detection in trial.detections],
        "actions": [assumptions.actions[action] for action in trial.actions],
    }


def read_sense(value: Any, assumptions: Assumptions, place: str) -> AppearanceSense:
    """Return the sense at ``place``.

    Raises:
        InvalidInputError: Anything malformed; the message names the place.
    """
    keys = ("features", "mean", "projection", "between", "within", "concentration", "trials")
    fields = read_object(value, place, keys)
    rows = read_entries(fields["projection"], f"{place}.projection")
    width = len(read_list(fields["between"], f"{place}.between"))
    projection = [_numbers(row, where, width) for row, where in rows]
    settings = {name: number(fields[name], f"{place}.{name}") for name in ("within", "concentration")}
    with placed(place):
        space = FeatureSpace(
            plain_text(fields["features"], "features"),
            np.array(_numbers(fields["mean"], "mean", len(rows))),
            np.array(projection, dtype=np.float64).reshape(len(rows), width),
            np.array(_numbers(fields["between"], "between", width)),
        )
        sense = AppearanceSense(space, assumptions.alphabet, **settings)
    entries = read_entries(fields["trials"], f"{place}.trials")
    sense.restore([_read_trial(entry, assumptions, space.n_dimensions, where) for entry, where in entries])
    return sense


def _read_trial(value: Any, assumptions: Assumptions, n_dimensions: int, place: str) -> SensedTrial:
    fields = read_object(value, place, ("object", "readings", "classes", "actions"))
    names = read_entries(fields["actions"], f"{place}.actions")
    actions = [assumptions.action_index(name, where) for name, where in names]
    looks = {key: read_entries(fields[key], f"{place}.{key}") for key in ("readings", "classes")}
    for key, found in looks.items():
        if len(found) != len(actions) + 1:
            raise InvalidInputError(
                f"{place}.{key}: {len(found)} looks, {len(actions)} actions; expected one look more"
            )
    readings = []
    for look, where in looks["readings"]:
        slots = read_entries(look, where, len(assumptions.alphabet.slots))
        readings.append(tuple(slot if slot is None else tuple(_numbers(slot, at, n_dimensions)) for slot, at in slots))
    detections = []
    for (look, where), read in zip(looks["classes"], readings, strict=True):
        detection = assumptions.alphabet.check_detection(read_list(look, where), where)
        unread = [symbol for symbol, reading in zip(detection, read, strict=True) if reading is None]
        if any(symbol is not None for symbol in unread):
            raise InvalidInputError(f"{where}: a class where nothing was measured; expected null")
        detections.append(detection)
    owner = plain_text(fields["object"], f"{place}.object")
    return SensedTrial(owner, tuple(readings), tuple(detections), tuple(actions))


def _numbers(value: Any, place: str, length: int) -> list[float]:
    return [number(entry, where, -GREATEST, GREATEST) for entry, where in read_entries(value, place, length)]
