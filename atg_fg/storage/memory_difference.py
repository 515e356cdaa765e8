"""How two memories differ, object by object."""

from __future__ import annotations

from collections import Counter
from dataclasses import fields
from typing import Any

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.memory import RobotMemory
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.structure_json import write_learner


def difference(first: RobotMemory, second: RobotMemory) -> dict[str, Any]:
    """Return what the second memory has otherwise than the first, as JSON knows it; empty if nothing.

    Keys, where there is something to say: ``assumptions`` (name: both values), ``only_first`` and ``only_second``
    (names of ATGs), ``renamed`` (name in the first: name in the second, of ATGs that are the same but for it),
    ``changed`` (name: what is different), ``order``, ``merges`` (both numbers), ``structure`` (name: both values).
    """
    found: dict[str, Any] = {"assumptions": _assumptions(first, second)}
    renamed = _renamed(first, second)
    found["renamed"] = renamed
    found["only_first"] = [name for name in first.names if name not in second.names and name not in renamed]
    found["only_second"] = [name for name in second.names if name not in first.names and name not in renamed.values()]
    both = [name for name in first.names if name in second.names]
    changed = {name: _changes(first[name], second[name]) for name in both}
    found["changed"] = {name: changes for name, changes in changed.items() if changes}
    order = [name for name in second.names if name in first.names]
    found["order"] = {"first": both, "second": order} if both != order else {}
    if first.merges != second.merges:
        found["merges"] = [len(first.merges), len(second.merges)]
    found["structure"] = _structure(first, second)
    return {key: value for key, value in found.items() if value}


def _assumptions(first: RobotMemory, second: RobotMemory) -> dict[str, Any]:
    one, two = first.assumptions, second.assumptions
    pairs = {each.name: (getattr(one, each.name), getattr(two, each.name)) for each in fields(one)}
    del pairs["alphabet"]
    pairs["slots"] = (one.alphabet.slots, two.alphabet.slots)
    pairs["n_symbols"] = (one.alphabet.n_symbols, two.alphabet.n_symbols)
    return {
        name: [list(each) if isinstance(each, tuple) else each for each in pair]
        for name, pair in pairs.items()
        if pair[0] != pair[1]
    }


def _renamed(first: RobotMemory, second: RobotMemory) -> dict[str, str]:
    """Return the ATGs that only one memory has by name, and that the other one has by another name."""
    if first.assumptions != second.assumptions:
        return {}
    new = {_content(graph): graph.name for graph in reversed(list(second)) if graph.name not in first.names}
    old = {_content(graph): graph.name for graph in reversed(list(first)) if graph.name not in second.names}
    return {name: new[content] for content, name in sorted(old.items(), key=lambda item: item[1]) if content in new}


def _content(graph: AspectTransitionGraph) -> tuple[Any, ...]:
    return graph.pattern_indices, tuple(sorted(graph.counts.items()))


def _changes(one: AspectTransitionGraph, two: AspectTransitionGraph) -> dict[str, Any]:
    """Return what is different in an ATG, aspects by their patterns; empty if nothing."""
    before, after = _by_pattern(one), _by_pattern(two)
    changes: dict[str, Any] = {
        "aspects_lost": [list(pattern) for pattern in one.aspects if pattern not in two.aspects],
        "aspects_new": [list(pattern) for pattern in two.aspects if pattern not in one.aspects],
        "transitions_less": (before - after).total(),
        "transitions_more": (after - before).total(),
    }
    if not any(changes.values()) and one.aspects != two.aspects:
        changes["aspect_order"] = True
    return {key: value for key, value in changes.items() if value}


def _by_pattern(graph: AspectTransitionGraph) -> Counter[tuple[Any, ...]]:
    shown, actions = graph.aspects, graph.assumptions.actions
    return Counter({(shown[x], actions[a], shown[y]): number for (x, a, y), number in graph.counts.items()})


def _structure(first: RobotMemory, second: RobotMemory) -> dict[str, Any]:
    one, two = (
        write_learner(memory.learner) if isinstance(memory, StructuredMemory) else None for memory in (first, second)
    )
    if one is None or two is None:
        return {} if one is two else {"learned": [one is not None, two is not None]}
    # What is as usual is not written.
    different = {key: [one.get(key), two.get(key)] for key in {**one, **two} if one.get(key) != two.get(key)}
    if "trials" in different:
        different["trials"] = [len(one["trials"]), len(two["trials"])]
    return different
