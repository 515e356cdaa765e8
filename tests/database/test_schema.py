import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from atg_fg import store
from atg_fg.database import schema
from atg_fg.errors import InvalidInputError
from atg_fg.memory import RobotMemory
from tests.database.small import ARCUBES, add_cube

FIXTURE = Path(__file__).parents[1] / "data" / "formats" / "memory-schema-1.db"
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
    RobotMemory.open(tmp_path / "robot.db", ARCUBES).close()
    assert pragma(tmp_path / "robot.db", "user_version") == len(schema.MIGRATIONS) == 1
    assert pragma(tmp_path / "robot.db", "application_id") == schema.APPLICATION_ID
    assert pragma(tmp_path / "robot.db", "journal_mode") == "wal"


@pytest.mark.usefixtures("later")
def test_an_older_file_is_read_as_it_is_and_led_on_when_it_is_written(old):
    before = old.read_bytes()
    memory = store.load_memory(old)
    assert memory.names == ("object-000", "object-001")
    assert old.read_bytes() == before
    with RobotMemory.open(old) as opened:
        assert opened == memory
        assert len(list(opened.trials())) == 2
        add_cube(opened, 5)
    assert pragma(old, "user_version") == 2
    with closing(sqlite3.connect(old)) as connection:
        assert connection.execute("SELECT note FROM trials").fetchall() == [("novel",), ("novel",)]
    assert store.load_memory(old) == opened


def test_a_step_that_fails_leaves_the_old_version(old, monkeypatch):
    before = store.memory_to_json(store.load_memory(old))
    with monkeypatch.context() as patch:
        patch.setattr(schema, "MIGRATIONS", (*schema.MIGRATIONS, (*NEXT, "nonsense")))
        with pytest.raises(InvalidInputError, match="syntax error"):
            RobotMemory.open(old)
    assert pragma(old, "user_version") == 1
    assert store.memory_to_json(store.load_memory(old)) == before


def test_a_file_of_a_later_version_is_refused_and_left_alone(old):
    with closing(sqlite3.connect(old)) as connection:
        connection.execute("PRAGMA user_version = 2")
    before = old.read_bytes()
    for use in (store.load_memory, RobotMemory.open):
        with pytest.raises(InvalidInputError, match="schema version 2, of a later atg-fg; expected at most 1"):
            use(old)
    assert old.read_bytes() == before
