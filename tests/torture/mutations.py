"""Files of every kind that this project reads, damaged at random: file number i of a seed is always the same bytes.

Where bytes alone would never get past the first check (a checksum, a page, the directory of an archive), what is in
them is damaged, and packed as it should be.
"""

from __future__ import annotations

import copy
import io
import json
import os
import random
import sqlite3
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from tests.torture.originals import originals, packed, unpacked

#: Where files are in RAM, so that the time is the reader's own.
FAST = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
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


#: Kinds that are no text, and those that are a text of their own.
_BINARY: Final = ("picture", "MCAP bag", "SQLite bag", "bag of ROS 1")
_NO_JSON: Final = ("UAI model", "UAI evidence", "mapping", "bag metadata")
#: Texts in which more than words is damaged.
_INSIDE_TEXT: Final = ("trial record", "ablation log", "URDF", "recorded lines", "recorded table")


def mutated(seed: int, number: int, kinds: tuple[str, ...] | None = None) -> tuple[str, bytes]:
    """Return kind and content of a damaged file."""
    rng = random.Random(f"{seed}:{number}")
    there = kinds or tuple(originals())
    kind = there[number % len(there)]
    content = rng.choice(originals()[kind])
    inside = _INSIDE.get(kind)
    if inside is not None and rng.random() < (0.5 if "database" in kind else 0.8):
        return kind, inside(rng, content)
    is_text = kind not in _BINARY and (kind not in _INSIDE or kind in _INSIDE_TEXT)
    if is_text and kind not in (*_NO_JSON, *_INSIDE) and rng.random() < 0.6:
        return kind, _damaged_document(rng, content)
    return kind, _damaged_words(rng, content) if is_text and rng.random() < 0.7 else _damaged_bytes(rng, content)


def _damaged_lines(rng: random.Random, lines: list[bytes]) -> list[bytes]:
    """Return the lines of a log with some of them damaged, repeated, left out, or put elsewhere."""
    lines = list(lines)
    for _ in range(rng.choice((1, 1, 2, 4))):
        where = rng.randrange(len(lines))
        change = rng.randrange(8)
        if change < 5:
            lines[where] = _damaged_document(rng, lines[where])
        elif change == 5:
            lines[where:where] = [lines[where]] * rng.choice((1, 2, 200))
        elif change == 6 and len(lines) > 1:
            del lines[where]
        else:
            rng.shuffle(lines)
        if not any(lines):
            break
    return lines


def _damaged_log(rng: random.Random, content: bytes) -> bytes:
    return packed(_damaged_lines(rng, unpacked(content)))


def _damaged_text_log(rng: random.Random, content: bytes) -> bytes:
    return b"".join(line + b"\n" for line in _damaged_lines(rng, content.splitlines()))


def _damaged_table_of_text(rng: random.Random, content: bytes) -> bytes:
    """Return a CSV with cells, columns or rows exchanged, repeated or left out; packed at times."""
    rows = [line.split(",") for line in content.decode().splitlines()]
    for _ in range(rng.choice((1, 1, 2, 4))):
        row, change = rng.randrange(len(rows)), rng.randrange(8)
        column = rng.randrange(max(1, len(rows[row])))
        if change < 4:
            rows[row][column : column + 1] = [rng.choice((*_WORDS, *_CELLS))]
        elif change == 4:
            rows[row:row] = [list(rows[row])] * rng.choice((1, 2, 300))
        elif change == 5 and len(rows) > 1:
            del rows[row]
        elif change == 6:
            rows = [
                each[:column] + each[column : column + 1] * rng.choice((0, 2, 40)) + each[column + 1 :] for each in rows
            ]
        else:
            other = rng.randrange(len(rows))
            rows[row], rows[other] = rows[other], rows[row]
    end, between = rng.choice(("\n", "\n", "\r\n", "\r")), rng.choice((",", ",", ";", "\t"))
    text = end.join(between.join(row) for row in rows)
    whole = text.encode("utf-8", "surrogatepass")
    return packed([whole]) if rng.random() < 0.2 else whole


_CELLS: Final = (
    *('"', '""', '"a""b"', '"two\nlines"', "\r", "a;b", "0,5", "label=", "=x", "label:confidence", "trial", "step"),
    *("object", "confidence", " ", "\u2028", "+1", "1e0", "-0", "inf", "\u0661", "x" * 1001, "label=x", "=1+1"),
)


def _damaged_packed_document(rng: random.Random, content: bytes) -> bytes:
    return packed([_damaged_document(rng, b"".join(unpacked(content)))])


def _damaged_arrays(rng: random.Random, content: bytes) -> bytes:
    """Return a file of arrays with other numbers, lengths or types, or with other arrays."""
    with np.load(io.BytesIO(content)) as file:
        arrays = {name: file[name] for name in file.files}
    for _ in range(rng.choice((1, 1, 2, 3))):
        name = rng.choice(list(arrays))
        array, change = arrays[name], rng.randrange(8)
        if name == "header" and rng.random() < 0.7:
            document = _damaged_document(rng, array.astype(np.uint8).tobytes())
            arrays[name] = np.frombuffer(document, dtype=np.uint8)
        elif change < 3 and array.size:
            array = array.astype(np.int64)
            array.flat[rng.randrange(array.size)] = rng.choice(
                (-1, 0, 1, 5, 24, 255, 2**31, 2**53, 2**63 - 1, -(2**63))
            )
            arrays[name] = array
        elif change == 3 and array.ndim:
            arrays[name] = array[: rng.randrange(array.size + 1)]
        elif change == 4 and array.ndim:
            arrays[name] = np.concatenate([array] * rng.choice((2, 3, 100)))
        elif change == 5:
            kind = rng.choice(("f8", "i1", "u1", "i2", "u8", "?", "c16", "S3", "U2", "M8[s]"))
            with np.errstate(all="ignore"):
                arrays[name] = array.astype(kind)
        elif change == 6:
            arrays[name] = rng.choice((array.reshape(1, -1), np.zeros((0, 3), dtype=np.int64), np.array(5)))
        else:
            arrays.pop(name) if rng.random() < 0.5 else arrays.update({"more": array})
        if not arrays:
            break
    file = io.BytesIO()
    save = np.savez_compressed if rng.random() < 0.3 else np.savez
    save(file, **arrays)
    return _with_other_headers(rng, file.getvalue()) if rng.random() < 0.2 else file.getvalue()


def _with_other_headers(rng: random.Random, content: bytes) -> bytes:
    """Return an archive in which the head of an array says something else of it."""
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as source, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as target:
        for name in source.namelist():
            data, head = source.read(name), io.BytesIO()
            if rng.random() < 0.4:
                shape = rng.choice(((10**12,), (-1,), (2**40, 2), (), (3,), (10**400,)))
                said = {"descr": rng.choice(("<i8", "|u1", "|O", "<U9")), "fortran_order": False, "shape": shape}
                np.lib.format.write_array_header_2_0(head, said)
                data = head.getvalue() + data[128:]
            elif rng.random() < 0.3:
                data = _damaged_bytes(rng, data[:128]) + data[128:]
            target.writestr(name, data)
    return file.getvalue()


def _damaged_xml(rng: random.Random, content: bytes) -> bytes:
    """Return a tree of elements with attributes, elements or names of them exchanged."""
    root = ElementTree.fromstring(content)
    for _ in range(rng.choice((1, 1, 2, 4))):
        elements = list(root.iter())
        element, change = rng.choice(elements), rng.randrange(6)
        if change < 3 and element.attrib:
            element.set(rng.choice(list(element.attrib)), rng.choice(_XML_VALUES))
        elif change == 3 and len(element):
            element.remove(rng.choice(list(element)))
        elif change == 4 and len(elements) < 5000:
            copied = [copy.deepcopy(each) for each in rng.choice(elements)]
            element.extend(copy.deepcopy(each) for each in copied * rng.choice((1, 2, 50)))
        else:
            element.tag = rng.choice(elements).tag
    return ElementTree.tostring(root)


_XML_VALUES: Final = (
    *("", "nan", "inf", "-1", "1e400", "0 0", "0 0 0 0", "1 0 0", "9" * 400, "base", "arm", "hand", "r", "shoulder"),
    *(
        "../../../../etc/passwd",
        "package://r/../../a.stl",
        "file:///dev/zero",
        "/dev/stdin",
        "x" * 10**5,
        "\u2028",
        "mesh",
    ),
)
#: What is damaged inside of a file that is packed anew, by kind.
_INSIDE: Final[dict[str, Callable[[random.Random, bytes], bytes]]] = {}


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
    try:
        document = json.loads(content)
    except ValueError:  # damaged before
        return _damaged_bytes(rng, content)
    if isinstance(document, dict) and "assumptions" in document and "memory" in document and rng.random() < 0.25:
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
            other = rng.choice(holders or [[0]])
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


_INSIDE |= {
    "database": _damaged_database,
    "structured database": _damaged_database,
    "compact memory": _damaged_arrays,
    "SQLite bag": _damaged_database,
    "recorded table": _damaged_table_of_text,
    "recorded lines": _damaged_text_log,
    "test log": _damaged_log,
    "goal run": _damaged_packed_document,
    "trial record": _damaged_text_log,
    "ablation log": _damaged_text_log,
    "URDF": _damaged_xml,
}
