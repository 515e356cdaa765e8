import copy
from typing import Any

import pytest

from atg_fg.core.aspect_graph import COLLECTION_NODE, AspectTransitionGraph
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.storage.memory_json import memory_from_json, memory_to_json
from tests.small import graph, one_slot

WORLD = one_slot(5, 3, 6, actions=("push", "pull"))


def empty() -> AspectTransitionGraph:
    return AspectTransitionGraph("cup", WORLD)


def test_a_new_graph_is_all_collection_node() -> None:
    assert (empty().n_known, empty().n_unobserved, empty().aspects, empty().counts) == (0, 3, (), {})


@pytest.mark.parametrize("name", ["", None, 3])
def test_a_graph_needs_a_name(name: object) -> None:
    with pytest.raises(InvalidInputError, match="name"):
        AspectTransitionGraph(name, WORLD)


def test_aspects_are_numbered_as_they_are_observed() -> None:
    cup = empty()
    assert [cup.add_aspect((4,)), cup.add_aspect((1,))] == [0, 1]
    assert cup.aspects == ((4,), (1,))
    assert cup.pattern_indices == (4, 1)
    assert (cup.aspect_showing(1), cup.aspect_showing(0)) == (1, None)
    assert cup.n_unobserved == 1


@pytest.mark.parametrize("pattern", [(4,), (6,), (-1,), (None,), (0, 1), ()])
def test_a_repeated_or_malformed_pattern_is_no_new_aspect(pattern: tuple) -> None:
    cup = graph(WORLD, "cup", [(4,)])
    with pytest.raises(InvalidInputError):
        cup.add_aspect(pattern)
    assert cup == graph(WORLD, "cup", [(4,)])


def test_a_full_graph_takes_no_further_aspect() -> None:
    cup = graph(WORLD, "cup", [(0,), (1,), (2,)])
    with pytest.raises(InvalidInputError, match="at most n_aspects = 3"):
        cup.add_aspect((3,))
    assert cup.n_known == 3


def test_counts_of_one_transition_add_up() -> None:
    cup = graph(WORLD, "cup", [(0,), (1,)], (0, 1, 1, 2), (0, 1, 1, 3), (1, 0, 1, 1))
    assert cup.counts == {(0, 1, 1): 5, (1, 0, 1): 1}


@pytest.mark.parametrize(
    "edge",
    [
        (2, 0, 0, 1),
        (0, 0, 2, 1),
        (-1, 0, 0, 1),
        (0, 0, True, 1),
        (0.0, 0, 0, 1),
        (0, 2, 0, 1),
        (0, -1, 0, 1),
        (0, True, 0, 1),
        (0, 0, 0, 0),
        (0, 0, 0, -1),
        (0, 0, 0, 1.5),
        (0, 0, 0, True),
        (0, 0, 0, 2**53 + 1),
    ],
)
def test_a_transition_that_cannot_be_is_refused(edge: tuple) -> None:
    cup = graph(WORLD, "cup", [(0,), (1,)])
    with pytest.raises(InvalidInputError, match="cup"):
        cup.add_transition(*edge)
    assert cup.counts == {}


def test_no_way_to_learn_takes_a_count_past_what_a_file_can_hold() -> None:
    full = empty()
    full.add_aspect((1,))
    full.add_transition(0, 1, 0, count=2**53)
    again = full.copy()
    for learn in (
        lambda: full.add_transition(0, 1, 0),
        lambda: full.learn([full.pattern_indices[0]] * 2, [1]),
        lambda: full.absorb(again),
    ):
        with pytest.raises(InvalidInputError, match="expected a sum of at most"):
            learn()
    assert full.counts == {(0, 1, 0): 2**53}
    memory = RobotMemory(full.assumptions, [full])
    with pytest.raises(InvalidInputError, match="expected a sum"):
        memory.learn([full.pattern_indices[0]] * 2, [1], matched=full.name)
    assert memory_from_json(memory_to_json(memory)) == memory


def test_a_trial_teaches_new_aspects_and_the_transitions_between_complete_looks() -> None:
    cup = empty()
    cup.learn([4, 1, 4, 1, None, 4, 4], [0, 1, 0, 0, 0, 1])
    assert cup.aspects == ((4,), (1,))
    # 4 push 1 twice; 1 pull 4; nothing into or out of the incomplete look; 4 pull 4.
    assert cup.counts == {(0, 0, 1): 2, (1, 1, 0): 1, (0, 1, 0): 1}


def test_a_second_trial_extends_what_the_first_taught() -> None:
    cup = empty()
    cup.learn([4, 1], [0])
    cup.learn([1, 2], [1])
    cup.learn([4, 1], [0])
    assert cup.aspects == ((4,), (1,), (2,))
    assert cup.counts == {(0, 0, 1): 2, (1, 1, 2): 1}


def test_a_pattern_beyond_the_last_aspect_is_passed_over_with_its_transitions() -> None:
    cup = empty()
    cup.learn([0, 1, 2, 3, 0], [0, 0, 0, 0])
    assert cup.aspects == ((0,), (1,), (2,))
    assert cup.counts == {(0, 0, 1): 1, (1, 0, 2): 1}


@pytest.mark.parametrize(("patterns", "actions"), [([0], [0]), ([0, 1], []), ([], [])])
def test_a_trial_has_one_look_more_than_actions(patterns: list, actions: list) -> None:
    with pytest.raises(InvalidInputError, match="one observation more"):
        empty().learn(patterns, actions)


@pytest.mark.parametrize("pattern", [-1, 6])
def test_a_pattern_that_is_not_in_the_alphabet_is_not_learned(pattern: int) -> None:
    cup = empty()
    with pytest.raises(InvalidInputError):
        cup.learn([pattern], [])
    assert cup.n_known == 0


def test_what_was_never_tried_is_known_to_be_unknown() -> None:
    cup = graph(WORLD, "cup", [(0,), (1,)], (0, 1, 1, 2))
    assert list(cup.unknown_transitions()) == [(0, 0), (1, 0), (1, 1)]
    assert list(empty().unknown_transitions()) == []


def test_networkx_has_the_aspects_the_collection_node_and_both_kinds_of_edges() -> None:
    view = graph(WORLD, "cup", [(4,), (1,)], (0, 1, 1, 2), (0, 1, 0, 1)).to_networkx()
    assert view.name == "cup"
    assert dict(view.nodes(data=True)) == {0: {"pattern": (4,)}, 1: {"pattern": (1,)}, COLLECTION_NODE: {"size": 1}}
    observed = [(x, y, d["action"], d["count"]) for x, y, d in view.edges(data=True) if d["observed"]]
    assert sorted(observed) == [(0, 0, "pull", 1), (0, 1, "pull", 2)]
    dotted = [(x, y, d["action"], d["count"]) for x, y, d in view.edges(data=True) if not d["observed"]]
    c = COLLECTION_NODE
    assert sorted(dotted) == [(0, c, "push", 0), (1, c, "pull", 0), (1, c, "push", 0)]


def test_networkx_has_no_collection_node_once_all_aspects_are_known() -> None:
    view = graph(WORLD, "cup", [(0,), (1,), (2,)], (0, 0, 1, 1)).to_networkx()
    assert set(view.nodes) == {0, 1, 2}
    assert view.number_of_edges() == 1


@pytest.mark.parametrize("copied", [AspectTransitionGraph.copy, copy.copy, copy.deepcopy])
def test_a_copy_goes_its_own_way(copied: Any) -> None:
    cup = graph(WORLD, "cup", [(0,), (1,)], (0, 0, 1, 1))
    twin = copied(cup)
    assert twin == cup
    twin.learn([1, 2], [0])
    assert twin != cup
    assert cup == graph(WORLD, "cup", [(0,), (1,)], (0, 0, 1, 1))
    cup.counts.clear()
    assert cup.counts == {(0, 0, 1): 1}


def test_graphs_are_equal_only_in_name_aspects_counts_and_assumptions() -> None:
    cup = graph(WORLD, "cup", [(0,), (1,)], (0, 0, 1, 1))
    assert cup != graph(WORLD, "mug", [(0,), (1,)], (0, 0, 1, 1))
    assert cup != graph(WORLD, "cup", [(1,), (0,)], (0, 0, 1, 1))
    assert cup != graph(WORLD, "cup", [(0,), (1,)], (0, 0, 1, 2))
    assert cup != graph(one_slot(6, 3, 6, actions=("push", "pull")), "cup", [(0,), (1,)], (0, 0, 1, 1))
    assert cup != "cup"
    assert repr(cup) == "AspectTransitionGraph('cup', 2 of 3 aspects, 1 observed edges)"


def test_the_table_of_counts_follows_the_graph() -> None:
    atg = empty()
    assert atg.count_table.shape == (0, 4)
    atg.add_aspect((0,))
    atg.add_aspect((2,))
    atg.add_transition(0, 1, 1)
    assert atg.count_table.tolist() == [[0, 1, 1, 1]]
    twin = atg.copy()
    atg.add_transition(0, 1, 1)
    atg.add_transition(1, 0, 0, count=4)
    assert atg.count_table.tolist() == [[0, 1, 1, 2], [1, 0, 0, 4]]
    assert atg.n_counted == 2
    assert twin.count_table.tolist() == [[0, 1, 1, 1]]
    with pytest.raises(ValueError, match="read-only"):
        atg.count_table[0, 3] = 7
