"""The tables of a memory database, and the steps that lead an older file to them.

``PRAGMA user_version`` is the number of steps that a file has gone through. A step is never changed once a version of
this project has written files with it; a new one is added at the end.
"""

from __future__ import annotations

import sqlite3
from contextlib import closing
from functools import cache
from typing import Final

from atg_fg.core.errors import InvalidInputError

#: ``PRAGMA application_id``: "ATGf" in ASCII. It tells a memory from other SQLite files.
APPLICATION_ID: Final = 0x41544766

_VERSION_1: Final = (
    """CREATE TABLE assumptions (
        id INTEGER PRIMARY KEY CHECK (id = 1),
        n_objects INTEGER NOT NULL, n_aspects INTEGER NOT NULL, n_symbols INTEGER NOT NULL)""",
    "CREATE TABLE actions (number INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE)",
    "CREATE TABLE slots (number INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE)",
    """CREATE TABLE graphs (
        id INTEGER PRIMARY KEY, position INTEGER NOT NULL UNIQUE, name TEXT NOT NULL UNIQUE)""",
    """CREATE TABLE aspects (
        graph INTEGER NOT NULL REFERENCES graphs, number INTEGER NOT NULL, symbols TEXT NOT NULL,
        PRIMARY KEY (graph, number), UNIQUE (graph, symbols)) WITHOUT ROWID""",
    """CREATE TABLE transitions (
        graph INTEGER NOT NULL, source INTEGER NOT NULL, action INTEGER NOT NULL REFERENCES actions,
        target INTEGER NOT NULL, count INTEGER NOT NULL CHECK (count >= 1),
        PRIMARY KEY (graph, source, action, target),
        FOREIGN KEY (graph, source) REFERENCES aspects,
        FOREIGN KEY (graph, target) REFERENCES aspects) WITHOUT ROWID""",
    "CREATE TABLE merges (number INTEGER PRIMARY KEY, document TEXT NOT NULL)",
    "CREATE TABLE structure (id INTEGER PRIMARY KEY CHECK (id = 1), document TEXT NOT NULL)",
    # Deferred: a merge hands the trials of the ATG that it drops over to the one that it keeps.
    """CREATE TABLE raw_trials (
        number INTEGER PRIMARY KEY, graph INTEGER NOT NULL REFERENCES graphs DEFERRABLE INITIALLY DEFERRED,
        observed TEXT NOT NULL, actions TEXT NOT NULL)""",
    "CREATE INDEX raw_trials_by_graph ON raw_trials (graph)",
    # A seed is text because it may be longer than SQLite's 64 bits.
    """CREATE TABLE experiments (
        id INTEGER PRIMARY KEY, kind TEXT NOT NULL, seed TEXT, parameters TEXT NOT NULL, version TEXT NOT NULL)""",
    """CREATE TABLE trials (
        id INTEGER PRIMARY KEY, experiment INTEGER REFERENCES experiments, number INTEGER NOT NULL,
        verdict TEXT NOT NULL, matched TEXT, learned TEXT, learned_patterns TEXT, lost_truth TEXT,
        UNIQUE (experiment, number))""",
    """CREATE TABLE steps (
        trial INTEGER NOT NULL REFERENCES trials, number INTEGER NOT NULL, observed TEXT NOT NULL, pattern INTEGER,
        unseen REAL NOT NULL, entropy REAL NOT NULL, log_evidence REAL, expected_entropy TEXT, action TEXT,
        purpose TEXT, truth TEXT NOT NULL, PRIMARY KEY (trial, number)) WITHOUT ROWID""",
)

_VERSION_2: Final = (
    "ALTER TABLE assumptions ADD COLUMN exclusive INTEGER NOT NULL DEFAULT 1",
    "ALTER TABLE raw_trials ADD COLUMN confidences TEXT",
)

_VERSION_3: Final = (
    "CREATE TABLE sense (id INTEGER PRIMARY KEY CHECK (id = 1), document TEXT NOT NULL)",
    "CREATE TABLE sensed_trials (number INTEGER PRIMARY KEY, document TEXT NOT NULL)",
)

_VERSION_4: Final = ("ALTER TABLE trials ADD COLUMN mistakes TEXT", "ALTER TABLE trials ADD COLUMN mended TEXT")

_VERSION_5: Final = (
    "CREATE TABLE symbols (number INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE)",
    "ALTER TABLE assumptions ADD COLUMN open INTEGER NOT NULL DEFAULT 0",
)

_VERSION_6: Final = (
    "ALTER TABLE assumptions ADD COLUMN object_senses TEXT",
    "ALTER TABLE graphs ADD COLUMN measured TEXT",
    "ALTER TABLE raw_trials ADD COLUMN measured TEXT",
)

#: The statements of each step: the first makes the tables of version 1, the n-th leads from version n − 1 to n.
MIGRATIONS: tuple[tuple[str, ...], ...] = (_VERSION_1, _VERSION_2, _VERSION_3, _VERSION_4, _VERSION_5, _VERSION_6)


def version_of(connection: sqlite3.Connection, place: str) -> int:
    """Return the version of a file, 0 if nothing was ever written to it.

    What a file defines is compared with what this project would have defined, text by text, before anything is read
    from it: a trigger or a view of a stranger's would run with each statement.

    Raises:
        InvalidInputError: It belongs to another application or to a later version of this one, or it defines
            something else.
    """
    if connection.in_transaction:
        return _version_of(connection, place)
    connection.execute("BEGIN")  # all of it as it is at one moment
    try:
        return _version_of(connection, place)
    finally:
        if connection.in_transaction:
            connection.execute("ROLLBACK")


def _version_of(connection: sqlite3.Connection, place: str) -> int:
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if application == 0 and version == 0 and tables == 0:
        return 0
    if application != APPLICATION_ID or version < 1:
        raise InvalidInputError(
            f"{place}: an SQLite file with application_id {application} and user_version {version}; expected a memory "
            f"of atg-fg, application_id {APPLICATION_ID}"
        )
    if version > len(MIGRATIONS):
        raise InvalidInputError(
            f"{place}: schema version {version}, of a later atg-fg; expected at most {len(MIGRATIONS)}"
        )
    _check_definitions(connection, int(version), place)
    return int(version)


def _check_definitions(connection: sqlite3.Connection, version: int, place: str) -> None:
    found, expected = _definitions(connection), _definitions_of(MIGRATIONS[:version])
    # What is there too much is told before what is not there: it may stand in its place.
    for kind, name, _, text in (*sorted(found - expected, key=repr), *sorted(expected - found, key=repr)):
        what = f"defines {kind} {name!r}, {text!r}" if (kind, name, _, text) in found else f"no such {kind}: {name}"
        raise InvalidInputError(
            f"{place}: {what}; expected a memory of atg-fg, with its tables and indices and nothing else"
        )


def _definitions(connection: sqlite3.Connection) -> frozenset[tuple[object, ...]]:
    return frozenset(connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_master").fetchall())


@cache
def _definitions_of(steps: tuple[tuple[str, ...], ...]) -> frozenset[tuple[object, ...]]:
    """Return what a file defines that has gone through these steps."""
    with closing(sqlite3.connect(":memory:")) as connection:
        for step in steps:
            for statement in step:
                connection.execute(statement)
        return _definitions(connection)


def migrate(connection: sqlite3.Connection, place: str) -> None:
    """Lead a file to the present tables, inside of a transaction that the caller has begun."""
    for version in range(version_of(connection, place), len(MIGRATIONS)):
        for statement in MIGRATIONS[version]:
            connection.execute(statement)
        connection.execute(f"PRAGMA user_version = {version + 1}")
    connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
