import json
import os

import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.storage import memory_files, memory_json, plain_files
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern


@pytest.fixture
def memory():
    assumptions = arcube_assumptions()
    result = RobotMemory(assumptions)
    for cube in make_arcubes(3, seed=0):
        orientations = [0]
        actions = [0, 1, 2, 2, 0, 1]
        for action in actions:
            orientations.append(SUCCESSORS[orientations[-1]][action])
        patterns = [assumptions.alphabet.index(shown_pattern(cube, where)) for where in orientations]
        result.learn(patterns, actions, matched=None)
    return result


def changed(memory, change):
    document = json.loads(memory_json.memory_to_json(memory))
    change(document)
    return json.dumps(document)


def test_saving_and_loading_changes_nothing(memory, tmp_path):
    memory_files.save_memory(memory, tmp_path / "memory.json")
    assert memory_files.load_memory(tmp_path / "memory.json") == memory


def test_a_text_may_begin_with_a_mark_of_its_encoding_as_some_editors_write_it(memory, tmp_path):
    path = tmp_path / "memory.json"
    path.write_bytes(b"\xef\xbb\xbf" + memory_json.memory_to_json(memory).encode())
    assert memory_files.load_memory(path) == memory
    path.write_bytes(b"\xef\xbb\xbfBAYES\n\xff")
    with pytest.raises(InvalidInputError, match="line 2: byte 0xff, not UTF-8"):
        plain_files.read_text_file(path)


def test_a_failed_write_leaves_the_old_file_and_no_other(memory, tmp_path, monkeypatch):
    path = tmp_path / "memory.json"
    memory_files.save_memory(memory, path)
    before = path.read_bytes()

    def no_space_left(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_space_left)
    with pytest.raises(InvalidInputError, match="No space left on device"):
        memory_files.save_memory(RobotMemory(memory.assumptions), path)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["memory.json"]


@pytest.mark.parametrize("path", ["no/such/folder/file.json", "file.json/inside.json"])
def test_a_path_that_cannot_be_written_is_named(tmp_path, path, memory):
    (tmp_path / "file.json").write_text("here")
    for write in (plain_files.check_writable, lambda where: memory_files.save_memory(memory, where)):
        with pytest.raises(InvalidInputError, match="cannot be written"):
            write(tmp_path / path)
    assert (tmp_path / "file.json").read_text() == "here"


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(InvalidInputError, match="is a folder"):
        plain_files.check_writable(tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(format="other"), "format: 'other'; expected 'atg-fg/memory'"),
        (lambda d: d.update(version=2), "version: 2; expected 1"),
        (lambda d: d.update(version=True), "version: True; expected 1"),
        (lambda d: d.update(more=1), "unknown key 'more'"),
        (lambda d: d.pop("memory"), "key 'memory' is missing"),
        (lambda d: d["assumptions"].update(n_objects=0), "n_objects: 0; expected a whole number of at least 1"),
        (lambda d: d["assumptions"].update(n_objects=10**400), "n_objects: 1000"),
        (lambda d: d["assumptions"].update(n_aspects=133), "n_aspects: 133; expected at most the 132 patterns"),
        (lambda d: d["assumptions"].update(slots=[]), "slots: .*; expected at least one name"),
        (lambda d: d["assumptions"].update(n_symbols=1), "expected at least one symbol for each of 2 slots"),
        (lambda d: d["assumptions"].update(n_symbols=10**400), "too many patterns"),
        (lambda d: d["assumptions"].update(actions=["flip", "flip"]), "actions: .*; expected .* all different"),
        (lambda d: d["assumptions"].update(actions="flip"), "actions: 'flip'; expected a list"),
        (lambda d: d["memory"][1].update(name="object-000"), r"memory\[1\].*'object-000' is repeated"),
        (lambda d: d["memory"][1].update(name=""), r"memory\[1\].name: ''"),
        (lambda d: d["memory"][0]["aspects"].append([3, 3]), "slot 'top': symbol 3 is repeated"),
        (lambda d: d["memory"][0]["aspects"].append([3, 12]), "symbol 12; expected 0 to 11"),
        (lambda d: d["memory"][0]["aspects"].append([3]), "expected one entry for each of 2 slots"),
        (lambda d: d["memory"][0]["aspects"].append([3, None]), "missing symbol; expected a complete pattern"),
        (lambda d: d["memory"][0]["aspects"].append([3, 1.0]), "1.0; expected a whole number"),
        (lambda d: d["memory"][0]["aspects"].append([True, 1]), "True; expected a whole number"),
        (lambda d: d["memory"][0]["aspects"].append(d["memory"][0]["aspects"][0]), "is repeated; expected unique"),
        (lambda d: d["memory"][0]["transitions"][0].update({"to": 99}), r"transitions\[0\].*target aspect: 99"),
        (lambda d: d["memory"][0]["transitions"][0].update({"from": -1}), "from: -1"),
        (
            lambda d: d["memory"][0]["transitions"][0].update(action="jump"),
            "'jump'; expected one of: flip, left, right",
        ),
        (lambda d: d["memory"][0]["transitions"][0].update(action=["flip"]), "expected one of: flip, left, right"),
        (lambda d: d["memory"][0]["transitions"][0].update(count=0), "count: 0; expected a whole number"),
        (lambda d: d["memory"][0]["transitions"][0].update(count=1.5), "count: 1.5; expected a whole number"),
        (lambda d: d["memory"][0]["transitions"][0].update(count=2**60), "count: .*; expected .* 9007199254740992"),
        (lambda d: d.update(memory={}), "memory: {}; expected a list"),
    ],
)
def test_a_malformed_memory_file_is_refused_with_place_and_value(memory, tmp_path, change, message):
    path = tmp_path / "bad.json"
    path.write_text(changed(memory, change))
    with pytest.raises(InvalidInputError, match=message) as caught:
        memory_files.load_memory(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_file_cut_off_anywhere_is_refused(memory):
    text = memory_json.memory_to_json(memory).rstrip()
    for length in range(0, len(text), 7):
        with pytest.raises(InvalidInputError):
            memory_json.memory_from_json(text[:length])


@pytest.mark.parametrize("text", ["", "NaN", "[" * 100_000, '{"format": 1, "format": 2}', "1" * 5000])
def test_what_is_not_json_is_refused(text):
    with pytest.raises(InvalidInputError):
        memory_json.memory_from_json(text)


def test_bytes_that_are_no_text_are_refused(tmp_path):
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00\x01\x80")
    with pytest.raises(InvalidInputError, match="not UTF-8"):
        memory_files.load_memory(tmp_path / "binary")


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InvalidInputError, match=r"absent.json: cannot be read: No such file"):
        memory_files.load_memory(tmp_path / "absent.json")
