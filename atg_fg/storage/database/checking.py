"""All that is wrong with a memory database: its pages, its references, and what it says."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.database.connection import open_to_read, translated
from atg_fg.storage.database.memory_reading import holds_memory, read_memory_rows
from atg_fg.storage.database.trial_log import TEST_KIND
from atg_fg.storage.database.trial_rows import experiments_or_faults, trials_or_faults
from atg_fg.storage.recorded_header import read_header

#: Faults of one kind after which no more are looked for.
MAX_FAULTS = 20


def faults_of_database(path: Path | str) -> list[str]:
    """Return what is wrong with a database, a line each; nothing if it is sound.

    Pages and indices (``PRAGMA integrity_check``), references (``PRAGMA foreign_key_check``), the memory as it is read
    for use, and every experiment and trial.

    Raises:
        InvalidInputError: It cannot be opened at all, or is no memory database of this version or before.
    """
    faults: list[str] = []
    with closing(open_to_read(path)) as connection:
        for check in (_integrity, _references, _memory, _records):
            try:
                with translated(path):
                    faults += check(connection, str(path))
            except InvalidInputError as error:
                faults.append(str(error))
    return faults


def _integrity(connection: sqlite3.Connection, place: str) -> Iterator[str]:
    for (line,) in connection.execute(f"PRAGMA integrity_check({MAX_FAULTS})"):
        if line != "ok":
            yield f"{place}: {line}"


def _references(connection: sqlite3.Connection, place: str) -> Iterator[str]:
    for table, row, parent, _ in connection.execute("PRAGMA foreign_key_check").fetchmany(MAX_FAULTS):
        which = "a row" if row is None else f"row {row}"
        yield f"{place}: {table}: {which} refers to one of {parent} that is not there"


def _memory(connection: sqlite3.Connection, place: str) -> Iterator[str]:
    """Read the memory, if there is one, and yield what trials that it learned from say that does not fit it."""
    if not holds_memory(connection):
        return
    memory = read_memory_rows(connection, place)
    names = {*memory.names, *(merge.dropped.name for merge in memory.merges)}
    if isinstance(memory, StructuredMemory):  # an ATG all of whose trials turned out to be of others is no more
        names |= {each.old for each in memory.reassignments}
    n_slots, n_symbols = len(memory.assumptions.alphabet.slots), memory.assumptions.alphabet.n_symbols
    for _, trial in trials_or_faults(connection, place, {}):
        if isinstance(trial, InvalidInputError) or trial.learned is None:
            continue
        where = f"{place}: trial {trial.number} of experiment {trial.experiment}"
        if trial.learned not in names:
            yield f"{where}: learned: {trial.learned!r}; expected the name of an ATG in this memory"
        for number, step in enumerate(trial.steps):
            fits = len(step.observed) == n_slots and all(
                symbol is None or symbol < n_symbols for symbol in step.observed
            )
            if not fits or (step.action is not None and step.action not in memory.assumptions.actions):
                yield f"{where}: step {number} does not fit the assumptions of this memory"


def _records(connection: sqlite3.Connection, place: str) -> Iterator[str]:
    assumptions, faults = assumptions_of_tests(connection, place)
    yield from faults.values()
    following = dict.fromkeys(assumptions, 0)
    for _, trial in trials_or_faults(connection, place, assumptions):
        if isinstance(trial, InvalidInputError):
            yield str(trial)
        elif trial.experiment in following:
            if trial.number != following[trial.experiment]:
                expected = following[trial.experiment]
                yield f"{place}: experiment {trial.experiment}: trial {trial.number}; expected {expected}"
            following[trial.experiment] = trial.number + 1


def assumptions_of_tests(
    connection: sqlite3.Connection, place: str
) -> tuple[dict[int | None, Assumptions | None], dict[int, str]]:
    """Return by number what was taken for granted in each experiment, where it is known, and what is wrong with one."""
    assumptions: dict[int | None, Assumptions | None] = {}
    faults: dict[int, str] = {}
    for number, found in experiments_or_faults(connection, place):
        try:
            if isinstance(found, InvalidInputError):
                raise found
            assumptions[number] = None
            if found.kind == TEST_KIND:
                header = {"seed": found.seed, **found.parameters}
                assumptions[number] = read_header(header, f"{place}: experiment {number}")[1]
        except InvalidInputError as error:
            faults[number] = str(error)
    return assumptions, faults
