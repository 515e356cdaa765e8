"""Senses of the object and readings in files: what comes back is what was written, and nothing else comes in."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.memory_files import load_memory, open_memory, save_memory
from atg_fg.storage.memory_json import memory_from_document, memory_to_document

WEIGHT = ObjectSense("weight", 0.5, 0.6, 0.08, unit="kg", revealed_by=("flip",))
SIZE = ObjectSense("size", 0.1, 0.02, 0.01, relative=False, worth=10.0)
ASSUMED = Assumptions(5, 3, ("flip", "left"), PatternAlphabet(("front",), 4), (WEIGHT, SIZE))


def fill(memory: RobotMemory) -> RobotMemory:
    for matched, reading in ((None, 0.3), (None, 0.6), ("object-000", 0.31)):
        measured = [(), (("weight", reading), ("size", 0.1))]
        name = memory.learn([0, 1], [0], matched, measured=measured)
        memory.learn_shared(name, [(0,), (1,)], [0], measured=measured)
    return memory


@pytest.mark.parametrize("kind", [RobotMemory, StructuredMemory])
@pytest.mark.parametrize("name", ["memory.json", "memory.db"])
def test_a_memory_comes_back_with_its_readings(tmp_path: Path, kind: type[RobotMemory], name: str) -> None:
    memory = fill(kind(ASSUMED))
    save_memory(memory, tmp_path / name)
    loaded = load_memory(tmp_path / name)
    assert loaded == memory
    assert loaded.assumptions.object_senses == (WEIGHT, SIZE)
    assert loaded["object-000"].measured == memory["object-000"].measured
    assert loaded["object-000"].measured["weight"].count == 2


def test_an_open_database_keeps_what_is_felt_as_it_goes(tmp_path: Path) -> None:
    with open_memory(tmp_path / "robot.db", ASSUMED) as memory:
        fill(memory)
    assert load_memory(tmp_path / "robot.db") == fill(RobotMemory(ASSUMED))


def test_a_memory_without_such_senses_is_written_as_before() -> None:
    plain = Assumptions(5, 3, ("flip",), PatternAlphabet(("front",), 4))
    document = memory_to_document(RobotMemory(plain))
    assert "object_senses" not in document["assumptions"]


def changed(path: list[Any], value: Any) -> dict[str, Any]:
    document: Any = json.loads(json.dumps(memory_to_document(fill(StructuredMemory(ASSUMED)))))
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return document


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (["assumptions", "object_senses", 0, "error"], -1, "object_senses[0]: object sense 'weight': error -1"),
        (["assumptions", "object_senses", 0, "error"], "much", "object_senses[0]: object sense 'weight': error 'much'"),
        (["assumptions", "object_senses"], {}, "assumptions.object_senses: {}"),
        (["assumptions", "object_senses", 1, "name"], "front", "name 'front' is taken"),
        (["memory", 0, "measured", "weight", "count"], 0, "memory[0].measured.weight.count: 0"),
        (["memory", 0, "measured", "weight", "squares"], 1e-9, "memory[0].measured.weight: squares 1e-09"),
        (["memory", 0, "measured", "age"], {}, "memory[0].measured: unknown key 'age'"),
        (["structure", "trials", 0, "measured", 1, 0, 1], -2.0, "structure.trials[0].measured[1]: weight: -2.0"),
        (["structure", "trials", 0, "measured"], [[]], "structure.trials[0]: 1 readings"),
    ],
)
def test_what_is_malformed_is_refused_by_its_place(path: list[Any], value: Any, message: str) -> None:
    with pytest.raises(InvalidInputError) as raised:
        memory_from_document(changed(path, value))
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)
