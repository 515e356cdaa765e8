"""``atg-fg memory export``, ``import``, ``merge``, ``diff`` and ``compact``: memories from file to file."""

from __future__ import annotations

import json
import os
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from atg_fg.cli import options
from atg_fg.cli.terminal import say, say_document
from atg_fg.core.compact.compact_memory import CompactMemory
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.learning.completion import completed_atg
from atg_fg.learning.memory_union import unite
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import memory_files, memory_json, plain_files
from atg_fg.storage.compact_file import SUFFIX, is_compact
from atg_fg.storage.database.connection import is_database, writing
from atg_fg.storage.database.copying import add_records, records_in, records_in_log
from atg_fg.storage.database.memory_reading import holds_memory, read_memory_rows
from atg_fg.storage.database.memory_writing import replace_memory
from atg_fg.storage.database.trial_log import read_stored_trials
from atg_fg.storage.graph_export import view_to_dot, view_to_graphml
from atg_fg.storage.memory_difference import difference
from atg_fg.storage.memory_files import load_memory
from atg_fg.storage.trial_log import to_line

GRAPH_FORMATS: Final = {"graphml": view_to_graphml, "dot": view_to_dot}
EXPORTS: Final = (*GRAPH_FORMATS, "json", "trials")


def export(
    file: options.MemoryFile,
    name: Annotated[str | None, typer.Option(help="The ATG to export; the first one if not given.")] = None,
    format_name: Annotated[
        str, typer.Option("--format", help=f"One of: {', '.join(EXPORTS)}; the last two are of the whole memory.")
    ] = "graphml",
    completed: Annotated[
        bool, typer.Option("--completed", help="Add the aspects and transitions that the learned structure predicts.")
    ] = False,
    output: Annotated[Path | None, options.written(help="File to write; standard output if not given.")] = None,
) -> None:
    """Export one ATG as GraphML or DOT, the whole memory as JSON, or its trials, a line of JSON each.

    Example: atg-fg memory export memory.json --name object-003 --format dot --output atg.dot
    """
    if format_name not in EXPORTS:
        raise InvalidInputError(f"--format: {format_name!r}; expected one of: {', '.join(EXPORTS)}")
    if format_name in GRAPH_FORMATS:
        text = _graph_text(file, name, format_name, completed=completed)
    elif name is not None or completed:
        raise InvalidInputError(f"--format {format_name} is of the whole memory; expected no --name or --completed")
    elif format_name == "json":
        text = memory_json.memory_to_json(load_memory(file))
    else:
        text = _trials_text(file)
    if output is None:
        say_document(text)
    else:
        plain_files.write_bytes_atomically(output, text.encode())


def _graph_text(file: Path, name: str | None, format_name: str, *, completed: bool) -> str:
    memory = load_memory(file)
    if not len(memory):
        raise InvalidInputError(f"{file}: the memory is empty; expected at least one ATG to export")
    graph = memory[name if name is not None else memory.names[0]]
    if not completed:
        view = graph.to_networkx()
    elif isinstance(memory, StructuredMemory):
        view = completed_atg(memory, graph.name)
    else:
        raise InvalidInputError(
            f"--completed: {file} has no learned structure; expected a memory of the preset learned"
        )
    return GRAPH_FORMATS[format_name](view, memory.assumptions.alphabet.slots)


def _trials_text(file: Path) -> str:
    if not is_database(file):
        raise InvalidInputError(f"--format trials: {file} is no database; expected one, since JSON holds no trials")
    lines = (
        {"experiment": trial.experiment, "number": trial.number, "learned": trial.learned, "trial": to_line(trial)}
        for trial in read_stored_trials(file)
    )
    return "".join(json.dumps(line, allow_nan=False) + "\n" for line in lines)


def import_files(
    files: Annotated[
        list[Path], options.argument(help="Memories (JSON or databases), and logs of trials (.jsonl.gz).")
    ],
    into: Annotated[Path, options.written(help="The database; made if it is not there.", show_default=False)],
) -> None:
    """Put a memory, and records of trials, into a database: all of them, or nothing.

    A database has one memory: if it has objects already, or two files have some, use `memory merge`.

    Example: atg-fg memory import memory.json records/test-0000.jsonl.gz --into robot.db
    """
    with ExitStack() as stack:
        _import([stack.enter_context(plain_files.readable_again(file)) for file in files], into)


def _import(files: list[Path], into: Path) -> None:
    logs = [file for file in files if plain_files.starts_with(file, plain_files.GZIP)]
    records: list[list[tuple[Experiment | None, list[TrialSummary]]]] = [[records_in_log(file)] for file in logs]
    records += [list(records_in(file)) for file in files if is_database(file)]
    memories = [
        load_memory(file) for file in files if file not in logs and not memory_files.is_database_without_memory(file)
    ]
    full = [memory for memory in memories if len(memory)] or memories[:1]
    with writing(into, create=True) as connection:
        there = read_memory_rows(connection, str(into)) if holds_memory(connection) else None
        if len(full) + (there is not None and len(there) > 0) > 1:
            raise InvalidInputError(f"{into}: more than one memory; expected one, or atg-fg memory merge first")
        for memory in full:
            replace_memory(connection, memory)
        added = [add_records(connection, str(into), each) for each in records]
    n_objects = sum(map(len, full))
    n_experiments, n_trials = (sum(counts[kind] for counts in added) for kind in (0, 1))
    say(f"{into}: {n_objects} ATGs, {n_experiments} experiments and {n_trials} trials imported")


def merge(
    first: Annotated[Path, options.argument(help="A memory; its names stay.")],
    second: Annotated[Path, options.argument(help="Another memory.")],
    output: Annotated[
        Path, options.written("--output", "-o", help="The new file.", show_default=False), plain_files.check_writable
    ],
    json_file: options.JsonFile = None,
) -> None:
    """Unite two memories. ATGs of the same name are one object if one of them goes on where the other one is.

    All others are different objects; `memory duplicates` finds those that are not. A database gets the records of
    both, too.

    Example: atg-fg memory merge robot.db other.json -o both.db
    """
    if os.path.exists(output):
        raise InvalidInputError(f"{output}: is already there; expected the path of a new file")
    union = unite(load_memory(first), load_memory(second))
    n_trials = 0
    if memory_files.goes_to_database(output):
        n_trials = _save_with_records(union.memory, output, first, second, union.renamed)
    else:
        memory_files.save_memory(union.memory, output)
    document = {
        "command": "memory merge",
        "objects": len(union.memory),
        "same": list(union.same),
        "renamed": union.renamed,
        "trials": n_trials,
    }
    if options.write_json(document, json_file):
        say(f"{output}: {len(union.memory)} ATGs, {len(union.same)} of them in both; {n_trials} trials")
        for old, new in union.renamed.items():
            say(f"{second}: {old} is {new}")


def _save_with_records(memory: RobotMemory, output: Path, first: Path, second: Path, renamed: dict[str, str]) -> int:
    n_trials = 0
    with writing(output, create=True) as connection:
        for file, names in ((first, {}), (second, renamed)):
            if is_database(file):
                n_trials += add_records(connection, str(output), records_in(file, names))[1]
        replace_memory(connection, memory)
    return n_trials


def diff(
    first: Annotated[Path, options.argument(help="A memory.")],
    second: Annotated[Path, options.argument(help="Another memory.")],
    json_file: options.JsonFile = None,
) -> int:
    """Say what the second memory has otherwise than the first; leave with status 1 if there is anything.

    Example: atg-fg memory diff before.json robot.db
    """
    found = difference(load_memory(first), load_memory(second))
    if options.write_json({"command": "memory diff", "same": not found, "difference": found}, json_file):
        for line in _told(found):
            say(line)
    return 1 if found else 0


def _told(found: dict[str, Any]) -> list[str]:
    lines = [f"{name}: {one} / {two}" for name, (one, two) in found.get("assumptions", {}).items()]
    lines += [f"- {name}" for name in found.get("only_first", ())]
    lines += [f"+ {name}" for name in found.get("only_second", ())]
    lines += [f"{old} is called {new}" for old, new in found.get("renamed", {}).items()]
    for name, changes in found.get("changed", {}).items():
        numbers = {what: len(value) if isinstance(value, list) else value for what, value in changes.items()}
        told = [f"{what.replace('_', ' ')} {number}" for what, number in numbers.items()]
        lines.append(f"{name}: {', '.join(told)}")
    if "order" in found:
        lines.append("the objects are in another order")
    if "merges" in found:
        lines.append("merges: {} / {}".format(*found["merges"]))
    lines += [f"structure: {name}: {one} / {two}" for name, (one, two) in found.get("structure", {}).items()]
    return lines


def compact(
    file: options.MemoryFile,
    output: Annotated[Path, options.written(help="File of arrays to write, .npz.", show_default=False)],
    json_file: options.JsonFile = None,
) -> None:
    """Write the ATGs of a memory as arrays, which load a hundred times as fast; for the engine large-memory.

    Example: atg-fg memory compact memory.json --output memory.npz
    """
    if not is_compact(output):
        raise InvalidInputError(f"--output: {str(output)!r}; expected a name that ends in {SUFFIX}")
    plain_files.check_writable(output)
    memory = memory_files.load_memory(file)
    memory_files.save_memory(memory, output)
    made = CompactMemory.of(memory)
    document = {"command": "memory compact", "objects": len(made), "bytes": made.nbytes}
    if options.write_json(document, json_file):
        say(f"{output}: {len(made)} ATGs, {made.nbytes} bytes in memory")
