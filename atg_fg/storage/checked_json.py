"""Assumptions and ATGs as JSON, checked on the way in: what memory files and scripted trials share.

Every reader takes the *place* of its value in the document and names it in the error it raises.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import numpy as np

from atg_fg.core.errors import InvalidInputError


def parse_json(text: str, place: str) -> Any:
    """Return the JSON document ``text``; NaN, Infinity and repeated keys are refused.

    Raises:
        InvalidInputError: It is not JSON.
    """
    try:
        return json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_unique_keys)
    except (ValueError, RecursionError, MemoryError) as error:
        raise InvalidInputError(f"{place}: not valid JSON: {str(error) or 'not enough memory'}") from error


def plain_json(value: Any) -> Any:
    """Return a NumPy value as JSON knows it; what ``json.dumps`` asks for what it does not know itself."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"a record cannot hold a {type(value).__name__}")


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not a finite number")


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        keys = [key for key, _ in pairs]
        repeated = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"key {repeated!r} is repeated")
    return result


def read_object(value: Any, place: str, keys: tuple[str, ...], optional: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return ``value`` if it is an object with exactly these keys, and perhaps optional ones."""
    if not isinstance(value, dict):
        raise InvalidInputError(f"{place}: {_brief(value)}; expected an object with {', '.join(keys)}")
    for key in value:
        if key not in keys + optional:
            raise InvalidInputError(f"{place}: unknown key {key!r}; expected {', '.join(keys + optional)}")
    for key in keys:
        if key not in value:
            raise InvalidInputError(f"{place}: key {key!r} is missing; expected {', '.join(keys)}")
    return value


def read_list(value: Any, place: str) -> list[Any]:
    """Return ``value`` if it is a list."""
    if not isinstance(value, list):
        raise InvalidInputError(f"{place}: {_brief(value)}; expected a list")
    return value


def read_integer(value: Any, place: str, least: int) -> int:
    """Return ``value`` if it is a whole number of at least ``least``."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise InvalidInputError(f"{place}: {_brief(value)}; expected a whole number of at least {least}")
    return value


def read_text(value: Any, place: str) -> str:
    """Return ``value`` if it is a text that is not empty and can be written in UTF-8."""
    if not isinstance(value, str) or not value:
        raise InvalidInputError(f"{place}: {_brief(value)}; expected a text that is not empty")
    try:
        value.encode()
    except UnicodeError as error:  # JSON can say half a character
        raise InvalidInputError(f"{place}: {_brief(value)}; expected a text of whole characters") from error
    return value


def check_format(document: dict[str, Any], name: str, place: str) -> None:
    """Check the keys ``format`` and ``version`` of a document."""
    if document["format"] != name:
        raise InvalidInputError(f"{place}: format: {_brief(document['format'])}; expected {name!r}")
    version = document["version"]
    if isinstance(version, bool) or version != 1:
        raise InvalidInputError(f"{place}: version: {_brief(version)}; expected 1")


@contextmanager
def placed(place: str) -> Iterator[None]:
    """Put a place in front of the message of an ``InvalidInputError`` raised inside."""
    try:
        yield
    except InvalidInputError as error:
        raise InvalidInputError(f"{place}: {error}") from error


def _brief(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
