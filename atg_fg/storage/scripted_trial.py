"""Scripted trials as JSON, checked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.storage.checked_json import check_format, parse_json, read_list, read_object
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
    check_format(document, SCRIPT_FORMAT, place)
    assumptions = read_assumptions(document["assumptions"], f"{place}: assumptions")
    fields = read_object(document["parameters"], f"{place}: parameters", _PARAMETERS)
    try:
        parameters = ModelParameters(**fields)
    except InvalidInputError as error:
        raise InvalidInputError(f"{place}: parameters.{error}") from error
    memory = read_memory(document["memory"], assumptions, f"{place}: memory")
    steps = read_list(document["steps"], f"{place}: steps")
    if not steps:
        raise InvalidInputError(f"{place}: steps: empty; expected an observation first")
    read = [_read_step(step, index, memory, f"{place}: steps[{index}]") for index, step in enumerate(steps)]
    return ScriptedTrial(memory, parameters, tuple(read), place)


def _read_step(value: Any, index: int, memory: RobotMemory, place: str) -> Evidence | int:
    kind = "act" if index % 2 else "observe"
    if isinstance(value, dict) and list(value) == ["observe" if kind == "act" else "act"]:
        order = "an observation is first" if index == 0 else "observations and actions alternate"
        raise InvalidInputError(f"{place}: {next(iter(value))!r}; expected {kind!r}, since {order}")
    step = read_object(value, place, (kind,))
    if kind == "act":
        return memory.assumptions.action_index(step["act"], f"{place}.act")
    alphabet = memory.assumptions.alphabet
    detection = read_list(step["observe"], f"{place}.observe")
    return Evidence.of_detection(alphabet, alphabet.check_detection(detection, f"{place}.observe"))
