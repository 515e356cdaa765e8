"""Nothing that a database from elsewhere defines is run, and no statement goes on for ever."""

import sqlite3
import time
from contextlib import closing

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.storage import memory_files
from atg_fg.storage.database import schema
from atg_fg.storage.database.checking import faults_of_database
from atg_fg.storage.database.connection import open_to_read, open_to_write, translated
from atg_fg.storage.memory_files import open_memory
from tests.cli.conftest import run as run  # a fixture
from tests.storage.database.small import add_cube, plain

ENDLESS = "WITH RECURSIVE n (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
FOREIGN = {
    "a trigger": ["CREATE TRIGGER t AFTER INSERT ON trials BEGIN DELETE FROM graphs; END"],
    "a trigger on another table": ["CREATE TRIGGER t AFTER DELETE ON merges BEGIN DELETE FROM graphs; END"],
    "a temporary name": ['CREATE TRIGGER "sqlite\'_x" AFTER INSERT ON steps BEGIN SELECT 1; END'],
    "a view": ["CREATE VIEW v AS SELECT 1"],
    "an endless view in place of a table": [
        "DROP TABLE experiments",
        f"CREATE VIEW experiments (id, kind, seed, parameters, version) AS {ENDLESS} "
        "SELECT i, 'test', 0, '{}', 'x' FROM n",
    ],
    "a view in place of a table with an index": [
        "DROP TABLE raw_trials",
        "CREATE VIEW raw_trials (number, graph, observed, actions) AS SELECT 1, 1, '', ''",
    ],
    "a table": ["CREATE TABLE more (a)"],
    "a virtual table": ["CREATE VIRTUAL TABLE more USING fts5(a)"],
    "an index": ["CREATE INDEX more ON trials (verdict)"],
    "an index on an expression": ["CREATE INDEX more ON trials (upper(verdict))"],
    "statistics": ["ANALYZE"],
    "a table that was changed": ["ALTER TABLE trials ADD COLUMN more"],
    "a table that was renamed": ["ALTER TABLE merges RENAME TO other"],
    "a table that is not there": ["DROP TABLE steps"],
    "an index that is not there": ["DROP INDEX raw_trials_by_graph"],
    "a generated column": [
        "DROP TABLE merges",
        "CREATE TABLE merges (number INTEGER PRIMARY KEY, document TEXT AS (upper('x')))",
    ],
    "a default that is computed": [
        "DROP TABLE merges",
        "CREATE TABLE merges (number INTEGER PRIMARY KEY, document TEXT DEFAULT (randomblob(9)))",
    ],
    "a check that is computed": [
        "DROP TABLE merges",
        "CREATE TABLE merges (number INTEGER PRIMARY KEY, document TEXT CHECK (length(document) > 0))",
    ],
    "a text that was changed in place": [
        "PRAGMA writable_schema = ON",
        "UPDATE sqlite_master SET sql = replace(sql, 'verdict TEXT NOT NULL', 'verdict TEXT') WHERE name = 'trials'",
    ],
}


@pytest.fixture
def path(tmp_path):
    memory_files.save_memory(plain(2), tmp_path / "robot.db")
    return tmp_path / "robot.db"


def change(path, statements):
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        for statement in statements:
            connection.execute(statement)


@pytest.mark.parametrize("what", FOREIGN)
def test_a_file_that_defines_something_else_is_no_memory_to_any_reader_or_writer(path, what):
    try:
        change(path, FOREIGN[what])
    except sqlite3.OperationalError as error:
        pytest.skip(f"this SQLite cannot: {error}")
    content = path.read_bytes()
    for use in (
        faults_of_database,
        memory_files.load_memory,
        open_memory,
        lambda where: open_memory(where, read_only=True),
        lambda where: memory_files.save_memory(plain(3), where),
        open_to_read,
        open_to_write,
    ):
        with pytest.raises(InvalidInputError, match="expected a memory of atg-fg"):
            use(path)
    assert path.read_bytes() == content


@pytest.mark.parametrize("what", ["a trigger", "a view"])
def test_every_command_refuses_it_in_one_line(path, run, what):
    change(path, FOREIGN[what])
    for words in (
        ("memory", "show", path),
        ("memory", "check", path),
        ("report", path),
        ("trial", "--memory", path, "--save-memory", path),
        ("memory", "import", path, "--into", path.with_name("other.db")),
    ):
        status, output, error = run(*words)
        assert (status, output) == (2, "")
        assert "expected a memory of atg-fg" in error


def test_a_trigger_that_comes_later_does_nothing(path):
    with open_memory(path) as memory:
        change(path, ["CREATE TRIGGER t AFTER INSERT ON transitions BEGIN DELETE FROM graphs; END"])
        with pytest.raises(InvalidInputError, match=r"robot\.db: .*(prohibited|not authorized)"):
            add_cube(memory, 2)
    change(path, ["DROP TRIGGER t"])
    assert memory_files.load_memory(path) == plain(2)


def test_a_statement_that_never_ends_is_ended(path):
    start = time.process_time()
    with (
        closing(open_to_read(path)) as connection,
        pytest.raises(InvalidInputError, match="more work than its size explains"),
        translated(path),
    ):
        connection.execute(f"SELECT count(*) FROM {', '.join(f'transitions t{number}' for number in range(9))}")
    assert time.process_time() - start < 10


def test_pages_that_ask_for_all_memory_there_is_are_called_damaged(tmp_path):
    """A tree of pages that the fuzzer found: SQLite answers it with a ``MemoryError`` of Python's."""
    content = bytearray(19_039)
    content[:24] = b"SQLite format 3\0" + bytes([2, 0, 0, 0, 0, 64, 32, 32])
    content[100:124] = bytes([5, 0, 0, 0, 6, *[0] * 7, 1, 251, 1, 246, 0, 241, 0, 236, 0, 231, 0, 226])
    content[505], content[510] = 8, 7
    content[3072:3077] = content[3584:3589] = bytes([13, 0, 0, 0, 4])
    content[3080:3088] = bytes([0, 53, 0, 149, 1, 0, 0, 50])
    content[3592:3600] = bytes([1, 67, 0, 83, 1, 0, 0, 225])
    content[3907:3925] = bytes([255] * 16 + [0, 255])
    (tmp_path / "greedy.db").write_bytes(content)
    for read in (memory_files.load_memory, open_memory, faults_of_database):
        with pytest.raises(InvalidInputError, match=r"greedy\.db: damaged: .* expected a memory of atg-fg"):
            read(tmp_path / "greedy.db")


def test_a_schema_is_told_by_its_text_in_every_version(tmp_path, monkeypatch):
    monkeypatch.setattr(schema, "MIGRATIONS", (*schema.MIGRATIONS, ("ALTER TABLE trials ADD COLUMN note TEXT",)))
    memory_files.save_memory(plain(1), tmp_path / "new.db")
    assert memory_files.load_memory(tmp_path / "new.db") == plain(1)
    change(tmp_path / "new.db", ["ALTER TABLE trials DROP COLUMN note"])
    with pytest.raises(InvalidInputError, match="expected a memory of atg-fg"):
        memory_files.load_memory(tmp_path / "new.db")
