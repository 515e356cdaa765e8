import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.storage import memory_files, memory_json
from atg_fg.storage.database import schema
from atg_fg.storage.memory_files import open_memory
from tests.storage.database.small import ARCUBES, add_cube

FIXTURE = Path(__file__).parents[2] / "data" / "formats" / "memory-schema-1.db"
NEXT = ("ALTER TABLE trials ADD COLUMN note TEXT", "UPDATE trials SET note = verdict")


@pytest.fixture
def old(tmp_path):
    return Path(shutil.copy(FIXTURE, tmp_path / "robot.db"))


@pytest.fixture
def later(monkeypatch):
    """A version of atg-fg with one more step than there is."""
    monkeypatch.setattr(schema, "MIGRATIONS", (*schema.MIGRATIONS, NEXT))


def pragma(path, name):
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(f"PRAGMA {name}").fetchone()[0]


def test_a_new_file_has_the_version_of_all_steps(tmp_path):
    open_memory(tmp_path / "robot.db", ARCUBES).close()
    assert pragma(tmp_path / "robot.db", "user_version") == len(schema.MIGRATIONS) == 6
    assert pragma(tmp_path / "robot.db", "application_id") == schema.APPLICATION_ID
    assert pragma(tmp_path / "robot.db", "journal_mode") == "wal"


@pytest.mark.usefixtures("later")
def test_an_older_file_is_read_as_it_is_and_led_on_when_it_is_written(old):
    before = old.read_bytes()
    memory = memory_files.load_memory(old)
    assert memory.names == ("object-000", "object-001")
    assert old.read_bytes() == before
    with open_memory(old) as opened:
        assert opened == memory
        assert len(list(opened.trials())) == 2
        add_cube(opened, 5)
    assert pragma(old, "user_version") == len(schema.MIGRATIONS)
    with closing(sqlite3.connect(old)) as connection:
        assert connection.execute("SELECT note FROM trials").fetchall() == [("novel",), ("novel",)]
    assert memory_files.load_memory(old) == opened


def test_a_step_that_fails_leaves_the_old_version(old, monkeypatch):
    before = memory_json.memory_to_json(memory_files.load_memory(old))
    with monkeypatch.context() as patch:
        patch.setattr(schema, "MIGRATIONS", (*schema.MIGRATIONS, (*NEXT, "nonsense")))
        with pytest.raises(InvalidInputError, match="syntax error"):
            open_memory(old)
    assert pragma(old, "user_version") == 1
    assert memory_json.memory_to_json(memory_files.load_memory(old)) == before


def test_a_file_of_a_later_version_is_refused_and_left_alone(old):
    with closing(sqlite3.connect(old)) as connection:
        connection.execute("PRAGMA user_version = 9")
    before = old.read_bytes()
    for use in (memory_files.load_memory, open_memory):
        with pytest.raises(InvalidInputError, match="schema version 9, of a later atg-fg; expected at most 6"):
            use(old)
    assert old.read_bytes() == before
