"""A robot memory as one JSON document: what memory files hold, and what a database is checked as."""

from __future__ import annotations

import json
from typing import Any, Final

from atg_fg.assumptions import Assumptions
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


def memory_to_json(memory: RobotMemory) -> str:
    """Return a robot memory as the text of a JSON document."""
    return json.dumps(memory_to_document(memory), indent=1) + "\n"


def memory_from_json(text: str, place: str = "memory") -> RobotMemory:
    """Return the robot memory in the text of a JSON document; errors name ``place``."""
    return memory_from_document(parse_json(text, place), place)


def memory_to_document(memory: RobotMemory) -> dict[str, Any]:
    """Return a robot memory as JSON knows it."""
    document: dict[str, Any] = {
        "format": MEMORY_FORMAT,
        "version": 1,
        "assumptions": write_assumptions(memory.assumptions),
        "memory": [write_graph(graph) for graph in memory],
    }
    if memory.merges:
        document["merges"] = [write_merge(merge) for merge in memory.merges]
    if isinstance(memory, StructuredMemory):
        document["structure"] = write_learner(memory.learner)
    return document


def memory_from_document(value: Any, place: str = "memory") -> RobotMemory:
    """Return the robot memory in a document; errors name ``place``.

    Raises:
        InvalidInputError: Anything in it is not as it should be.
    """
    keys = ("format", "version", "assumptions", "memory")
    document = read_object(value, place, keys, optional=("merges", "structure"))
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


def write_merge(merge: Merge) -> dict[str, Any]:
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
