"""Assumptions and ATGs as JSON, checked on the way in: what memory files and scripted trials share.

Every reader takes the *place* of its value in the document and names it in the error it raises.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Final, NoReturn

import numpy as np

from atg_fg.core.checks import brief, plain_text
from atg_fg.core.errors import InvalidInputError

#: Levels of lists and objects in what a file may say freely, such as the truth of a look.
MAX_DEPTH: Final = 20
_SOUND: Final = "a JSON document, with finite numbers and each key once"


def parse_json(document: str, place: str) -> Any:
    """Return the JSON in the text ``document``; numbers that are not finite, and repeated keys, are refused.

    Raises:
        InvalidInputError: It is not JSON.
    """
    try:
        return json.loads(
            document, parse_float=_finite, parse_constant=_refuse_constant, object_pairs_hook=_unique_keys
        )
    except (ValueError, RecursionError, MemoryError) as error:
        raise InvalidInputError(
            f"{place}: not valid JSON: {str(error) or 'not enough memory'}; expected {_SOUND}"
        ) from error


def plain_json(value: Any) -> Any:
    """Return a NumPy value as JSON knows it; what ``json.dumps`` asks for what it does not know itself."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"a record cannot hold a {type(value).__name__}")


def _finite(digits: str) -> float:
    if math.isinf(value := float(digits)):
        raise ValueError(f"{digits} is not a finite number")
    return value


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a finite number")


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        repeated, _ = Counter(key for key, _ in pairs).most_common(1)[0]
        raise ValueError(f"key {brief(repeated)} is repeated")
    return result


def read_object(value: Any, place: str, keys: tuple[str, ...], optional: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return ``value`` if it is an object with exactly these keys, and perhaps optional ones."""
    if not isinstance(value, dict):
        raise InvalidInputError(f"{place}: {brief(value)}; expected an object with {', '.join(keys)}")
    for key in value:
        if key not in keys + optional:
            raise InvalidInputError(f"{place}: unknown key {brief(key)}; expected {', '.join(keys + optional)}")
    for key in keys:
        if key not in value:
            raise InvalidInputError(f"{place}: key {key!r} is missing; expected {', '.join(keys)}")
    return value


def read_list(value: Any, place: str, length: int | None = None) -> list[Any]:
    """Return ``value`` if it is a list, of this length if one is given."""
    if not isinstance(value, list):
        raise InvalidInputError(f"{place}: {brief(value)}; expected a list")
    if length is not None and len(value) != length:
        raise InvalidInputError(f"{place}: {len(value)} entries; expected {length}")
    return value


def read_entries(value: Any, place: str, length: int | None = None) -> list[tuple[Any, str]]:
    """Return each entry of a list with its own place; ``length`` is as for ``read_list``."""
    return [(entry, f"{place}[{index}]") for index, entry in enumerate(read_list(value, place, length))]


def read_array(value: Any, place: str, shape: Sequence[int], read: Callable[[Any, str], Any]) -> list[Any]:
    """Return lists in lists of this shape, with each entry as ``read`` returns it, given its place."""
    entries = read_entries(value, place, shape[0])
    if len(shape) > 1:
        return [read_array(entry, where, shape[1:], read) for entry, where in entries]
    return [read(entry, where) for entry, where in entries]


def read_info(value: Any, place: str) -> dict[str, Any]:
    """Return ``value`` if it is an object, of whatever is not nested too deeply and can be written in UTF-8."""
    if not isinstance(value, dict):
        raise InvalidInputError(f"{place}: {brief(value)}; expected an object")
    _check_plain(value, place, MAX_DEPTH)
    return value


def _check_plain(value: Any, place: str, depth: int) -> None:
    if not depth:
        raise InvalidInputError(f"{place}: nested too deeply; expected at most {MAX_DEPTH} levels")
    if isinstance(value, str) and value:
        plain_text(value, place)
    elif isinstance(value, (dict, list)):
        for each in (*value, *value.values()) if isinstance(value, dict) else value:
            _check_plain(each, place, depth - 1)


def without_none(fields: Mapping[str, Any], but_for: Collection[str] = ()) -> dict[str, Any]:
    """Return fields without those that are ``None``, but for some."""
    return {name: value for name, value in fields.items() if value is not None or name in but_for}


def check_format(document: dict[str, Any], name: str, place: str, newest: int = 1) -> int:
    """Check the keys ``format`` and ``version`` of a document; return the version, from 1 to the newest."""
    if document["format"] != name:
        raise InvalidInputError(f"{place}: format: {brief(document['format'])}; expected {name!r}")
    version = document["version"]
    if isinstance(version, bool) or version not in range(1, newest + 1):
        expected = " or ".join(map(str, range(1, newest + 1)))
        raise InvalidInputError(f"{place}: version: {brief(version)}; expected {expected}")
    return int(version)
