"""Files of arrays: whole, checked, and refused with one line."""

import json
import zipfile

import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.compact.compact_memory import CompactMemory
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import memory_files
from atg_fg.storage.compact_file import load_compact_memory, save_compact_memory
from atg_fg.storage.memory_files import load_memory, save_memory
from benchmarks.large_memory import synthetic_memory


@pytest.fixture
def file(tmp_path):
    save_compact_memory(synthetic_memory(5, seed=0), tmp_path / "memory.npz")
    return tmp_path / "memory.npz"


def changed(file, **arrays):
    with np.load(file) as old:
        content = {name: old[name] for name in old.files}
    content |= arrays
    np.savez(file, **{name: array for name, array in content.items() if array is not None})


def header_of(file, **change):
    with np.load(file) as old:
        document = json.loads(old["header"].tobytes())
    return np.frombuffer(json.dumps({**document, **change}).encode(), dtype=np.uint8)


def arrays_of(file):
    with np.load(file) as old:
        return {name: old[name].astype(np.int64) for name in old.files}


def test_a_memory_comes_back_as_it_was(file):
    assert list(load_compact_memory(file)) == list(synthetic_memory(5, seed=0))
    empty = CompactMemory(arcube_assumptions())
    save_compact_memory(empty, file)
    assert len(load_compact_memory(file)) == 0


def test_the_name_says_which_kind_of_file_it_is(tmp_path):
    memory = RobotMemory(arcube_assumptions())
    memory.learn([0, 1, 2], [0, 1], matched=None)
    for name in ("memory.json", "memory.npz"):
        save_memory(memory, tmp_path / name)
        assert list(load_memory(tmp_path / name)) == list(memory)
    assert memory_files.load_memory(tmp_path / "memory.json") == memory


def test_arrays_are_told_by_how_they_begin_whatever_their_name(file, tmp_path):
    file.rename(tmp_path / "memory.json")
    assert list(load_memory(tmp_path / "memory.json")) == list(synthetic_memory(5, seed=0))


def test_what_arrays_cannot_hold_is_refused_rather_than_lost(tmp_path):
    structured = StructuredMemory(arcube_assumptions())
    with pytest.raises(InvalidInputError, match="expected ATGs alone"):
        save_memory(structured, tmp_path / "memory.npz")
    assert not (tmp_path / "memory.npz").exists()


def test_what_is_no_such_file_is_refused(file, tmp_path):
    with pytest.raises(InvalidInputError, match=r"absent\.npz: cannot be read"):
        load_compact_memory(tmp_path / "absent.npz")
    content = file.read_bytes()
    for wrong in (b"", b"no archive", content[: len(content) // 2], content.replace(b"NUMPY", b"NYMPH")):
        file.write_bytes(wrong)
        with pytest.raises(InvalidInputError, match=r"memory\.npz: "):
            load_compact_memory(file)
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("header.npy", b"")
    with pytest.raises(InvalidInputError, match=r"memory\.npz: not a compact memory; expected arrays action, counts"):
        load_compact_memory(file)
    with zipfile.ZipFile(file, "w") as archive:
        for name in ("action", "counts", "header", "n_edges", "n_known", "patterns", "source", "target"):
            archive.writestr(f"{name}.npy", b"")
    with pytest.raises(InvalidInputError, match=r"memory\.npz: "):
        load_compact_memory(file)
    np.save(tmp_path / "alone.npy", np.zeros(3))
    with pytest.raises(InvalidInputError, match="expected a compact memory"):
        load_compact_memory(tmp_path / "alone.npy")


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("n_known", lambda a: a[:-1], "n_known: 4 entries; expected 5"),
        ("n_known", lambda a: a + 20, "n_known.0.: .*; expected 0 to 24"),
        ("n_known", lambda a: a - 1, "patterns: .* entries; expected"),
        ("n_edges", lambda a: a + 1, "source: .* entries; expected"),
        ("n_edges", lambda a: a - 100, "n_edges.0.: "),
        ("patterns", lambda a: a + 132, "patterns.0.: .*; expected 0 to 131"),
        ("patterns", lambda a: a * 0, "patterns.1.: repeated; expected unique patterns"),
        ("source", lambda a: a + 23, "source.*expected"),
        ("target", lambda a: a * 0 + 20, "target.0.: aspect 20; expected less than"),
        ("action", lambda a: a + 3, "action.0.: .*; expected 0 to 2"),
        ("counts", lambda a: a * 0, "counts.0.: 0; expected 1 to"),
        ("counts", lambda a: a.astype(float), "counts: 1 dimensions of float64; expected one dimension of whole"),
        ("counts", lambda a: a[None], "counts: 2 dimensions"),
        ("counts", lambda _: None, "not a compact memory; expected arrays"),
        ("counts", lambda _: np.array([{}], dtype=object), "not a sound file of arrays"),
        ("header", lambda a: a[:-1], "header: not valid JSON"),
        ("header", lambda a: a * 0 + 255, "header: not a UTF-8 text"),
    ],
)
def test_what_is_wrong_in_it_is_named(file, name, change, message):
    changed(file, **{name: change(arrays_of(file)[name])})
    with pytest.raises(InvalidInputError, match=message):
        load_compact_memory(file)


def test_a_transition_that_is_there_twice_is_refused(file):
    arrays = arrays_of(file)
    for name in ("source", "target", "action"):
        arrays[name][:2] = 0
    changed(file, **arrays)
    with pytest.raises(InvalidInputError, match=r"source\[1\]: repeated; expected each transition"):
        load_compact_memory(file)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "atg-fg/memory"}, "format: 'atg-fg/memory'; expected 'atg-fg/compact-memory'"),
        ({"version": 2}, "version: 2; expected 1"),
        ({"names": ["A"] * 5}, "names: one is repeated"),
        ({"names": ["A", "B", "C", "D", 5]}, r"names\[4\]: 5; expected a text"),
        ({"more": 1}, "unknown key 'more'"),
    ],
)
def test_a_wrong_header_is_refused(file, change, message):
    changed(file, header=header_of(file, **change))
    with pytest.raises(InvalidInputError, match=message):
        load_compact_memory(file)
