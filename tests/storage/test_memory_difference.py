from atg_fg.core.memory import RobotMemory
from atg_fg.storage.memory_difference import difference
from tests.small import graph, one_slot
from tests.storage.database.small import add_cube, plain, structured

WORLD = one_slot(9, 6, 6)
CUP = graph(WORLD, "cup", [(0,), (1,)], (0, 0, 1, 1))
MUG = graph(WORLD, "mug", [(2,)])


def test_a_memory_is_as_it_is():
    assert difference(RobotMemory(WORLD, [CUP, MUG]), RobotMemory(WORLD, [CUP, MUG])) == {}


def test_what_is_different_is_named_object_by_object():
    more = graph(WORLD, "cup", [(0,), (1,), (3,)], (0, 0, 1, 3), (1, 0, 2, 1))
    jug = graph(WORLD, "jug", [(4,)])
    assert difference(RobotMemory(WORLD, [CUP, MUG]), RobotMemory(WORLD, [jug, more])) == {
        "only_first": ["mug"],
        "only_second": ["jug"],
        "changed": {"cup": {"aspects_new": [[3]], "transitions_more": 3}},
    }
    assert difference(RobotMemory(WORLD, [more]), RobotMemory(WORLD, [CUP]))["changed"] == {
        "cup": {"aspects_lost": [[3]], "transitions_less": 3}
    }


def test_another_name_and_another_order_are_told_as_such():
    beaker = graph(WORLD, "beaker", [(2,)])
    assert difference(RobotMemory(WORLD, [MUG]), RobotMemory(WORLD, [beaker])) == {"renamed": {"mug": "beaker"}}
    found = difference(RobotMemory(WORLD, [CUP, MUG]), RobotMemory(WORLD, [MUG, CUP]))
    assert found == {"order": {"first": ["cup", "mug"], "second": ["mug", "cup"]}}
    turned = graph(WORLD, "cup", [(1,), (0,)], (1, 0, 0, 1))
    assert difference(RobotMemory(WORLD, [CUP]), RobotMemory(WORLD, [turned])) == {
        "changed": {"cup": {"aspect_order": True}}
    }


def test_assumptions_merges_and_structure_count_too():
    other = one_slot(8, 6, 6)
    assert difference(RobotMemory(WORLD), RobotMemory(other)) == {"assumptions": {"n_objects": [9, 8]}}
    merged = RobotMemory(WORLD, [CUP, MUG])
    merged.merge("cup", "mug")
    assert difference(RobotMemory(WORLD, [CUP, MUG]), merged)["merges"] == [0, 1]
    one, two = structured(1), structured(1)
    assert difference(plain(1), one) == {"structure": {"learned": [False, True]}}
    add_cube(two, 2)
    assert difference(one, two)["structure"]["trials"] == [1, 2]
