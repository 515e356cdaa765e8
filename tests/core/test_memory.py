import copy
import pickle
from typing import Any

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from tests.small import graph, one_slot

WORLD = one_slot(3, 3, 6)


def cup_and_mug() -> RobotMemory:
    return RobotMemory(WORLD, [graph(WORLD, "cup", [(0,), (1,)], (0, 0, 1, 1)), graph(WORLD, "mug", [(2,)])])


def test_objects_are_remembered_in_the_order_they_came() -> None:
    memory = cup_and_mug()
    assert memory.names == ("cup", "mug")
    assert [known.name for known in memory] == ["cup", "mug"]
    assert len(memory) == 2
    assert memory["mug"].aspects == ((2,),)


@pytest.mark.parametrize(("n_remembered", "n_unseen"), [(0, 3), (1, 2), (2, 1), (3, 1), (5, 1)])
def test_one_unseen_object_is_always_thought_possible(n_remembered: int, n_unseen: int) -> None:
    memory = RobotMemory(WORLD, [graph(WORLD, str(i), []) for i in range(n_remembered)])
    assert memory.n_unseen == n_unseen


def test_a_name_is_given_once() -> None:
    memory = cup_and_mug()
    with pytest.raises(InvalidInputError, match="'cup' is repeated"):
        memory.add(graph(WORLD, "cup", []))
    assert memory == cup_and_mug()


def test_a_graph_made_under_other_assumptions_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="other assumptions"):
        RobotMemory(WORLD, [graph(one_slot(4, 3, 6), "cup", [])])


def test_a_graph_that_is_not_there_is_named_with_those_that_are() -> None:
    with pytest.raises(UnknownNameError, match="'jug'; expected one of: cup, mug"):
        cup_and_mug()["jug"]
    with pytest.raises(UnknownNameError, match="jug"):
        cup_and_mug().learn([0], [], matched="jug")


def test_a_novel_object_becomes_a_new_graph() -> None:
    memory = cup_and_mug()
    name = memory.learn([3, 4], [0], matched=None)
    assert memory.names == ("cup", "mug", name)
    assert memory[name] == graph(WORLD, name, [(3,), (4,)], (0, 0, 1, 1))
    assert list(memory)[:2] == list(cup_and_mug())


def test_a_known_object_extends_its_graph_and_keeps_its_place() -> None:
    memory = cup_and_mug()
    assert memory.learn([1, 5], [0], matched="cup") == "cup"
    assert memory.names == ("cup", "mug")
    assert memory["cup"] == graph(WORLD, "cup", [(0,), (1,), (5,)], (0, 0, 1, 1), (1, 0, 2, 1))
    assert memory["mug"] == cup_and_mug()["mug"]


def test_new_names_avoid_those_that_are_taken() -> None:
    memory = RobotMemory(WORLD, [graph(WORLD, "object-001", []), graph(WORLD, "object-002", [])])
    names = [memory.learn([0], [], matched=None) for _ in range(3)]
    assert len({*names, "object-001", "object-002"}) == 5


def test_a_trial_that_cannot_be_learned_leaves_the_memory_as_it_was() -> None:
    memory = cup_and_mug()
    with pytest.raises(InvalidInputError):
        memory.learn([1, 5, 0], [0, 9], matched="cup")
    with pytest.raises(InvalidInputError):
        memory.learn([1, 5], [], matched=None)
    assert memory == cup_and_mug()


def test_a_graph_taken_out_before_is_not_changed_by_learning() -> None:
    memory = cup_and_mug()
    before = memory["cup"]
    memory.learn([1, 5], [0], matched="cup")
    assert before == cup_and_mug()["cup"]


@pytest.mark.parametrize(
    "copied", [RobotMemory.copy, copy.copy, copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))]
)
def test_a_copy_goes_its_own_way(copied: Any) -> None:
    memory = cup_and_mug()
    twin = copied(memory)
    assert twin == memory
    twin["mug"].add_aspect((0,))
    twin.learn([5], [], matched=None)
    assert memory == cup_and_mug()
    assert twin != memory


def test_the_order_of_objects_and_the_assumptions_are_part_of_a_memory() -> None:
    memory = cup_and_mug()
    assert memory != RobotMemory(WORLD, reversed(list(memory)))
    assert RobotMemory(WORLD) != RobotMemory(one_slot(4, 3, 6))
    assert memory != "memory"
    assert repr(memory) == "RobotMemory(2 of 3 objects)"


@pytest.mark.parametrize(("patterns", "actions"), [([None], []), ([None, None], [0])])
def test_a_novel_object_that_was_never_seen_whole_is_no_graph(patterns: list, actions: list) -> None:
    memory = cup_and_mug()
    with pytest.raises(InvalidInputError, match="learn: no pattern was seen whole"):
        memory.learn(patterns, actions, None)
    assert len(memory) == 2
    assert memory.learn(patterns, actions, memory.names[0]) == memory.names[0]


def test_numpy_integers_are_learned_as_plain_ones() -> None:
    plain, other = cup_and_mug(), cup_and_mug()
    plain.learn([0, 1, 0], [0, 0], None)
    other.learn(np.array([0, 1, 0]), np.array([0, 0], dtype=np.uint8), None)
    assert plain == other
    assert {type(number) for edge, count in list(other)[-1].counts.items() for number in (*edge, count)} == {int}


@pytest.mark.parametrize(("patterns", "actions"), [([0, 99], [0]), ([0, 1], [5]), ([0, 1.5], [0]), ([0, True], [0])])
def test_what_cannot_be_learned_is_refused_before_anything_is(patterns: list, actions: list) -> None:
    graph_alone = next(iter(cup_and_mug()))
    before = graph_alone.copy()
    with pytest.raises(InvalidInputError, match="expected a whole number from 0"):
        graph_alone.learn(patterns, actions)
    assert graph_alone == before
