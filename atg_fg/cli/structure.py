"""``atg-fg memory structure``: look at what a robot memory has learned of the structure that its objects share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.table import Table
from atg_fg.display import figures
from atg_fg.display.completed_picture import draw_completed_atg, probability_text
from atg_fg.display.structure_picture import draw_structure
from atg_fg.display.structure_words import action_text, register_names
from atg_fg.learning.believed_structure import BelievedStructure, UncertainObjects
from atg_fg.learning.completion import CompletedGraph, completed_atg, statuses
from atg_fg.learning.predictive_checks import summary_of_evidence
from atg_fg.learning.shared_structure import SharedStructure
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import memory_files


def structure(
    file: options.MemoryFile,
    name: Annotated[str | None, typer.Option("--object", help="Show what is predicted of this object.")] = None,
    plot: Annotated[
        Path | None,
        options.written(
            help="Draw the structure, or the completed ATG of --object, into this .png, .svg or .pdf file."
        ),
        figures.check_figure_path,
    ] = None,
    json_file: options.JsonFile = None,
) -> None:
    """Show the learned structure: registers, what actions do to them, rates, and what it predicts of each object.

    Example: atg-fg memory structure memory.json --plot structure.png
    """
    memory = memory_files.load_memory(file)
    learned = memory if isinstance(memory, StructuredMemory) else None
    believed = learned.learner.believed(learned.names) if learned is not None else []
    if name is not None:
        memory[name]  # refused before anything is written
    uncertain = learned.learner.uncertain(learned.names) if learned is not None else None
    if learned is None or not (believed or _members(uncertain, learned)):
        _tell_none(file, learned, plot, json_file)
        return
    if plot is not None and not believed:
        raise InvalidInputError(f"--plot: {file} has no learned structure to draw: its objects have uncertain actions")
    completed = {each: completed_atg(learned, each, believed) for each in ([name] if name else learned.names)}
    if plot is not None:
        figure = draw_structure(believed[0].structure, memory.assumptions)
        if name is not None:
            figure = draw_completed_atg(completed[name], memory.assumptions)
        figures.save_figure(figure, plot)
    document = _document(learned, believed, completed)
    if name is not None:
        nodes, edges = completed[name].nodes(data=True), completed[name].edges(data=True)
        document["completed"] = {
            "aspects": [{"id": node, **data} for node, data in nodes],
            "transitions": [{"from": source, "to": target, **data} for source, target, data in edges],
        }
    if options.write_json(document, json_file):
        _tell(file, document)


def _tell_none(file: Path, memory: StructuredMemory | None, plot: Path | None, json_file: str | None) -> None:
    """Say that there is no structure, in one line."""
    if memory is None:
        reason = "its trials were not kept; trials with --preset learned are"
    else:
        reason = f"none explains its {len(memory.learner.trials)} trials better than plain ATGs do"
        if memory.erring:
            reason = "looks err, see below"
    if plot is not None:
        raise InvalidInputError(f"--plot: {file} has no learned structure to draw: {reason}")
    trials = 0 if memory is None else len(memory.learner.trials)
    erring = {} if memory is None else summary_of_evidence(memory)
    document = {"command": "structure show", "trials": trials, "structures": [], "objects": []}
    if options.write_json({**document, **({"erring": erring} if erring else {})}, json_file):
        say(f"{file}: no learned structure: {reason}")
        _tell_erring(erring)


def _tell_erring(erring: dict[str, Any]) -> None:
    """Say what the model of looks that err has found."""
    if not erring or erring["weight"] < 0.5:
        return
    own = f", {erring['own_automata']} of them moved otherwise than the others" if erring["own_automata"] else ""
    say(
        f"looks err: {100 * erring['wrong']:.1f} % of labels wrong, {100 * erring['slip']:.1f} % of actions fail; "
        f"{erring['states']} states, {erring['registers']} registers; {erring['objects']} objects{own}; "
        f"{erring['reassignments']} raw trials changed hands"
    )
    for warning in erring["warnings"]:
        say(f"warning: {warning}")


def _document(
    memory: StructuredMemory, believed: Sequence[BelievedStructure], completed: dict[str, CompletedGraph]
) -> dict[str, Any]:
    """Return what is shown as JSON knows it."""
    learner = memory.learner
    return {
        "command": "structure show",
        "trials": len(learner.trials),
        "evaluations": learner.n_evaluations,
        "rates": learner.rates.by_name(),
        "structures": [
            _structure_document(each, learner.gain + math.log(each.weight / believed[0].weight), memory)
            for each in believed
        ],
        **_uncertain_document(memory),
        "objects": [
            {"name": name, "follows": graph.graph["follows"], **statuses(graph)} for name, graph in completed.items()
        ],
    }


def _members(kind: UncertainObjects | None, memory: StructuredMemory | None) -> list[str]:
    """Return the names of the objects whose actions are probably uncertain; none where looks err."""
    if kind is None or memory is None or memory.erring:
        return []
    is_one = (kind.members > 0.5).tolist()
    return [name for name, member in zip(memory.names, is_one, strict=False) if member]


def _uncertain_document(memory: StructuredMemory) -> dict[str, Any]:
    """Return what is known of objects whose actions are uncertain, if there are any."""
    kind = memory.learner.uncertain(memory.names)
    members = _members(kind, memory)
    if kind is None or not members:
        return {}
    return {"uncertain": {**kind.noise._asdict(), "share": kind.share, "members": members}}


def _structure_document(each: BelievedStructure, gain: float, memory: StructuredMemory) -> dict[str, Any]:
    names = register_names(each.structure, memory.assumptions.alphabet.slots)
    members = each.followers > 0.5
    modes = [_mode_document(each.structure, mode, names, memory) for mode in range(each.structure.n_modes)]
    return {
        "weight": each.weight,
        "gain": gain,
        "share": each.share,
        "members": [name for name, is_one in zip(memory.names, members.tolist(), strict=True) if is_one],
        "aspects": len(each.structure.poses().registers),
        "registers": list(names),
        **({"modes": modes} if len(modes) > 1 else {"sources": modes[0]["sources"]}),
    }


def _mode_document(
    structure: SharedStructure, mode: int, names: Sequence[str], memory: StructuredMemory
) -> dict[str, Any]:
    steps = {action: structure.step(mode, number) for number, action in enumerate(memory.assumptions.actions)}
    return {
        "sources": {action: [names[source] for source in sources] for action, (_, sources) in steps.items()},
        "next": {action: following for action, (following, _) in steps.items()},
    }


def _what_kind(n_members: int, n_poses: int, n_modes: int) -> str:
    """Return what kind of thing the followers of a structure are, in words."""
    modes = f" in {n_modes} modes" if n_modes > 1 else ""
    return f"a kind of {_objects(n_members)} with {n_poses} poses{modes}"


def _objects(number: int) -> str:
    return f"{number} object{'' if number == 1 else 's'}"


def _tell(file: Path, document: dict[str, Any]) -> None:
    """Print for people what a document says."""
    console = options.console()
    console.print(f"{file}: {document['trials']} trials, {document['evaluations']} structures scored in searches")
    for number, structure in enumerate(document["structures"], start=1):
        registers = structure["registers"]
        console.print(
            f"structure {number}: probability {probability_text(structure['weight'])}, "
            f"{structure['gain']:.1f} nats better than none, {structure['aspects']} aspects, "
            f"registers {', '.join(registers)}",
            soft_wrap=True,
        )
        modes = structure.get("modes", [structure])
        console.print(f"  {_what_kind(len(structure['members']), structure['aspects'], len(modes))}", soft_wrap=True)
        for mode, maps in enumerate(modes):
            for action, sources in maps["sources"].items():
                indices = [registers.index(source) for source in sources]
                where = f"mode {mode + 1} → {maps['next'][action] + 1}, " if len(modes) > 1 else ""
                console.print(f"  {where}{action}: {action_text(indices, registers)}", soft_wrap=True)
    if "uncertain" in document:
        kind = document["uncertain"]
        console.print(
            f"uncertain actions, α = {kind['concentration']:g}, δ = {kind['noise']:g}: "
            f"a kind of {_objects(len(kind['members']))}, plain ATGs",
            soft_wrap=True,
        )
    rates = ", ".join(f"{name.replace('_', ' ')} {value:.4f}" for name, value in document["rates"].items())
    console.print(f"rates: {rates}")
    kinds = ("observed", "predicted", "unknown")
    rows = (
        (row["name"], probability_text(row["follows"]), *(str(row[kind]) for kind in kinds))
        for row in document["objects"]
    )
    options.print_tables([Table("", ("object", "follows it", *kinds), tuple(rows))])
