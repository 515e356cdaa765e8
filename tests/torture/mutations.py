"""Files of every kind that this project reads, damaged at random: file number i of a seed is always the same bytes."""

from __future__ import annotations

import json
import os
import random
import sqlite3
import tempfile
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import RandomPolicy
from atg_fg.storage import memory_files, memory_json
from atg_fg.storage.memory_files import open_memory
from atg_fg.storage.scripted_trial import read_script
from atg_fg.storage.uai import write_evidence, write_model
from atg_fg.storage.uai_export import export_trial
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.registry import make_world

#: Where files are in RAM, so that the time is the reader's own.
FAST = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
KINDS = ("memory", "structured memory", "script", "UAI model", "UAI evidence", "database", "structured database")
_SCRIPT = Path(__file__).parents[1] / "data" / "scripted_trial.json"
_UAI = "MARKOV\n3\n2 3 2\n3\n2 0 1\n1 2\n3 0 1 2\n\n6\n1 2 3 4 5 6.5\n2\n0 1\n12\n" + "0.5 1e-3 2 7 0 1 " * 2 + "\n"
_WORDS = (
    *("0", "1", "-1", "2", "3", "64", "65", "1000", "100000", "4294967296", "9007199254740993", "18446744073709551616"),
    *("1e400", "1e-400", "-0.0", "0.1", "1.5", "NaN", "Infinity", "-Infinity", "null", "true", "false", '""', "[]"),
    *("{}", '"\\ud800"', '"\\u0000"', '"flip"', '"object-000"', "9" * 400, "9" * 5000, "[" * 2000, "\ufeff", "\x00"),
)
_VALUES: tuple[Any, ...] = (
    *(0, 1, -1, 2, 5, 12, 24, 63, 64, 65, 132, 133, 300, 10**4, 10**5, 10**9, 2**53, 2**53 + 1, 2**63, 2**64, 10**30),
    *(10**400, 0.0, -0.0, 0.5, 1e-300, 1e300, 1e-8, 1.0, True, False, None, "", "flip", "left", "object-000", "\ud800"),
    *("a\x00b", "a\nb", "\u2028", "x" * 10**5, [], {}, [[]], [None], [0, 1], [1, 0], [None, None], [0, 0], [[0, 1]]),
    *(["flip"], {"flip": [0]}, list(range(50)), [0] * 10**4, [[0, 1]] * 10**3, {"act": "flip"}, {"observe": [0, 1]}),
)


@cache
def originals() -> dict[str, list[bytes]]:
    """Sound files of each kind."""
    plain, structured = _memory(structured=False, n_trials=5), _memory(structured=True, n_trials=2)
    exported = export_trial(read_script(_SCRIPT.read_text()))
    return {
        "memory": [memory_json.memory_to_json(plain).encode()],
        "structured memory": [memory_json.memory_to_json(structured).encode()],
        "script": [_SCRIPT.read_bytes(), _long_script()],
        "UAI model": [_UAI.encode(), write_model(exported.model).encode()],
        "UAI evidence": [b"2 0 1 2 0\n", b"1\n1 3 2\n", write_evidence(exported.evidence).encode()],
        "database": [_database(plain, n_trials=4)],
        "structured database": [_database(structured, n_trials=1)],
    }


def mutated(seed: int, number: int) -> tuple[str, bytes]:
    """Return kind and content of a damaged file."""
    rng = random.Random(f"{seed}:{number}")
    kind = KINDS[number % len(KINDS)]
    content = rng.choice(originals()[kind])
    if "database" in kind:
        return kind, _damaged_database(rng, content) if rng.random() < 0.5 else _damaged_bytes(rng, content)
    if "UAI" not in kind and rng.random() < 0.6:
        return kind, _damaged_document(rng, content)
    return kind, _damaged_words(rng, content) if rng.random() < 0.7 else _damaged_bytes(rng, content)


def _damaged_bytes(rng: random.Random, content: bytes) -> bytes:
    """Return a file with bits turned, or parts of it cut out, repeated, zeroed, put elsewhere or cut off."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 3, 8, 40))):
        start = rng.randrange(len(data)) if data else 0
        # The first bytes of a database, and of each of its pages, say the most.
        start = rng.choice((start, start, start // 4096 * 4096 + rng.randrange(12), rng.randrange(100)))
        length = rng.choice((1, 1, 2, 4, 16, 100, 4096))
        part = data[start : start + length]
        change = rng.randrange(7)
        if change == 0 and part:
            data[start] ^= 1 << rng.randrange(8)
        elif change == 1:
            del data[start : start + length]
        elif change == 2:
            data[start:start] = part * rng.choice((1, 2, 50))
        elif change == 3:
            data[start : start + length] = bytes(len(part))
        elif change == 4:
            where = rng.randrange(len(data)) if data else 0
            data[where : where + len(part)] = part
        elif change == 5:
            data[start : start + length] = rng.randbytes(len(part))
        elif change == 6 and rng.random() < 0.3:
            del data[start:]
    return bytes(data)


def _damaged_words(rng: random.Random, content: bytes) -> bytes:
    """Return a text with some of its words replaced, repeated or left out."""
    words = content.decode().replace(",", " , ").replace("[", " [ ").replace("]", " ] ").split(" ")
    for _ in range(rng.choice((1, 1, 2, 3, 6))):
        where = rng.randrange(len(words)) if words else 0
        change = rng.randrange(4) if words else 3
        if change < 2:
            words[where] = rng.choice(_WORDS)
        elif change == 2:
            words[where:where] = words[where : where + rng.choice((1, 5, 30))] * rng.choice((1, 2, 20))
        else:
            del words[where : where + rng.choice((1, 2, 10))]
    return " ".join(words).encode("utf-8", "surrogatepass")


def _damaged_document(rng: random.Random, content: bytes) -> bytes:
    """Return a JSON document with some of its values replaced, repeated, moved or left out, or made large."""
    document = json.loads(content)
    if rng.random() < 0.25:
        _enlarge(rng, document)
        if rng.random() < 0.7:
            return json.dumps(document).encode()
    for _ in range(rng.choice((1, 1, 1, 2, 3, 5))):
        holders: list[Any] = []
        _collect(document, holders)
        holder = rng.choice(holders or [[0]])
        keys = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
        key = rng.choice(keys)
        change = rng.randrange(6)
        if change < 3:
            holder[key] = _copy(rng.choice(_VALUES))
        elif change == 3:
            del holder[key]
        elif change == 4 and isinstance(holder, list):
            holder[key:key] = [_copy(holder[key]) for _ in range(rng.choice((1, 2, 100)))]
        else:
            other = rng.choice(holders)
            holder[key] = _copy(other)
        if not isinstance(document, (dict, list)) or not document:
            break
    return json.dumps(document).encode()


def _copy(value: Any) -> Any:
    """Return a value of its own: what is put into one document must not be changed by what is done to another one."""
    return json.loads(json.dumps(value))


def _enlarge(rng: random.Random, document: dict[str, Any]) -> None:
    """Make a document larger that may still be sound: it is to be refused, or dealt with in time."""
    assumptions = document["assumptions"]
    assumptions["n_symbols"] = rng.choice((12, 13, 30, 100, 317))
    assumptions["n_objects"] = rng.choice((1, 100, 10**6, 2**53))
    if rng.random() < 0.5:
        n_patterns = assumptions["n_symbols"] * (assumptions["n_symbols"] - 1)
        assumptions["n_aspects"] = rng.choice((24, 132, n_patterns, n_patterns // 2))
    if rng.random() < 0.3:
        copies = document["memory"] * rng.choice((2, 50))
        document["memory"] = [{**each, "name": f"object-{number}"} for number, each in enumerate(copies)]
    if "steps" in document and rng.random() < 0.3:
        document["steps"] += document["steps"][1:] * rng.choice((1, 10, 50))


def _collect(value: Any, holders: list[Any]) -> None:
    if isinstance(value, (dict, list)) and value:
        holders.append(value)
        for each in value.values() if isinstance(value, dict) else value:
            _collect(each, holders)


def _damaged_database(rng: random.Random, content: bytes) -> bytes:
    """Return a database whose pages are sound, and that says what it must not."""
    with tempfile.TemporaryDirectory(dir=FAST) as folder:
        path = Path(folder) / "damaged.db"
        path.write_bytes(content)
        with closing(sqlite3.connect(path, isolation_level=None)) as connection:
            connection.execute("PRAGMA journal_mode = MEMORY")
            connection.execute("PRAGMA synchronous = OFF")
            connection.execute("PRAGMA ignore_check_constraints = ON")
            tables = [name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
            for _ in range(rng.choice((1, 1, 2, 4))):
                try:
                    _damage_table(rng, connection, rng.choice(tables))
                except (sqlite3.Error, OverflowError, UnicodeError):
                    continue  # the change itself was refused
        return path.read_bytes()


def _damage_table(rng: random.Random, connection: sqlite3.Connection, table: str) -> None:
    columns = [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
    change = rng.randrange(10)
    if change < 6 and columns:
        value = rng.choice((*_VALUES, b"\xff\xfe", b"", 1e999, "[0, 1", '{"a": 1}', "[[0]]", "[null]"))
        value = json.dumps(value) if isinstance(value, (list, dict)) else value
        where = rng.choice(("", " WHERE rowid = 1", " WHERE number = 0", " WHERE id = 2"))
        connection.execute(f"UPDATE {table} SET {rng.choice(columns)} = ?{where}", (value,))
    elif change == 6:
        connection.execute(f"DELETE FROM {table}")
    elif change == 7:
        connection.execute(rng.choice((f"DROP TABLE {table}", f"ALTER TABLE {table} RENAME TO other")))
    elif change == 8:
        pragma = rng.choice(("user_version", "application_id", "schema_version"))
        connection.execute(f"PRAGMA {pragma} = {rng.choice((0, 1, 2, -1, 2**31 - 1))}")
    else:
        connection.execute("PRAGMA writable_schema = ON")
        sql = rng.choice(("", "CREATE TABLE x (a)", "CREATE VIEW x AS SELECT * FROM x", "nonsense"))
        connection.execute("UPDATE sqlite_master SET sql = ? WHERE name = ?", (sql, table))


def _memory(*, structured: bool, n_trials: int) -> RobotMemory:
    memory = memory_for(ModelParameters(learn_structure=structured), RobotMemory(arcube_assumptions()))
    _learn(memory, n_trials)
    memory.merge(memory.names[0], memory.names[-1])
    return memory


def _learn(memory: RobotMemory, n_trials: int) -> None:
    with closing(make_world("ideal", cubes=make_arcubes(4, seed=0))) as world:
        for number in range(n_trials):
            inference = begin_trial("bayes-filter", memory, ModelParameters())
            learn_from(run_trial(world, inference, RandomPolicy(), 6, np.random.default_rng(number)), memory)


def _database(memory: RobotMemory, n_trials: int) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.db"
        memory_files.save_memory(memory, path)
        with open_memory(path) as opened:
            opened.begin_experiment("torture", {"actions": 6}, seed=0)
            _learn(opened, n_trials)
        return path.read_bytes()


def _long_script() -> bytes:
    """A script with several ATGs and many steps."""
    document = json.loads(_SCRIPT.read_bytes())
    document["memory"] = json.loads(memory_json.memory_to_json(_memory(structured=False, n_trials=5)))["memory"]
    steps = [{"act": "flip"}, {"observe": [1, None]}, {"act": "left"}, {"observe": [None, 3]}]
    document["steps"] = [{"observe": [0, 1]}, *steps * 3]
    return json.dumps(document).encode()
