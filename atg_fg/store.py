"""Files on disk: written whole or not at all, checked when they are read, never pickled."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Any, Final

from atg_fg.assumptions import Assumptions
from atg_fg.errors import InvalidInputError
from atg_fg.json_format import (
    check_format,
    parse_json,
    placed,
    read_assumptions,
    read_graph,
    read_integer,
    read_list,
    read_memory,
    read_object,
    write_assumptions,
    write_graph,
)
from atg_fg.memory import RobotMemory
from atg_fg.merging import Merge
from atg_fg.structure.json_section import read_learner, write_learner
from atg_fg.structure.memory import StructuredMemory

MEMORY_FORMAT: Final = "atg-fg/memory"


def read_text_file(path: Path | str) -> str:
    """Return the text of a UTF-8 file.

    Raises:
        InvalidInputError: It cannot be read, or is not UTF-8.
    """
    try:
        return Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise InvalidInputError(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InvalidInputError(f"{path}: not a UTF-8 text file: {error}") from error


def write_bytes_atomically(path: Path | str, content: bytes) -> None:
    """Write a file so that at any moment its path holds the old content or the new one, never a part.

    Raises:
        InvalidInputError: The folder does not exist or cannot be written; the old file is as it was.
    """
    target = Path(path)
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except (OSError, ValueError) as error:
        raise _cannot_write(path, error) from error
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, target)
    except OSError as error:
        os.unlink(temporary)
        raise _cannot_write(path, error) from error


def check_writable(path: Path | str) -> None:
    """Raise ``InvalidInputError`` if a file could not be written at ``path``; leave nothing behind.

    Called before long work, so that its result is not lost at the end.
    """
    if Path(path).is_dir():
        raise InvalidInputError(f"{path}: is a folder; expected the path of a file")
    try:
        with tempfile.TemporaryFile(dir=Path(path).parent):
            pass
    except (OSError, ValueError) as error:
        raise _cannot_write(path, error) from error


def make_folder(path: Path | str) -> Path:
    """Make a folder for output if it is not there, and return it.

    Raises:
        InvalidInputError: It cannot be made or written.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        raise _cannot_write(path, error) from error
    return folder


def _cannot_write(path: Path | str, error: Exception) -> InvalidInputError:
    reason = error.strerror if isinstance(error, OSError) else str(error)
    return InvalidInputError(f"{path}: cannot be written: {reason}; expected a path in a folder that can be written")


def save_memory(memory: RobotMemory, path: Path | str) -> None:
    """Save a robot memory, with the structure it has learned, as versioned JSON, atomically."""
    write_bytes_atomically(path, memory_to_json(memory).encode())


def load_memory(path: Path | str) -> RobotMemory:
    """Load a robot memory.

    Raises:
        InvalidInputError: Unreadable, not JSON, or anything in it is not as it should be; the message names the place.
    """
    return memory_from_json(read_text_file(path), str(path))


def memory_to_json(memory: RobotMemory) -> str:
    """Return a robot memory as a JSON document."""
    document: dict[str, Any] = {
        "format": MEMORY_FORMAT,
        "version": 1,
        "assumptions": write_assumptions(memory.assumptions),
        "memory": [write_graph(graph) for graph in memory],
    }
    if memory.merges:
        document["merges"] = [_write_merge(merge) for merge in memory.merges]
    if isinstance(memory, StructuredMemory):
        document["structure"] = write_learner(memory.learner)
    return json.dumps(document, indent=1) + "\n"


def memory_from_json(text: str, place: str = "memory") -> RobotMemory:
    """Return the robot memory in a JSON document; errors name ``place``."""
    keys = ("format", "version", "assumptions", "memory")
    document = read_object(parse_json(text, place), place, keys, optional=("merges", "structure"))
    check_format(document, MEMORY_FORMAT, place)
    assumptions = read_assumptions(document["assumptions"], f"{place}: assumptions")
    memory = read_memory(document["memory"], assumptions, f"{place}: memory")
    entries = read_list(document.get("merges", []), f"{place}: merges")
    merges = [_read_merge(entry, assumptions, f"{place}: merges[{index}]") for index, entry in enumerate(entries)]
    learner = None
    if "structure" in document:
        learner = read_learner(document["structure"], assumptions, memory.names, f"{place}: structure")
    with placed(place):
        if learner is None:
            return RobotMemory(assumptions, memory, merges)
        return StructuredMemory(assumptions, memory, learner, merges)


def _write_merge(merge: Merge) -> dict[str, Any]:
    """Return a merge as JSON knows it."""
    return {
        "kept": write_graph(merge.kept),
        "dropped": write_graph(merge.dropped),
        "position": merge.position,
        "trials": list(merge.trials),
    }


def _read_merge(value: Any, assumptions: Assumptions, place: str) -> Merge:
    """Return the merge at ``place``."""
    fields = read_object(value, place, ("kept", "dropped", "position", "trials"))
    trials = read_list(fields["trials"], f"{place}.trials")
    return Merge(
        read_graph(fields["kept"], assumptions, f"{place}.kept"),
        read_graph(fields["dropped"], assumptions, f"{place}.dropped"),
        read_integer(fields["position"], f"{place}.position", least=0),
        tuple(read_integer(number, f"{place}.trials[{index}]", least=0) for index, number in enumerate(trials)),
    )
