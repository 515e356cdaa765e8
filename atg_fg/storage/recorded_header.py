"""What a record says of its test: checked, but nothing is imported for it.

A policy or an engine that it names is a label, and a world is made only if this package has one of this name.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import fields, replace
from typing import Any, Final

from atg_fg.core.assumptions import MAX_NUMBER, Assumptions, arcube_assumptions
from atg_fg.core.checks import number, plain_text, whole_number
from atg_fg.core.errors import AtgError, InvalidInputError, placed
from atg_fg.core.parameters import ModelParameters
from atg_fg.storage.checked_json import read_info, read_object
from atg_fg.worlds.registry import ARCUBE_WORLDS, WORLDS, assumptions_of, make_world

_PARAMETERS: Final = tuple(field.name for field in fields(ModelParameters))
#: Enough for a world of any family to be made; what the robot takes for granted depends on |O| in nothing else.
_FEW: Final = 2


def read_header(
    header: Mapping[str, Any], place: str, assumptions: Assumptions | None = None
) -> tuple[ModelParameters, Assumptions | None]:
    """Check what a record says of its test; return the model's parameters, and what was taken for granted.

    Args:
        header: The seed, and what the plan has other than usual.
        place: Named in errors.
        assumptions: What was taken for granted where the world is a user's own.

    Raises:
        InvalidInputError: Anything in it is not as it should be.
    """
    place = f"{place}: header"
    read_info(header, place)
    whole_number(header.get("seed", 0), f"{place}: seed")
    for name in ("n_actions", "n_trials", "n_objects"):
        whole_number(header.get(name, 1), f"{place}: {name}", 1, MAX_NUMBER)
    for name in ("world", "engine", "policy"):
        plain_text(header.get(name, "usual"), f"{place}: {name}")
    for name in ("smoothed_learning", "merge_duplicates"):
        if not isinstance(header.get(name, False), bool):
            raise InvalidInputError(f"{place}: {name}: {header[name]!r:.60}; expected true or false")
    if header.get("settled") is not None:
        number(header["settled"], f"{place}: settled", 0.0)
    given = read_object(header.get("parameters", {}), f"{place}: parameters", (), _PARAMETERS)
    options = read_info(header.get("world_options", {}), f"{place}: world_options")
    with placed(f"{place}: parameters"):
        parameters = ModelParameters(**given)
    world, n_objects = header.get("world", "ideal"), header.get("n_objects", 100)
    if world in ARCUBE_WORLDS:
        return parameters, arcube_assumptions(n_objects)
    if world not in WORLDS:
        return parameters, assumptions
    try:
        # Code that makes features and the description of a robot are a user's own: no file may name them, and nothing
        # here depends on them.
        known = {name: value for name, value in options.items() if name not in ("features", "urdf")}
        with closing(make_world(world, n_objects=_FEW, objects_seed=0, **known)) as made:
            return parameters, replace(assumptions_of(made, n_objects), n_objects=n_objects)
    except (AtgError, TypeError, ValueError, AssertionError) as error:  # the last two are of Gymnasium's own options
        raise InvalidInputError(f"{place}: world_options: {error}; expected those of world {world!r}") from error
