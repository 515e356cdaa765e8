"""``atg-fg memory``: look at a saved robot memory, check it, export its graphs, merge those of one object."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from atg_fg.cli import memory_files, options, structure
from atg_fg.cli.terminal import say
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.table import Table
from atg_fg.learning.duplicates import find_duplicates, merge_duplicates
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import plain_files
from atg_fg.storage.checked_json import parse_json
from atg_fg.storage.compact_file import is_compact
from atg_fg.storage.database.checking import faults_of_database
from atg_fg.storage.database.connection import is_database
from atg_fg.storage.database.repairing import repair_database
from atg_fg.storage.database.trial_log import read_stored_experiments, read_stored_trials
from atg_fg.storage.memory_files import is_database_without_memory, load_memory, open_memory, save_memory
from atg_fg.storage.memory_json import MEMORY_FORMAT, memory_from_document, memory_from_json
from atg_fg.storage.packaged import example_memory
from atg_fg.storage.presets import preset as preset_named


def duplicates(
    file: options.MemoryFile,
    merge: Annotated[
        bool, typer.Option("--merge", help="Merge them, the most probable pair first, and save the memory.")
    ] = False,
    threshold: Annotated[
        float | None, typer.Option(help="Log odds, in nats, above which two ATGs are taken for one object.")
    ] = None,
    preset: Annotated[
        str | None, typer.Option(help="Model parameters; learned if the memory has structure, else default.")
    ] = None,
    json_file: options.JsonFile = None,
) -> None:
    """Find ATGs that are probably of one object, as a false novelty leaves them, and merge them.

    Example: atg-fg memory duplicates memory.json --merge
    """
    with _changed(file) if merge else nullcontext(load_memory(file)) as memory:
        usual = "learned" if isinstance(memory, StructuredMemory) else "default"
        parameters = preset_named(preset or usual)
        find = merge_duplicates if merge else find_duplicates
        pairs = find(memory, parameters, threshold=threshold)
    document = {"command": "memory duplicates", "merged": merge, "pairs": [asdict(pair) for pair in pairs]}
    if options.write_json(document, json_file):
        did = "merged" if merge else "probably of one object"
        say(f"{file}: {len(pairs)} pairs of {len(memory) + len(pairs) * merge} ATGs {did}")
        for pair in pairs:
            say(f"{pair.keep} and {pair.drop}: log odds {pair.log_odds:.1f}")


def unmerge(
    file: options.MemoryFile, name: Annotated[str, typer.Argument(help="The ATG that was merged into another one.")]
) -> None:
    """Undo a merge; what was learned since stays with the ATG that was kept.

    Example: atg-fg memory unmerge memory.json object-007
    """
    with _changed(file) as memory:
        memory.unmerge(name)
    say(f"{file}: {name} is an ATG of its own again")


def rename(
    file: options.MemoryFile,
    old: Annotated[str, options.argument(help="Name of an ATG.")],
    new: Annotated[str, options.argument(help="The name that it is to have.")],
) -> None:
    """Give an object another name; all that was learned stays with it.

    Example: atg-fg memory rename memory.json object-003 cup
    """
    with _changed(file) as memory:
        memory.rename(old, new)
    say(f"{file}: {old} is {new}")


@contextmanager
def _changed(file: Path) -> Iterator[RobotMemory]:
    """Give a memory, and write to its file what was changed, all of it or nothing."""
    if is_database(file):
        with open_memory(file) as memory, memory.transaction():
            yield memory
        return
    plain_files.check_writable(file)
    memory = load_memory(file)
    before = memory.merges, memory.names
    yield memory
    if (memory.merges, memory.names) != before:
        save_memory(memory, file)


app = typer.Typer(
    help="Look at a saved robot memory, check it, export and merge its graphs. Example: atg-fg memory show memory.json",
    no_args_is_help=True,
)
app.command()(memory_files.export)
app.command("import")(memory_files.import_files)
app.command()(memory_files.merge)
app.command()(memory_files.diff)
app.command()(memory_files.compact)
app.command()(duplicates)
app.command()(unmerge)
app.command()(rename)
app.command()(structure.structure)


@app.command()
def show(file: options.MemoryFile, json_file: options.JsonFile = None) -> None:
    """Show the remembered objects: aspects, transitions and what is still unknown.

    Example: atg-fg memory show memory.json
    """
    records = _records(file) if is_database(file) else {}
    memory = None if is_database_without_memory(file) else load_memory(file)
    document: dict[str, Any] = {"command": "memory show"}
    if memory is not None:
        assumptions = memory.assumptions
        document |= {"n_objects": assumptions.n_objects, "n_aspects": assumptions.n_aspects, "objects": _rows(memory)}
    if not options.write_json({**document, **records}, json_file):
        return
    if memory is not None:
        title = f"{file}: {len(memory)} of {memory.assumptions.n_objects} objects"
        headings = ("object", "aspects", "unobserved", "edges", "transitions seen", "unknown edges")
        rows = (tuple(map(str, row.values())) for row in document["objects"])
        options.print_tables([Table(title, headings, tuple(rows))])
    for each in records.get("experiments", ()):
        say(f"{each['kind']}, seed {each['seed']}, atg-fg {each['version']}: {each['trials']} trials")


def _rows(memory: RobotMemory) -> list[dict[str, Any]]:
    """Return what there is to say of each object."""
    return [
        {
            "name": graph.name,
            "aspects": graph.n_known,
            "unobserved": graph.n_unobserved,
            "edges": len(graph.counts),
            "transitions": sum(graph.counts.values()),
            "unknown_edges": len(list(graph.unknown_transitions())),
        }
        for graph in memory
    ]


def _records(file: Path) -> dict[str, Any]:
    """Return what a database holds beside its memory."""
    counts = Counter(trial.experiment for trial in read_stored_trials(file))
    experiments = [{**asdict(each), "trials": counts[each.number]} for each in read_stored_experiments(file)]
    return {"experiments": experiments, "trials": counts.total()}


@app.command()
def example(output: Annotated[Path, options.argument(writable=True, help="File to write (JSON).")]) -> None:
    """Write the memory that comes with atg-fg: cubes, learned in 30 trials of 10 actions with the preset learned.

    Example: atg-fg memory example cubes.json
    """
    text = example_memory()
    memory = memory_from_json(text, "cubes.json")
    plain_files.write_bytes_atomically(output, text.encode())
    say(f"{output}: {len(memory)} of {memory.assumptions.n_objects} objects")


@app.command()
def check(file: options.MemoryFile, json_file: options.JsonFile = None) -> int:
    """Check a memory file; leave with status 1 and its faults if it has any, with 2 if it is no memory at all.

    Of a database its pages, its references, the memory and all records are checked; of JSON the first fault is told.

    Example: atg-fg memory check robot.db
    """
    with plain_files.readable_again(file) as there:
        return _check(there, json_file)


def _check(file: Path, json_file: str | None) -> int:
    faults = faults_of_database(file) if is_database(file) else _faults_of_json(file)
    memory = None if faults or is_database_without_memory(file) else load_memory(file)
    sound: dict[str, Any] = {"sound": not faults}
    if faults:
        sound["faults"] = faults
    else:
        sound["objects"] = 0 if memory is None else len(memory)
    if options.write_json({"command": "memory check", **sound}, json_file):
        for line in faults or [f"{file}: sound, {sound['objects']} ATGs"]:
            say(line)
    return 1 if faults else 0


@app.command()
def repair(file: Annotated[Path, options.argument(help="A database.")], json_file: options.JsonFile = None) -> None:
    """Take trials that cannot be read out of a database, and put on record there what they were.

    All trials of a test after a bad one follow from it, and are taken out, too; table1 --resume runs them again.

    Example: atg-fg memory repair robot.db
    """
    faults = repair_database(file)
    if options.write_json({"command": "memory repair", "faults": faults}, json_file):
        for line in faults or [f"{file}: no record in it is bad"]:
            say(line)


def _faults_of_json(file: Path) -> list[str]:
    """Return the first fault of a memory file.

    Raises:
        InvalidInputError: It cannot be read, is not JSON, or is something else.
    """
    if is_compact(file):
        load_memory(file)
        return []
    document = parse_json(plain_files.read_text_file(file), str(file))
    if not isinstance(document, dict) or document.get("format") != MEMORY_FORMAT:
        raise InvalidInputError(f"{file}: is no memory file; expected an object with format {MEMORY_FORMAT!r}")
    try:
        memory_from_document(document, str(file))
    except InvalidInputError as error:
        return [str(error)]
    return []
