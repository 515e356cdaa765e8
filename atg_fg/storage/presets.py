"""Presets: useful sets of model parameters by name, and those that a user's own calibration wrote to a file."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any, Final

from atg_fg.core.errors import InvalidInputError, placed, unknown_name
from atg_fg.core.parameters import ModelParameters
from atg_fg.storage.checked_json import check_format, parse_json, read_object
from atg_fg.storage.plain_files import read_text_file

PRESET_FORMAT: Final = "atg-fg/preset"
_PARAMETERS: Final = ("transition_concentration", "observation_noise", "learn_in_trial")
#: Left out where it is as usual.
_OPTIONAL: Final = ("learn_structure",)


def write_preset(parameters: ModelParameters, **about: Any) -> dict[str, Any]:
    """Return parameters as a preset document, with what is to be known of where they come from."""
    values = {name: getattr(parameters, name) for name in _PARAMETERS}
    values |= {name: True for name in _OPTIONAL if getattr(parameters, name)}
    return {"format": PRESET_FORMAT, "version": 1, "parameters": values, **about}


def read_preset(text: str, place: str) -> ModelParameters:
    """Return the parameters of a preset document.

    Raises:
        InvalidInputError: Not such a document, or a parameter out of its range; the message names the place.
    """
    document = parse_json(text, place)
    if not isinstance(document, dict) or not {"format", "version", "parameters"} <= document.keys():
        raise InvalidInputError(f"{place}: expected an object with format, version and parameters")
    check_format(document, PRESET_FORMAT, place)
    values = read_object(document["parameters"], f"{place}: parameters", _PARAMETERS, _OPTIONAL)
    with placed(f"{place}: parameters"):
        return ModelParameters(**values)


_ROBOT: Final = (files("atg_fg.storage") / "data" / "robot.json").read_text(encoding="utf-8")

#: ``paper`` takes the paper at its word, and assumes next to no noise; ``default`` also learns within the trial;
#: ``robot`` assumes the noise that was measured on the simulated robot; ``learned`` is ``default`` for objects that may
#: follow a structure which all share, learned from all trials.
PRESETS: Final[Mapping[str, ModelParameters]] = {
    "paper": ModelParameters(1e-8, 1e-8, learn_in_trial=False),
    "default": ModelParameters(1e-8, 1e-8, learn_in_trial=True),
    "robot": read_preset(_ROBOT, "robot.json"),
    "learned": ModelParameters(1e-8, 1e-8, learn_in_trial=True, learn_structure=True),
}


def preset(name: str) -> ModelParameters:
    """Return the parameters named ``name``, or those in the file ``name`` if it ends in ``.json``.

    Raises:
        UnknownNameError: No preset has this name.
        InvalidInputError: The file cannot be read or is no preset.
    """
    if not isinstance(name, str):
        raise unknown_name("preset", name, PRESETS)
    if name.endswith(".json"):
        return read_preset(read_text_file(name), name)
    if name not in PRESETS:
        raise unknown_name("preset", name, PRESETS)
    return PRESETS[name]
