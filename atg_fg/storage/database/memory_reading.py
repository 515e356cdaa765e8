"""What a database remembers, as the document that memory files hold, so that both are checked by the same code."""

from __future__ import annotations

import sqlite3
from pathlib import Path
from typing import Any

from atg_fg.core.checks import plain_text, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.storage.checked_json import parse_json, read_object
from atg_fg.storage.database.connection import EmptyDatabaseError, reading
from atg_fg.storage.memory_json import MEMORY_FORMAT, memory_from_document


def load_database(path: Path | str) -> RobotMemory:
    """Load a robot memory from a database, as it is at one moment, whoever writes to it.

    Raises:
        InvalidInputError: Unreadable, or anything in it is not as it should be; the message names the place.
    """
    with reading(path) as connection:
        return read_memory_rows(connection, str(path))


def read_memory_rows(connection: sqlite3.Connection, place: str) -> RobotMemory:
    """Return the memory behind a connection; errors name ``place``.

    Raises:
        InvalidInputError: Anything in it is not as it should be.
        sqlite3.Error: The file cannot be read.
    """
    if connection.in_transaction:
        return memory_from_document(_document(connection, place), place)
    connection.execute("BEGIN")  # all tables as they are at one moment
    try:
        return memory_from_document(_document(connection, place), place)
    finally:
        if connection.in_transaction:
            connection.execute("ROLLBACK")


def database_holds_memory(path: Path | str) -> bool:
    """Return whether a database has a memory; an empty one has none.

    Raises:
        InvalidInputError: It cannot be read.
    """
    try:
        with reading(path) as connection:
            return holds_memory(connection)
    except EmptyDatabaseError:
        return False


def holds_memory(connection: sqlite3.Connection) -> bool:
    """Return whether a database has a memory, and not only records of trials."""
    return connection.execute("SELECT 1 FROM assumptions").fetchone() is not None


def _document(connection: sqlite3.Connection, place: str) -> dict[str, Any]:
    numbers = connection.execute(
        "SELECT n_objects, n_aspects, n_symbols, exclusive, open, object_senses FROM assumptions"
    ).fetchone()
    if numbers is None:
        raise InvalidInputError(f"{place}: holds no memory, only records; expected a database with a memory")
    actions, slots, symbols = (
        [name for (name,) in connection.execute(f"SELECT name FROM {table} ORDER BY number")]
        for table in ("actions", "slots", "symbols")
    )
    graphs: dict[Any, dict[str, Any]] = {}
    rows = connection.execute("SELECT id, position, name, measured FROM graphs ORDER BY position")
    for number, position, name, measured in rows:
        where = f"{place}: graphs[{len(graphs)}]"
        whole_number(position, f"{where}.position", least=0)
        graphs[number] = {"name": name, "aspects": [], "transitions": []}
        if measured is not None:
            graphs[number]["measured"] = _json(measured, f"{where}.measured")
    _add_aspects(connection, graphs, place)
    _add_transitions(connection, graphs, actions, place)
    document: dict[str, Any] = {
        "format": MEMORY_FORMAT,
        "version": 1,
        "assumptions": {
            **dict(zip(("n_objects", "n_aspects", "n_symbols"), numbers, strict=False)),
            **({} if numbers[3] == 1 else {"exclusive": {0: False}.get(numbers[3], numbers[3])}),
            "actions": actions,
            "slots": slots,
            **({"symbols": symbols} if symbols else {}),
            **({"open": {1: True}.get(numbers[4], numbers[4])} if numbers[4] != 0 else {}),
            **({} if numbers[5] is None else {"object_senses": _json(numbers[5], f"{place}: object_senses")}),
        },
        "memory": list(graphs.values()),
    }
    merges = connection.execute("SELECT number, document FROM merges ORDER BY number").fetchall()
    if merges:
        document["merges"] = [_json(text, f"{place}: merges[{number!r}]") for number, text in merges]
    structure = connection.execute("SELECT document FROM structure").fetchone()
    if structure is not None:
        document["structure"] = _structure(connection, structure[0], graphs, f"{place}: structure")
    sense = connection.execute("SELECT document FROM sense").fetchone()
    if sense is not None:
        document["sense"] = _sense(connection, sense[0], f"{place}: sense")
    return document


def _add_aspects(connection: sqlite3.Connection, graphs: dict[Any, dict[str, Any]], place: str) -> None:
    for graph, number, symbols in connection.execute("SELECT graph, number, symbols FROM aspects ORDER BY 1, 2"):
        aspects = _of(graphs, graph, f"{place}: aspects")["aspects"]
        where = _place_of_next(aspects, number, f"{place}: {graphs[graph]['name']!r}: aspects")
        aspects.append(_json(symbols, where))


def _add_transitions(
    connection: sqlite3.Connection, graphs: dict[Any, dict[str, Any]], actions: list[Any], place: str
) -> None:
    rows = connection.execute("SELECT graph, source, action, target, count FROM transitions ORDER BY 1, 2, 3, 4")
    last: tuple[Any, ...] = ()
    for graph, source, action, target, count in rows:
        here = tuple(
            whole_number(number, f"{place}: transitions", least=0) for number in (graph, source, action, target)
        )
        if here <= last:  # pages of a damaged file may lead around in a circle
            raise InvalidInputError(f"{place}: transitions: {here} after {last}; expected them in ascending order")
        last = here
        transitions = _of(graphs, graph, f"{place}: transitions")["transitions"]
        where = f"{place}: {graphs[graph]['name']!r}: transitions[{len(transitions)}].action"
        if whole_number(action, where, least=0) >= len(actions):
            raise InvalidInputError(f"{where}: {action}; expected 0 to {len(actions) - 1}")
        transitions.append({"from": source, "action": actions[action], "to": target, "count": count})


def _structure(
    connection: sqlite3.Connection, text: Any, graphs: dict[Any, dict[str, Any]], place: str
) -> dict[str, Any]:
    needed, optional = ("seed", "evaluations", "rates", "candidates"), ("evidence", "uncertain")
    section = read_object(_json(text, place), place, needed, optional)
    trials: list[dict[str, Any]] = []
    for number, graph, observed, actions, confidences, measured in connection.execute(
        "SELECT number, graph, observed, actions, confidences, measured FROM raw_trials ORDER BY number"
    ):
        where = _place_of_next(trials, number, f"{place}.trials")
        owner = _of(graphs, graph, where)["name"]
        trials.append({"object": owner, "observed": _json(observed, where), "actions": _json(actions, where)})
        if confidences is not None:
            trials[-1]["confidences"] = _json(confidences, where)
        if measured is not None:
            trials[-1]["measured"] = _json(measured, where)
    return {**section, "trials": trials}


def _sense(connection: sqlite3.Connection, text: Any, place: str) -> dict[str, Any]:
    keys = ("features", "mean", "projection", "between", "within", "concentration")
    trials: list[Any] = []
    for number, document in connection.execute("SELECT number, document FROM sensed_trials ORDER BY number"):
        trials.append(_json(document, _place_of_next(trials, number, f"{place}.trials")))
    return {**read_object(_json(text, place), place, keys), "trials": trials}


def _place_of_next(entries: list[Any], number: Any, place: str) -> str:
    """Return the place of the next one of numbered rows, or raise ``InvalidInputError`` if it has another number."""
    where = f"{place}[{len(entries)}]"
    if whole_number(number, where, least=0) != len(entries):
        raise InvalidInputError(f"{where}: number {number}; expected {len(entries)}")
    return where


def _of(graphs: dict[Any, dict[str, Any]], graph: Any, place: str) -> dict[str, Any]:
    if graph not in graphs:
        raise InvalidInputError(f"{place}: graph {graph!r}; expected the id of one of the {len(graphs)} graphs")
    return graphs[graph]


def _json(text: Any, place: str) -> Any:
    return parse_json(plain_text(text, place), place)
