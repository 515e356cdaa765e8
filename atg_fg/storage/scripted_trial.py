"""Scripted trials as JSON, checked.

Version 2 has what version 1 has, and alphabets whose slots do not exclude each other, the likelihood of each symbol in
place of a symbol, and confidences.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from atg_fg.core.checks import brief, number
from atg_fg.core.errors import InvalidInputError, placed
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import check_measured
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Confidences, Evidence, PatternAlphabet
from atg_fg.core.slot_checks import check_confidences
from atg_fg.storage.checked_json import check_format, parse_json, read_entries, read_list, read_object
from atg_fg.storage.memory_json import read_assumptions, read_memory

SCRIPT_FORMAT: Final = "atg-fg/scripted-trial"
_KEYS = ("format", "version", "assumptions", "parameters", "memory", "steps")
_PARAMETERS = ("transition_concentration", "observation_noise", "learn_in_trial")


@dataclass(frozen=True, eq=False)
class ScriptedTrial:
    """A trial whose every look and action is given.

    Attributes:
        memory: The robot memory when the trial begins.
        parameters: α, δ and whether to learn within the trial.
        steps: Evidence of a look, or the index of an action, in turn; a look is first.
        place: Where the script came from, for error messages.
    """

    memory: RobotMemory
    parameters: ModelParameters
    steps: tuple[Evidence | int, ...]
    place: str


def read_script(text: str, place: str = "script") -> ScriptedTrial:
    """Return the scripted trial in a JSON document.

    Raises:
        InvalidInputError: Anything malformed; the message names the place in the document.
    """
    document = read_object(parse_json(text, place), place, _KEYS)
    version = check_format(document, SCRIPT_FORMAT, place, newest=2)
    for key in ("exclusive", "object_senses"):
        if version == 1 and isinstance(document["assumptions"], dict) and key in document["assumptions"]:
            raise InvalidInputError(f"{place}: assumptions: {key!r} in version 1; expected it in version 2 alone")
    assumptions = read_assumptions(document["assumptions"], f"{place}: assumptions")
    fields = read_object(document["parameters"], f"{place}: parameters", _PARAMETERS)
    try:
        parameters = ModelParameters(**fields)
    except InvalidInputError as error:
        raise InvalidInputError(f"{place}: parameters.{error}") from error
    memory = read_memory(document["memory"], assumptions, f"{place}: memory")
    steps = read_entries(document["steps"], f"{place}: steps")
    if not steps:
        raise InvalidInputError(f"{place}: steps: empty; expected an observation first")
    read = [_read_step(step, index, memory, version, where) for index, (step, where) in enumerate(steps)]
    return ScriptedTrial(memory, parameters, tuple(read), place)


def _read_step(value: Any, index: int, memory: RobotMemory, version: int, place: str) -> Evidence | int:
    kind = "act" if index % 2 else "observe"
    if isinstance(value, dict) and list(value) == ["observe" if kind == "act" else "act"]:
        order = "an observation is first" if index == 0 else "observations and actions alternate"
        raise InvalidInputError(f"{place}: {next(iter(value))!r}; expected {kind!r}, since {order}")
    step = read_object(value, place, (kind,), ("confidences", "measured") if version > 1 and kind == "observe" else ())
    if kind == "act":
        return memory.assumptions.action_index(step["act"], f"{place}.act")
    alphabet = memory.assumptions.alphabet
    seen, where = step["observe"], f"{place}.observe"
    stated = read_list(step.get("confidences", []), f"{place}.confidences")
    confidences = check_confidences(stated, len(alphabet.slots), f"{place}.confidences")
    measured = check_measured(memory.assumptions.object_senses, step.get("measured", {}), f"{place}.measured")
    if version > 1 and isinstance(seen, dict):
        return _read_slots(seen, confidences, alphabet, where).with_readings(measured)
    detection = alphabet.check_detection(read_list(seen, where), where)
    return Evidence.of_detection(alphabet, detection, confidences).with_readings(measured)


def _read_slots(seen: dict[str, Any], confidences: Confidences, alphabet: PatternAlphabet, place: str) -> Evidence:
    """Return the evidence of a look that says of each slot by name a symbol, null, or weights by symbol."""
    entries = read_object(seen, place, alphabet.slots)
    labels: list[Any] = []
    likelihoods: list[list[float] | None] = []
    for slot in alphabet.slots:
        entry, where = entries[slot], f"{place}, slot {slot!r}"
        soft = _read_weights(entry, alphabet.n_symbols, where) if isinstance(entry, dict) else None
        likelihoods.append(soft)
        labels.append(entry if soft is None else None)
    detection = alphabet.check_detection(labels, place)
    with placed(place):
        return Evidence.of_slots(alphabet, likelihoods, detection, confidences)


def _read_weights(entries: dict[str, Any], n_symbols: int, place: str) -> list[float]:
    weights = [0.0] * n_symbols
    for symbol, weight in entries.items():
        if not symbol.isascii() or not symbol.isdigit() or str(int(symbol[:9])) != symbol or int(symbol) >= n_symbols:
            raise InvalidInputError(f"{place}: symbol {brief(symbol)}; expected '0' to '{n_symbols - 1}'")
        weights[int(symbol)] = number(weight, f"{place}, symbol {symbol}", 0.0)
    return weights
