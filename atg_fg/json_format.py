"""Assumptions and ATGs as JSON, checked on the way in: what memory files and scripted trials share.

Every reader takes the *place* of its value in the document and names it in the error it raises.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import numpy as np

from atg_fg.assumptions import Assumptions
from atg_fg.errors import InvalidInputError
from atg_fg.graph import AspectTransitionGraph
from atg_fg.memory import RobotMemory
from atg_fg.patterns import PatternAlphabet


def parse_json(text: str, place: str) -> Any:
    """Return the JSON document ``text``; NaN, Infinity and repeated keys are refused.

    Raises:
        InvalidInputError: It is not JSON.
    """
    try:
        return json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_unique_keys)
    except (ValueError, RecursionError) as error:
        raise InvalidInputError(f"{place}: not valid JSON: {error}") from error


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


def read_assumptions(value: Any, place: str) -> Assumptions:
    """Return the assumptions at ``place``."""
    fields = read_object(value, place, ("n_objects", "n_aspects", "actions", "slots", "n_symbols"))
    texts = {
        key: tuple(
            read_text(name, f"{place}.{key}[{index}]")
            for index, name in enumerate(read_list(fields[key], f"{place}.{key}"))
        )
        for key in ("actions", "slots")
    }
    numbers = {
        key: read_integer(fields[key], f"{place}.{key}", least=1) for key in ("n_objects", "n_aspects", "n_symbols")
    }
    with placed(place):
        alphabet = PatternAlphabet(texts["slots"], numbers["n_symbols"])
        return Assumptions(numbers["n_objects"], numbers["n_aspects"], texts["actions"], alphabet)


def write_assumptions(assumptions: Assumptions) -> dict[str, Any]:
    """Return assumptions as JSON knows them."""
    return {
        "n_objects": assumptions.n_objects,
        "n_aspects": assumptions.n_aspects,
        "actions": list(assumptions.actions),
        "slots": list(assumptions.alphabet.slots),
        "n_symbols": assumptions.alphabet.n_symbols,
    }


def read_memory(value: Any, assumptions: Assumptions, place: str) -> RobotMemory:
    """Return the robot memory whose list of ATGs is at ``place``."""
    memory = RobotMemory(assumptions)
    for index, entry in enumerate(read_list(value, place)):
        graph = read_graph(entry, assumptions, f"{place}[{index}]")
        with placed(f"{place}[{index}]"):
            memory.add(graph)
    return memory


def read_graph(value: Any, assumptions: Assumptions, place: str) -> AspectTransitionGraph:
    """Return the ATG at ``place``."""
    fields = read_object(value, place, ("name", "aspects", "transitions"))
    graph = AspectTransitionGraph(read_text(fields["name"], f"{place}.name"), assumptions)
    for index, pattern in enumerate(read_list(fields["aspects"], f"{place}.aspects")):
        where = f"{place}.aspects[{index}]"
        with placed(where):
            graph.add_aspect(assumptions.alphabet.check_pattern(read_list(pattern, where)))
    for index, entry in enumerate(read_list(fields["transitions"], f"{place}.transitions")):
        where = f"{place}.transitions[{index}]"
        edge = read_object(entry, where, ("from", "action", "to", "count"))
        action = assumptions.action_index(edge["action"], f"{where}.action")
        ends = [read_integer(edge[key], f"{where}.{key}", least=0) for key in ("from", "to")]
        count = read_integer(edge["count"], f"{where}.count", least=1)
        with placed(where):
            graph.add_transition(ends[0], action, ends[1], count)
    return graph


def write_graph(graph: AspectTransitionGraph) -> dict[str, Any]:
    """Return an ATG as JSON knows it."""
    return {
        "name": graph.name,
        "aspects": [list(pattern) for pattern in graph.aspects],
        "transitions": [
            {"from": source, "action": graph.assumptions.actions[action], "to": target, "count": count}
            for (source, action, target), count in sorted(graph.counts.items())
        ],
    }


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
