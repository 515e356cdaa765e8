import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.learning.memory_union import holds, unite
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import memory_json
from tests.small import graph, one_slot
from tests.storage.database.small import add_cube, plain, structured

WORLD = one_slot(9, 6, 6)


def memory_of(*graphs):
    return RobotMemory(WORLD, graphs)


def test_a_graph_holds_another_one_if_it_has_gone_on_from_it():
    seed = graph(WORLD, "cup", [(0,), (1,)], (0, 0, 1, 1))
    assert holds(graph(WORLD, "cup", [(0,), (1,), (2,)], (0, 0, 1, 2)), seed)
    assert not holds(graph(WORLD, "cup", [(1,), (0,)], (1, 0, 0, 1)), seed)
    assert not holds(graph(WORLD, "cup", [(0,), (1,), (2,)]), seed)


def test_a_memory_and_itself_make_the_same():
    memory = memory_of(graph(WORLD, "cup", [(0,)]), graph(WORLD, "mug", [(1,)]))
    union = unite(memory, memory)
    assert union.memory == memory
    assert (union.renamed, union.same) == ({}, ("cup", "mug"))


def test_objects_of_the_same_name_that_are_not_alike_are_two():
    first = memory_of(graph(WORLD, "object-000", [(0,)]), graph(WORLD, "cup", [(3,)]))
    second = memory_of(graph(WORLD, "object-000", [(1,)]), graph(WORLD, "mug", [(2,)]))
    union = unite(first, second)
    assert union.memory.names == ("object-000", "cup", "object-002", "mug")
    assert union.renamed == {"object-000": "object-002"}
    assert [each.aspects for each in union.memory] == [((0,),), ((3,),), ((1,),), ((2,),)]
    assert first.names == ("object-000", "cup")


def test_of_one_object_the_memory_that_has_learned_more_counts():
    old, new = graph(WORLD, "cup", [(0,), (1,)], (0, 0, 1, 1)), graph(WORLD, "cup", [(0,), (1,)], (0, 0, 1, 3))
    for first, second in ((old, new), (new, old)):
        assert list(unite(memory_of(first), memory_of(second)).memory) == [new]


@pytest.mark.parametrize("make", [plain, structured])
def test_a_memory_and_what_became_of_a_copy_of_it_make_the_latter(make):
    before = make(2)
    after = before.copy()
    add_cube(after, 2)
    add_cube(after, 0, matched="object-000")
    after.merge("object-000", "object-001")
    for first, second in ((before, after), (after, before)):
        union = unite(first, second).memory
        assert list(union) == list(after)
        assert union.merges == after.merges
        if isinstance(after, StructuredMemory):
            assert sorted(union.learner.owners) == sorted(after.learner.owners)


def test_merges_of_both_can_be_undone():
    parts = [(graph(WORLD, "object-000", [(n,)]), graph(WORLD, "object-001", [(n,), (n + 1,)])) for n in (0, 2)]
    memories = [memory_of(*graphs) for graphs in parts]
    for memory in memories:
        memory.merge("object-000", "object-001")
    union = unite(*memories).memory
    assert union.names == ("object-000", "object-002")
    assert [merge.dropped.name for merge in union.merges] == ["object-001", "object-003"]
    union.unmerge("object-003")
    union.unmerge("object-001")
    assert sorted(each.aspects for each in union) == sorted(each.aspects for graphs in parts for each in graphs)


def test_structure_is_learned_from_the_trials_of_both():
    first, second = structured(2), StructuredMemory(structured(0).assumptions)
    for number in (4, 5):
        add_cube(second, number)
    union = unite(first, second).memory
    assert isinstance(union, StructuredMemory)
    assert union.learner.owners == ["object-000", "object-001", "object-002", "object-003"]
    assert union.learner.trials == first.learner.trials + second.learner.trials
    assert memory_json.memory_from_json(memory_json.memory_to_json(union)) == union
    assert list(unite(first, plain(0)).memory) == list(first)


def test_other_assumptions_are_refused():
    with pytest.raises(InvalidInputError, match="under the same assumptions"):
        unite(memory_of(), RobotMemory(one_slot(9, 6, 7)))
