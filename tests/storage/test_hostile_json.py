"""What JSON can say that no reader expects, at each place of a file of each kind: one short error, in little time."""

import gc
import json
import time
from collections.abc import Iterator

import pytest

from atg_fg.core.errors import MAX_MESSAGE, AtgError
from tests.torture.originals import originals, packed, unpacked
from tests.torture.reading import read_as

MARK = "\ue000"
ODD = {
    "lists of 10,000 levels": "[" * 10_000 + "]" * 10_000,
    "objects of 10,000 levels": '{"a":' * 10_000 + "1" + "}" * 10_000,
    "10**400": f"1{'0' * 400}",
    "-10**400": f"-1{'0' * 400}",
    "5000 digits": "9" * 5000,
    "NaN": "NaN",
    "-Infinity": "-Infinity",
    "1e999": "1e999",
    "half a character": '"\\ud800"',
    "line separator": '"a\u2028b"',
    "NUL": '"a\\u0000b"',
    "escape": '"\\u001b[2J"',
    "repeated key": '{"a": 1, "a": 2}',
}
LARGE = {
    "key of a megabyte": f'{{"{"k" * 10**6}": 1}}',
    "text of a megabyte": f'"{"s" * 10**6}"',
    "number of a megabyte": "9" * 10**6,
    "fraction of a megabyte": f"0.{'9' * 10**6}",
    "100,000 keys": "{" + ",".join(f'"k{number}":1' for number in range(100_000)) + "}",
    "100,000 keys and one of them again": "{" + "".join(f'"k{n}":1,' for n in range(100_000)) + '"k99999":2}',
    "a million lists": f"[{'[],' * 10**6}[]]",
    "10,000,000 numbers": f"[{'1,' * 10**7}1]",
}
#: Kinds of one document, and of lines of them.
DOCUMENTS = ("memory", "structured memory", "script", "result", "preset", "counts", "tags", "calibration")
KINDS = (
    *DOCUMENTS,
    "recording spec",
    "bag topics",
    "goal run",
    "trial record",
    "ablation log",
    "recorded lines",
    "test log",
)
PACKED = ("goal run", "test log")


def places(value: object, depth: int = 2) -> Iterator[object]:
    """Yield the value with the mark in place of itself, of what it holds, and of an unknown key's value."""
    yield MARK
    if not depth:
        return
    for key, each in list(
        value.items() if isinstance(value, dict) else enumerate(value[:2]) if isinstance(value, list) else ()
    ):
        for changed in places(each, depth - 1):
            yield value | {key: changed} if isinstance(value, dict) else [*value[:key], changed, *value[key + 1 :]]
    if isinstance(value, dict):
        yield value | {"more": MARK}


def files(kind: str, what: str, depth: int) -> Iterator[bytes]:
    """Yield files of a kind that say this at one place each, in the first line and the last one."""
    content = originals()[kind][0]
    whole = (
        unpacked(content)
        if kind in PACKED
        else [content]
        if kind in (*DOCUMENTS, "recording spec", "bag topics")
        else content.splitlines()
    )
    for number in {0, len(whole) - 1}:
        for changed in places(json.loads(whole[number]), depth):
            line = json.dumps(changed, ensure_ascii=False).replace(f'"{MARK}"', what).encode()
            lines = [*whole[:number], line, *whole[number + 1 :]]
            yield packed(lines) if kind in PACKED else b"\n".join(lines) + b"\n"


@pytest.fixture(autouse=True)
def nothing_of_other_tests_to_collect():
    """Leave what other tests made out of the collections that a million new lists set off: they would be timed, too."""
    gc.freeze()
    yield
    gc.unfreeze()


def check(kind, content, folder):
    begun, message = time.process_time(), ""
    try:
        read_as(kind, content, folder)
    except AtgError as error:
        message = str(error)
    took = time.process_time() - begun
    assert "\n" not in message
    assert len(message) < MAX_MESSAGE + 200
    # A megabyte a second: what is made of each of a million empty lists takes longer than to read it.
    size = sum(map(len, unpacked(content))) if kind in PACKED else len(content)
    assert took < 4 + size / 1e6


@pytest.mark.parametrize("depth", [1, pytest.param(3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", KINDS)
def test_odd_values_are_read_or_refused_in_one_line(kind, depth, tmp_path):
    for what in ODD.values():
        for content in files(kind, what, depth):
            check(kind, content, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("what", LARGE)
@pytest.mark.parametrize("kind", KINDS)
def test_large_values_take_no_more_time_than_their_size(kind, what, tmp_path):
    for content in list(files(kind, LARGE[what], 1))[:4]:
        check(kind, content, tmp_path)
