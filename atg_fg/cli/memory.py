"""``atg-fg memory``: look at a saved robot memory, check it, export its graphs, merge those of one object."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from atg_fg import store
from atg_fg.cli import options
from atg_fg.duplicates import find_duplicates
from atg_fg.errors import InvalidInputError
from atg_fg.export import view_to_dot, view_to_graphml
from atg_fg.large_memory.compact_memory import CompactMemory
from atg_fg.large_memory.files import SUFFIX, load_any_memory, save_compact_memory
from atg_fg.presets import preset as preset_named
from atg_fg.structure.completion import completed_atg
from atg_fg.structure.memory import StructuredMemory

app = typer.Typer(
    help="Look at a saved robot memory, check it, export and merge its graphs. Example: atg-fg memory show memory.json",
    no_args_is_help=True,
)

MemoryFile = Annotated[Path, typer.Argument(help="A memory file (JSON).", show_default=False)]
AnyMemoryFile = Annotated[Path, typer.Argument(help="A memory file (JSON, or .npz).", show_default=False)]
EXPORTS = {"graphml": view_to_graphml, "dot": view_to_dot}


@app.command()
def show(file: AnyMemoryFile, json_file: options.JsonFile = None) -> None:
    """Show the remembered objects: aspects, transitions and what is still unknown.

    Example: atg-fg memory show memory.json
    """
    options.check_json_option(json_file)
    memory = load_any_memory(file)
    rows = [
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
    document = {
        "command": "memory show",
        "n_objects": memory.assumptions.n_objects,
        "n_aspects": memory.assumptions.n_aspects,
        "objects": rows,
    }
    options.write_json(document, json_file)
    if json_file == "-":
        return
    table = Table(title=f"{file}: {len(memory)} of {memory.assumptions.n_objects} objects", title_justify="left")
    for heading in ("object", "aspects", "unobserved", "edges", "transitions seen", "unknown edges"):
        table.add_column(heading, justify="left" if heading == "object" else "right")
    for row in rows:
        table.add_row(*map(str, row.values()))
    options.console().print(table)


@app.command()
def check(file: AnyMemoryFile, json_file: options.JsonFile = None) -> None:
    """Check a memory file; leave with status 2 and the first fault if it has one.

    Example: atg-fg memory check memory.json
    """
    options.check_json_option(json_file)
    memory = load_any_memory(file)
    options.write_json({"command": "memory check", "sound": True, "objects": len(memory)}, json_file)
    if json_file != "-":
        typer.echo(f"{file}: sound, {len(memory)} ATGs")


@app.command()
def export(
    file: AnyMemoryFile,
    name: Annotated[str | None, typer.Option(help="The ATG to export; the first one if not given.")] = None,
    format_name: Annotated[str, typer.Option("--format", help=f"One of: {', '.join(EXPORTS)}.")] = "graphml",
    completed: Annotated[
        bool, typer.Option("--completed", help="Add the aspects and transitions that the learned structure predicts.")
    ] = False,
    output: Annotated[Path | None, typer.Option(help="File to write; standard output if not given.")] = None,
) -> None:
    """Export one ATG as GraphML or DOT.

    Example: atg-fg memory export memory.json --name object-003 --format dot --output atg.dot
    """
    if format_name not in EXPORTS:
        raise InvalidInputError(f"--format: {format_name!r}; expected one of: {', '.join(EXPORTS)}")
    memory = load_any_memory(file)
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
    text = EXPORTS[format_name](view, memory.assumptions.alphabet.slots)
    if output is None:
        typer.echo(text, nl=False)
    else:
        store.write_bytes_atomically(output, text.encode())


@app.command()
def compact(
    file: MemoryFile,
    output: Annotated[Path, typer.Option(help="File of arrays to write, .npz.", show_default=False)],
    json_file: options.JsonFile = None,
) -> None:
    """Write the ATGs of a memory as arrays, which load a hundred times as fast; for the engine large-memory.

    Example: atg-fg memory compact memory.json --output memory.npz
    """
    options.check_json_option(json_file)
    if output.suffix != SUFFIX:
        raise InvalidInputError(f"--output: {str(output)!r}; expected a name that ends in {SUFFIX}")
    store.check_writable(output)
    memory = store.load_memory(file)
    if memory.merges or isinstance(memory, StructuredMemory):
        raise InvalidInputError(f"{file}: merges or a learned structure; expected ATGs alone, as arrays keep no more")
    made = CompactMemory.of(memory)
    save_compact_memory(made, output)
    document = {"command": "memory compact", "objects": len(made), "bytes": made.nbytes}
    options.write_json(document, json_file)
    if json_file != "-":
        typer.echo(f"{output}: {len(made)} ATGs, {made.nbytes} bytes in memory")


@app.command()
def duplicates(
    file: MemoryFile,
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
    options.check_json_option(json_file)
    if merge:
        store.check_writable(file)
    memory = store.load_memory(file)
    usual = "learned" if isinstance(memory, StructuredMemory) else "default"
    parameters = preset_named(preset or usual)
    pairs = found = find_duplicates(memory, parameters, threshold)
    if merge:
        pairs = []
        while found:  # anew after each: what was merged says more of the others
            memory.merge(found[0].keep, found[0].drop)
            pairs.append(found[0])
            found = find_duplicates(memory, parameters, threshold)
        if pairs:
            store.save_memory(memory, file)
    document = {"command": "memory duplicates", "merged": merge, "pairs": [asdict(pair) for pair in pairs]}
    options.write_json(document, json_file)
    if json_file != "-":
        did = "merged" if merge else "probably of one object"
        typer.echo(f"{file}: {len(pairs)} pairs of {len(memory) + len(pairs) * merge} ATGs {did}")
        for pair in pairs:
            typer.echo(f"{pair.keep} and {pair.drop}: log odds {pair.log_odds:.1f}")


@app.command()
def unmerge(
    file: MemoryFile, name: Annotated[str, typer.Argument(help="The ATG that was merged into another one.")]
) -> None:
    """Undo a merge; what was learned since stays with the ATG that was kept.

    Example: atg-fg memory unmerge memory.json object-007
    """
    store.check_writable(file)
    memory = store.load_memory(file)
    memory.unmerge(name)
    store.save_memory(memory, file)
    typer.echo(f"{file}: {name} is an ATG of its own again")
