"""Writing a memory into a database: all of it, or what has changed since it was written last."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.merging import Merge
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.core.sense import SensedTrial
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.database import trial_rows
from atg_fg.storage.database.connection import writing
from atg_fg.storage.evidence_json import write_evidence
from atg_fg.storage.memory_json import write_merge
from atg_fg.storage.object_sense_json import write_moments, write_object_sense
from atg_fg.storage.sense_json import write_sense
from atg_fg.storage.structure_json import write_learner


@dataclass(frozen=True)
class Held:
    """What a database holds of a memory, so that only what is different is written.

    A memory never changes an ATG that it has, but has another one of this name instead; so an ATG that is the same
    object is the same in the file.

    Attributes:
        graphs: The ATGs by name, in their order.
        ids: The number of each in the database.
        positions: The place of each in the order, ascending.
        merges: All of them.
        owners: Name of the object of each raw trial.
        raw: All raw trials.
        sensed: All trials of the sense.
    """

    graphs: dict[str, AspectTransitionGraph] = field(default_factory=dict)
    ids: dict[str, int] = field(default_factory=dict)
    positions: dict[str, int] = field(default_factory=dict)
    merges: tuple[Merge, ...] = ()
    owners: tuple[str, ...] = ()
    raw: tuple[RawTrial, ...] = ()
    sensed: tuple[SensedTrial, ...] = ()


def held_by(connection: sqlite3.Connection, memory: RobotMemory) -> Held:
    """Return what a database holds from which this memory has just been read."""
    rows = connection.execute("SELECT name, id, position FROM graphs ORDER BY position").fetchall()
    return _all_of(memory, {name: key for name, key, _ in rows}, {name: position for name, _, position in rows})


def _all_of(memory: RobotMemory, ids: dict[str, int], positions: dict[str, int]) -> Held:
    """Return what a database holds that has all of a memory, its ATGs in rows of these numbers and positions."""
    graphs = {graph.name: graph for graph in memory}
    sensed = () if memory.sense is None else tuple(memory.sense.trials)
    if not isinstance(memory, StructuredMemory):
        return Held(graphs, ids, positions, memory.merges, sensed=sensed)
    owners, raw = tuple(memory.learner.owners), tuple(memory.learner.trials)
    return Held(graphs, ids, positions, memory.merges, owners, raw, sensed)


def replace_memory(connection: sqlite3.Connection, memory: RobotMemory) -> Held:
    """Write a whole memory in place of what is there; records of trials stay. Inside of a transaction."""
    changed = _assumptions_differ(connection, memory)
    tables = ("raw_trials", "structure", "merges", "transitions", "aspects", "graphs", "actions", "slots", "symbols")
    for table in ("sensed_trials", "sense", *tables, "assumptions"):
        connection.execute(f"DELETE FROM {table}")
    assumptions = memory.assumptions
    if changed:
        connection.execute("UPDATE trials SET learned = NULL")
    alphabet = assumptions.alphabet
    connection.execute(
        "INSERT INTO assumptions VALUES (1, ?, ?, ?, ?, ?, ?)",
        (assumptions.n_objects, assumptions.n_aspects, alphabet.n_symbols, *_flags(alphabet), _senses(assumptions)),
    )
    connection.executemany("INSERT INTO actions VALUES (?, ?)", enumerate(assumptions.actions))
    connection.executemany("INSERT INTO slots VALUES (?, ?)", enumerate(alphabet.slots))
    connection.executemany("INSERT INTO symbols VALUES (?, ?)", enumerate(alphabet.names))
    held = write_changes(connection, memory, Held())
    # No ATG of this memory has learned from what went to one that is not in it.
    names = _compact([*memory.names, *(merge.dropped.name for merge in memory.merges)])
    connection.execute(
        "UPDATE trials SET learned = NULL WHERE learned NOT IN (SELECT value FROM json_each(?))", (names,)
    )
    return held


def _assumptions_differ(connection: sqlite3.Connection, memory: RobotMemory) -> bool:
    """Return whether the database holds a memory under other assumptions; labels more at the end are none."""
    alphabet = memory.assumptions.alphabet
    row = connection.execute("SELECT n_aspects, n_symbols, exclusive, open, object_senses FROM assumptions").fetchone()
    names = [
        tuple(name for (name,) in connection.execute(f"SELECT name FROM {table} ORDER BY number"))
        for table in ("actions", "slots", "symbols")
    ]
    if row is None:
        return False
    known = alphabet.names[: row[1]] if alphabet.is_open else alphabet.names
    n_symbols = row[1] if alphabet.is_open else alphabet.n_symbols
    sizes = (memory.assumptions.n_aspects, n_symbols, *_flags(alphabet), _senses(memory.assumptions))
    return [row, *names] != [sizes, memory.assumptions.actions, alphabet.slots, known]


def _flags(alphabet: PatternAlphabet) -> tuple[int, int]:
    return int(alphabet.exclusive), int(alphabet.is_open)


def _senses(assumptions: Assumptions) -> str | None:
    """Return the senses of the object as text, ``None`` if there are none."""
    senses = [write_object_sense(each) for each in assumptions.object_senses]
    return _compact(senses) if senses else None


def write_changes(connection: sqlite3.Connection, memory: RobotMemory, held: Held) -> Held:
    """Write what a memory has and a database has not; return what the database then holds. Inside of a transaction."""
    graphs = {graph.name: graph for graph in memory}
    for name in held.graphs:
        if name not in graphs:
            _clear_graph(connection, held.ids[name])
            connection.execute("DELETE FROM graphs WHERE id = ?", (held.ids[name],))
    ids, positions = _placed(connection, list(graphs), held)
    for name, graph in graphs.items():
        if held.graphs.get(name) is not graph:
            _clear_graph(connection, ids[name])
            _insert_graph(connection, ids[name], graph)
    _write_merges(connection, memory.merges, held.merges)
    if isinstance(memory, StructuredMemory):
        _write_structure(connection, memory, held, ids)
    _write_sense(connection, memory, held.sensed)
    return _all_of(memory, ids, positions)


def _placed(connection: sqlite3.Connection, names: Sequence[str], held: Held) -> tuple[dict[str, int], dict[str, int]]:
    """Give new ATGs a row, and all of them positions in the order of ``names``; return their ids and positions."""
    known = set(names)
    kept = [name for name in held.graphs if name in known]
    positions = {name: held.positions[name] for name in kept}
    last = max(positions.values(), default=-1)
    if list(names[: len(kept)]) != kept:
        positions = {}  # one comes between others, when a merge is undone: all move behind the last
    ids = {}
    for name in names:
        if name not in positions:
            positions[name] = last = last + 1
        if name in held.ids:
            ids[name] = held.ids[name]
            if positions[name] != held.positions[name]:
                connection.execute("UPDATE graphs SET position = ? WHERE id = ?", (positions[name], ids[name]))
        else:
            row = connection.execute("INSERT INTO graphs (position, name) VALUES (?, ?)", (positions[name], name))
            ids[name] = int(row.lastrowid or 0)
    return ids, {name: positions[name] for name in names}


def _clear_graph(connection: sqlite3.Connection, number: int) -> None:
    connection.execute("DELETE FROM transitions WHERE graph = ?", (number,))
    connection.execute("DELETE FROM aspects WHERE graph = ?", (number,))


def _insert_graph(connection: sqlite3.Connection, number: int, graph: AspectTransitionGraph) -> None:
    aspects = ((number, index, _compact(list(pattern))) for index, pattern in enumerate(graph.aspects))
    connection.executemany("INSERT INTO aspects VALUES (?, ?, ?)", aspects)
    transitions = ((number, *edge, count) for edge, count in graph.counts.items())
    connection.executemany("INSERT INTO transitions VALUES (?, ?, ?, ?, ?)", transitions)
    measured = _compact(write_moments(graph.measured)) if graph.measured else None
    connection.execute("UPDATE graphs SET measured = ? WHERE id = ?", (measured, number))


def _write_merges(connection: sqlite3.Connection, merges: tuple[Merge, ...], held: tuple[Merge, ...]) -> None:
    same = 0
    while same < min(len(merges), len(held)) and merges[same] is held[same]:
        same += 1
    connection.execute("DELETE FROM merges WHERE number >= ?", (same,))
    rows = ((same + index, _compact(write_merge(merge))) for index, merge in enumerate(merges[same:]))
    connection.executemany("INSERT INTO merges VALUES (?, ?)", rows)


def _write_structure(
    connection: sqlite3.Connection, memory: StructuredMemory, before: Held, ids: dict[str, int]
) -> None:
    """Write the structures in question anew, raw trials that are new, and what has changed of the others."""
    held, owners = before.owners, memory.learner.owners
    section = write_learner(memory.learner, len(held))
    new = section.pop("trials")
    evidence = write_evidence(memory)
    if evidence:
        section["evidence"] = evidence
    connection.execute("INSERT OR REPLACE INTO structure VALUES (1, ?)", (_compact(section),))
    changed = ((ids[owner], number) for number, owner in enumerate(owners[: len(held)]) if owner != held[number])
    connection.executemany("UPDATE raw_trials SET graph = ? WHERE number = ?", changed)
    seen = (
        (_compact([list(look) for look in trial.detections]), number)
        for number, (trial, old) in enumerate(zip(memory.learner.trials, before.raw, strict=False))
        if trial.detections != old.detections
    )
    connection.executemany("UPDATE raw_trials SET observed = ? WHERE number = ?", seen)
    rows: Iterable[Any] = (
        (
            len(held) + index,
            ids[trial["object"]],
            _compact(trial["observed"]),
            _compact(trial["actions"]),
            _compact(trial["confidences"]) if "confidences" in trial else None,
            _compact(trial["measured"]) if "measured" in trial else None,
        )
        for index, trial in enumerate(new)
    )
    connection.executemany("INSERT INTO raw_trials VALUES (?, ?, ?, ?, ?, ?)", rows)


def _write_sense(connection: sqlite3.Connection, memory: RobotMemory, held: tuple[SensedTrial, ...]) -> None:
    """Write the trials of the sense that are new, or that are taken for something else now."""
    if memory.sense is None:
        return
    section = write_sense(memory.sense, memory.assumptions)
    trials = section.pop("trials")
    connection.execute("INSERT OR IGNORE INTO sense VALUES (1, ?)", (_compact(section),))
    rows = (
        (number, _compact(document))
        for number, (trial, document) in enumerate(zip(memory.sense.trials, trials, strict=True))
        if number >= len(held) or trial != held[number]
    )
    connection.executemany("INSERT OR REPLACE INTO sensed_trials VALUES (?, ?)", rows)


def _compact(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"))


def save_database(
    memory: RobotMemory, path: Path | str, trials: tuple[TrialSummary, ...] = (), experiment: Experiment | None = None
) -> None:
    """Save a memory in place of the one that a database holds, if any; its records of trials stay.

    Args:
        memory: What is to be remembered.
        path: The database; made if it is not there.
        trials: Records to add, in the same transaction.
        experiment: That these belong to.

    Raises:
        BusyMemoryError: Another process was writing all the time that this one waited.
        InvalidInputError: The file cannot be written, or is something else; it is as it was.
    """
    with writing(path, create=True) as connection:
        replace_memory(connection, memory)
        for trial in trials:
            experiment = trial_rows.added(connection, experiment, trial)
