"""``atg-fg memory compact``: ATGs as arrays, for memories of 100,000 of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.compact.compact_memory import CompactMemory
from atg_fg.core.errors import InvalidInputError
from atg_fg.storage import memory_files, plain_files
from atg_fg.storage.compact_file import SUFFIX, is_compact


def compact(
    file: options.MemoryFile,
    output: Annotated[Path, typer.Option(writable=True, help="File of arrays to write, .npz.", show_default=False)],
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
    options.write_json(document, json_file)
    if json_file != "-":
        say(f"{output}: {len(made)} ATGs, {made.nbytes} bytes in memory")
