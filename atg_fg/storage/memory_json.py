"""A robot memory as one JSON document: what memory files hold, and what a database is checked as."""

from __future__ import annotations

import json
from typing import Any, Final

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import plain_text, whole_number
from atg_fg.core.errors import placed
from atg_fg.core.memory import RobotMemory
from atg_fg.core.merging import Merge
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.checked_json import check_format, parse_json, read_entries, read_list, read_object, without_none
from atg_fg.storage.evidence_json import read_evidence, write_evidence
from atg_fg.storage.object_sense_json import read_moments, read_object_senses, write_moments, write_object_sense
from atg_fg.storage.sense_json import read_sense, write_sense
from atg_fg.storage.structure_json import read_learner, write_learner

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
    if memory.sense is not None:
        document["sense"] = write_sense(memory.sense, memory.assumptions)
    if isinstance(memory, StructuredMemory):
        document["structure"] = write_learner(memory.learner)
        evidence = write_evidence(memory)
        if evidence:
            document["structure"]["evidence"] = evidence
    return document


def memory_from_document(value: Any, place: str = "memory") -> RobotMemory:
    """Return the robot memory in a document; errors name ``place``.

    Raises:
        InvalidInputError: Anything in it is not as it should be.
    """
    keys = ("format", "version", "assumptions", "memory")
    document = read_object(value, place, keys, optional=("merges", "structure", "sense"))
    check_format(document, MEMORY_FORMAT, place)
    assumptions = read_assumptions(document["assumptions"], f"{place}: assumptions")
    memory = read_memory(document["memory"], assumptions, f"{place}: memory")
    entries = read_entries(document.get("merges", []), f"{place}: merges")
    merges = [_read_merge(entry, assumptions, where) for entry, where in entries]
    sense = read_sense(document["sense"], assumptions, f"{place}: sense") if "sense" in document else None
    learner = None
    if "structure" in document:
        learner = read_learner(document["structure"], assumptions, memory.names, f"{place}: structure")
    with placed(place):
        if learner is None:
            return RobotMemory(assumptions, memory, merges, sense)
        result = StructuredMemory(assumptions, memory, learner, merges, sense)
    if "evidence" in document["structure"]:
        read_evidence(document["structure"]["evidence"], result, f"{place}: structure.evidence")
    return result


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
    trials = read_entries(fields["trials"], f"{place}.trials")
    return Merge(
        read_graph(fields["kept"], assumptions, f"{place}.kept"),
        read_graph(fields["dropped"], assumptions, f"{place}.dropped"),
        whole_number(fields["position"], f"{place}.position", least=0),
        tuple(whole_number(number, where, least=0) for number, where in trials),
    )


def read_assumptions(value: Any, place: str) -> Assumptions:
    """Return the assumptions at ``place``."""
    fields = read_object(
        value,
        place,
        ("n_objects", "n_aspects", "actions", "slots", "n_symbols"),
        ("exclusive", "symbols", "open", "object_senses"),
    )
    senses = read_object_senses(fields.get("object_senses", []), f"{place}.object_senses")
    texts = {
        key: tuple(plain_text(name, where) for name, where in read_entries(fields.get(key, []), f"{place}.{key}"))
        for key in ("actions", "slots", "symbols")
    }
    numbers = {
        key: whole_number(fields[key], f"{place}.{key}", least=1) for key in ("n_objects", "n_aspects", "n_symbols")
    }
    with placed(place):
        alphabet = PatternAlphabet(
            texts["slots"],
            numbers["n_symbols"],
            fields.get("exclusive", True),
            texts["symbols"],
            fields.get("open", False),
        )
        return Assumptions(numbers["n_objects"], numbers["n_aspects"], texts["actions"], alphabet, senses)


def write_assumptions(assumptions: Assumptions) -> dict[str, Any]:
    """Return assumptions as JSON knows them."""
    alphabet = assumptions.alphabet
    return without_none(
        {
            "n_objects": assumptions.n_objects,
            "n_aspects": assumptions.n_aspects,
            "actions": list(assumptions.actions),
            "slots": list(alphabet.slots),
            "n_symbols": alphabet.n_symbols,
            # Left out where it is as usual: what was written before has no word of it.
            "exclusive": None if alphabet.exclusive else False,
            "symbols": list(alphabet.names) or None,
            "open": alphabet.is_open or None,
            "object_senses": [write_object_sense(each) for each in assumptions.object_senses] or None,
        }
    )


def read_memory(value: Any, assumptions: Assumptions, place: str) -> RobotMemory:
    """Return the robot memory whose list of ATGs is at ``place``."""
    memory = RobotMemory(assumptions)
    for entry, where in read_entries(value, place):
        graph = read_graph(entry, assumptions, where)
        with placed(where):
            memory.add(graph)
    return memory


def read_graph(value: Any, assumptions: Assumptions, place: str) -> AspectTransitionGraph:
    """Return the ATG at ``place``."""
    fields = read_object(value, place, ("name", "aspects", "transitions"), ("measured",))
    graph = AspectTransitionGraph(plain_text(fields["name"], f"{place}.name"), assumptions)
    for pattern, where in read_entries(fields["aspects"], f"{place}.aspects"):
        with placed(where):
            graph.add_aspect(assumptions.alphabet.check_pattern(read_list(pattern, where)))
    for entry, where in read_entries(fields["transitions"], f"{place}.transitions"):
        edge = read_object(entry, where, ("from", "action", "to", "count"))
        action = assumptions.action_index(edge["action"], f"{where}.action")
        ends = [whole_number(edge[key], f"{where}.{key}", least=0) for key in ("from", "to")]
        count = whole_number(edge["count"], f"{where}.count", least=1)
        with placed(where):
            graph.add_transition(ends[0], action, ends[1], count)
    for name, moments in read_moments(
        fields.get("measured", {}), assumptions.object_senses, f"{place}.measured"
    ).items():
        graph.add_moments(name, moments)
    return graph


def write_graph(graph: AspectTransitionGraph) -> dict[str, Any]:
    """Return an ATG as JSON knows it."""
    return {
        "name": graph.name,
        "aspects": [list(pattern) for pattern in graph.aspects],
        "transitions": [
            {"from": source, "action": graph.assumptions.actions[action], "to": target, "count": count}
            for (source, action, target), count in sorted(graph.counts.items())
        ],
        **({"measured": write_moments(graph.measured)} if graph.measured else {}),
    }
