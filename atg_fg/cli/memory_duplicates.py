"""``atg-fg memory duplicates``, ``unmerge`` and ``rename``: ATGs of one object are merged, taken apart, and named."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.memory import RobotMemory
from atg_fg.learning.duplicates import find_duplicates
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import memory_files, plain_files
from atg_fg.storage.database.connection import is_database
from atg_fg.storage.memory_files import open_memory
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
    with _changed(file) if merge else nullcontext(memory_files.load_memory(file)) as memory:
        usual = "learned" if isinstance(memory, StructuredMemory) else "default"
        parameters = preset_named(preset or usual)
        pairs = found = find_duplicates(memory, parameters, threshold)
        if merge:
            pairs = []
            while found:  # anew after each: what was merged says more of the others
                memory.merge(found[0].keep, found[0].drop)
                pairs.append(found[0])
                found = find_duplicates(memory, parameters, threshold)
    document = {"command": "memory duplicates", "merged": merge, "pairs": [asdict(pair) for pair in pairs]}
    options.write_json(document, json_file)
    if json_file != "-":
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
    old: Annotated[str, typer.Argument(help="Name of an ATG.", show_default=False)],
    new: Annotated[str, typer.Argument(help="The name that it is to have.", show_default=False)],
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
    memory = memory_files.load_memory(file)
    before = memory.merges, memory.names
    yield memory
    if (memory.merges, memory.names) != before:
        memory_files.save_memory(memory, file)
