"""A compact memory as a file of arrays (``.npz``), checked when it is read, and written whole or not at all."""

from __future__ import annotations

import io
import json
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Final

import numpy as np

from atg_fg.core.assumptions import MAX_NUMBER, Assumptions
from atg_fg.core.checks import plain_text
from atg_fg.core.compact.columns import AnyIntArray
from atg_fg.core.compact.compact_memory import CompactMemory, GraphArrays, compacted
from atg_fg.core.errors import InvalidInputError, TooLargeError, placed
from atg_fg.core.patterns import IntArray
from atg_fg.storage.checked_json import check_format, parse_json, read_entries, read_object
from atg_fg.storage.limits import refuse_size, unpacked_limit
from atg_fg.storage.memory_json import read_assumptions, write_assumptions
from atg_fg.storage.plain_files import read_bytes_file, starts_with, write_bytes_atomically

COMPACT_FORMAT: Final = "atg-fg/compact-memory"

#: What NumPy raises on files that are no sound archives of arrays.
_UNSOUND: Final = (
    OSError, ValueError, KeyError, EOFError, MemoryError, OverflowError, SyntaxError, RecursionError, TypeError,
    NotImplementedError, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip

#: How files of arrays are told from others.
SUFFIX: Final = ".npz"
# Others are unpacked without a limit.
_PACKINGS: Final = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def is_compact(path: Path | str) -> bool:
    """Return whether a memory is a file of arrays, by its name or by how it begins."""
    return Path(path).suffix == SUFFIX or starts_with(path, b"PK")


def save_compact_memory(memory: CompactMemory, path: Path | str) -> None:
    """Save a compact memory, atomically.

    Raises:
        InvalidInputError: The file cannot be written.
    """
    header = {
        "format": COMPACT_FORMAT,
        "version": 1,
        "assumptions": write_assumptions(memory.assumptions),
        "names": list(memory.names),
    }
    text = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    file = io.BytesIO()
    np.savez(file, header=text, **memory.arrays()._asdict())
    write_bytes_atomically(path, file.getvalue())


def load_compact_memory(path: Path | str) -> CompactMemory:
    """Load a compact memory.

    Raises:
        InvalidInputError: Unreadable, not such a file, or anything in it is not as it should be; the message names the
            place.
        TooLargeError: It unfolds to more than ``unpacked_limit`` (``limits.py``).
    """
    place = str(path)
    read = _read_arrays(path, place)
    try:
        text = read.pop("header").astype(np.uint8).tobytes().decode()
    except ValueError as error:
        raise InvalidInputError(f"{place}: header: not a UTF-8 text: {error}") from error
    header = read_object(parse_json(text, f"{place}: header"), place, ("format", "version", "assumptions", "names"))
    check_format(header, COMPACT_FORMAT, place)
    assumptions = read_assumptions(header["assumptions"], f"{place}: assumptions")
    names = [plain_text(name, where) for name, where in read_entries(header["names"], f"{place}: names")]
    if len(set(names)) < len(names):
        raise InvalidInputError(f"{place}: names: one is repeated; expected unique names")
    arrays = GraphArrays(**read)
    with placed(place):
        check_arrays(arrays, assumptions, len(names))
    return CompactMemory.of_arrays(assumptions, names, compacted(arrays, assumptions))


def _read_arrays(path: Path | str, place: str) -> dict[str, AnyIntArray]:
    """Return the arrays of a file by name: those of ``GraphArrays`` and the header, all of whole numbers."""
    expected = {"header", *GraphArrays._fields}
    content = read_bytes_file(path)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            limit = unpacked_limit(len(content))
            if sum(member.file_size for member in members) > limit:
                raise refuse_size(path, limit)
            if sorted(member.filename for member in members) != sorted(f"{name}.npy" for name in expected):
                raise InvalidInputError(f"{place}: not a compact memory; expected arrays {', '.join(sorted(expected))}")
            return {
                _name_of(member): _read_array(archive, member, f"{place}: {_name_of(member)}") for member in members
            }
    except _UNSOUND as error:
        if isinstance(error, (InvalidInputError, TooLargeError)):
            raise
        raise InvalidInputError(f"{place}: not a sound file of arrays: {error}; expected a compact memory") from error


def _name_of(member: zipfile.ZipInfo) -> str:
    """Return the name of the array in a member of an archive."""
    return member.filename.removesuffix(".npy")


def _read_array(archive: zipfile.ZipFile, member: zipfile.ZipInfo, place: str) -> AnyIntArray:
    """Return an array of one dimension of whole numbers; its size is compared with what is there before it is made."""
    if member.compress_type not in _PACKINGS:
        raise InvalidInputError(f"{place}: packed in an unknown way; expected what numpy.savez writes")
    data = archive.read(member)
    file = io.BytesIO(data)
    version = np.lib.format.read_magic(file)
    reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = reader(file)
    if dtype.hasobject:
        raise ValueError("an array of Python objects, which are never read")
    if len(shape) != 1 or dtype.kind not in "iu":
        raise InvalidInputError(f"{place}: {len(shape)} dimensions of {dtype}; expected one dimension of whole numbers")
    if len(data) - file.tell() != shape[0] * dtype.itemsize:
        raise InvalidInputError(f"{place}: {len(data) - file.tell()} bytes; expected {shape[0]} whole numbers")
    return np.frombuffer(data, dtype, offset=file.tell())


def check_arrays(arrays: GraphArrays, assumptions: Assumptions, n_objects: int) -> None:
    """Raise ``InvalidInputError`` unless these arrays are ``n_objects`` ATGs under the assumptions."""
    n_aspects, n_actions = assumptions.n_aspects, len(assumptions.actions)
    for name in ("n_known", "n_edges"):
        _check_length(name, getattr(arrays, name), n_objects)
    _check_range("n_known", arrays.n_known, 0, n_aspects)
    _check_range("n_edges", arrays.n_edges, 0, MAX_NUMBER)
    n_known, n_edges = arrays.n_known.astype(np.int64), arrays.n_edges.astype(np.int64)
    _check_length("patterns", arrays.patterns, sum(n_known.tolist()))
    for name in ("source", "action", "target", "counts"):
        _check_length(name, getattr(arrays, name), sum(n_edges.tolist()))
    _check_range("patterns", arrays.patterns, 0, len(assumptions.alphabet) - 1)
    _check_range("action", arrays.action, 0, n_actions - 1)
    _check_range("counts", arrays.counts, 1, MAX_NUMBER)
    owner = np.repeat(np.arange(n_objects), n_edges)
    for name in ("source", "target"):
        aspects = getattr(arrays, name)
        _check_range(name, aspects, 0, n_aspects - 1)
        wrong = np.flatnonzero(aspects >= n_known[owner])
        if len(wrong):
            first = int(wrong[0])
            raise InvalidInputError(
                f"{name}[{first}]: aspect {aspects[first]}; expected less than the {n_known[owner[first]]} known ones"
            )
    shown_by = np.repeat(np.arange(n_objects), n_known)
    _check_unique("patterns", shown_by, arrays.patterns.astype(np.int64), "unique patterns in an ATG")
    local = (arrays.source.astype(np.int64) * n_actions + arrays.action) * n_aspects + arrays.target
    _check_unique("source", owner, local, "each transition of an ATG once")


def _check_length(name: str, array: AnyIntArray, expected: int) -> None:
    if len(array) != expected:
        raise InvalidInputError(f"{name}: {len(array)} entries; expected {expected}")


def _check_range(name: str, array: AnyIntArray, least: int, most: int) -> None:
    wrong = np.flatnonzero((array < least) | (array > most))
    if len(wrong):
        first = int(wrong[0])
        raise InvalidInputError(f"{name}[{first}]: {array[first]}; expected {least} to {most}")


def _check_unique(name: str, owner: IntArray, local: IntArray, expected: str) -> None:
    """Check that no owner has a local number twice; owners are ascending."""
    order = np.lexsort((local, owner))
    again = np.flatnonzero((np.diff(owner[order]) == 0) & (np.diff(local[order]) == 0))
    if len(again):
        raise InvalidInputError(f"{name}[{int(order[again[0] + 1])}]: repeated; expected {expected}")
