import itertools
import json
import math

import networkx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.errors import InvalidInputError, TooLargeError
from atg_fg.learning.shared_structure import SharedStructure
from atg_fg.storage.structure_json import read_structure, write_structure
from atg_fg.worlds.arcube import SUCCESSORS
from tests.learning.worlds import ARCUBES, BOX, CUBE, DOUBLE, PRISM, RING


@st.composite
def structures(draw: st.DrawFn, *, any_map: bool = True, most: int = 5) -> SharedStructure:
    n_slots = draw(st.integers(1, 2))
    n_registers = draw(st.integers(n_slots, most))
    actions = st.permutations(range(n_registers)).map(tuple)
    if any_map:
        actions |= st.tuples(*[st.integers(0, n_registers - 1)] * n_registers)
    return SharedStructure(n_slots, tuple(draw(actions) for _ in range(draw(st.integers(1, 3)))))


def test_the_poses_of_the_cube_are_its_24_orientations():
    graph, poses = CUBE.to_networkx(), CUBE.poses()
    assert poses.registers.shape == (24, 6)
    assert poses.successors.shape == (24, 3)
    orientations = networkx.MultiDiGraph()
    for orientation, successors in enumerate(SUCCESSORS):
        for action, successor in enumerate(successors):
            orientations.add_edge(orientation, successor, key=action, action=action)
    same_action = networkx.isomorphism.categorical_multiedge_match("action", None)
    assert networkx.is_isomorphic(graph, orientations, edge_match=same_action)
    assert graph.nodes[0]["registers"] == (0, 1, 2, 3, 4, 5)


@given(structure=structures(any_map=False))
def test_poses_of_permutations_are_a_group_and_all_alike_to_a_new_object(structure):
    poses = structure.poses(limit=120)
    assert math.factorial(structure.n_registers) % len(poses.registers) == 0  # Lagrange
    assert (poses.first.tolist(), poses.first_weights.tolist()) == ([0], [1.0])


@given(structure=structures(most=4))
def test_poses_are_closed_and_do_what_the_sources_say(structure):
    poses = structure.poses(limit=256)
    assert len({tuple(row) for row in poses.registers.tolist()}) == len(poses.registers)
    for action, sources in enumerate(structure.sources):
        turned = poses.registers[poses.successors[:, action]]
        np.testing.assert_array_equal(turned, poses.registers[:, list(sources)])


@given(structure=structures(most=4))
def test_each_pose_is_a_first_pose_by_other_names_of_the_registers(structure):
    poses = structure.poses(limit=256)
    registers = [tuple(row) for row in poses.registers.tolist()]
    renamings = [pose for pose in registers if len(set(pose)) == len(pose)]
    classes = [
        {tuple(renaming[register] for register in registers[first]) for renaming in renamings}
        for first in poses.first.tolist()
    ]
    assert sum(map(len, classes)) == len(set.union(*classes)) == len(registers)
    shares = [len(each) / len(registers) for each in classes]
    np.testing.assert_allclose(poses.first_weights, shares, rtol=1e-12)


def test_the_monoid_of_a_lid_that_opens_by_hand():
    # In view is the top, hidden the inside; opened, the top shows the inside and the lid is lost.
    poses = SharedStructure(1, ((1, 1),)).poses()
    assert poses.registers.tolist() == [[0, 1], [1, 1]]
    assert poses.successors.tolist() == [[1], [1]]
    assert poses.first.tolist() == [0, 1]  # found with its lid on, or off
    assert poses.first_weights.tolist() == [0.5, 0.5]


def test_the_monoid_of_contents_that_move_up_by_hand():
    poses = SharedStructure(1, ((1, 2, 2),)).poses()
    assert poses.registers.tolist() == [[0, 1, 2], [1, 2, 2], [2, 2, 2]]
    assert poses.successors.tolist() == [[1], [2], [2]]
    assert poses.first_weights.tolist() == pytest.approx([1 / 3] * 3)


def test_a_class_is_as_probable_as_it_has_poses():
    # Two places are exchanged, or what is in the third comes into all: then other names make no difference.
    poses = SharedStructure(1, ((1, 0, 2), (2, 2, 2))).poses()
    assert poses.registers.tolist() == [[0, 1, 2], [1, 0, 2], [2, 2, 2]]
    assert poses.first_weights.tolist() == pytest.approx([2 / 3, 1 / 3])


def test_a_box_has_poses_with_its_lid_on_and_off_but_no_way_back():
    poses = BOX.poses()
    assert len(poses.registers) == 4
    assert poses.first_weights.tolist() == [0.5, 0.5]
    graph = BOX.to_networkx()
    first_open = int(poses.first[1])
    assert networkx.has_path(graph, 0, first_open)
    assert not networkx.has_path(graph, first_open, 0)


def test_poses_that_show_one_register_twice_are_impossible():
    poses = DOUBLE.poses()
    assert poses.possible(2).tolist() == [float(front != top) for front, top in poses.registers[:, :2].tolist()]
    assert 0 < poses.possible(2).sum() < len(poses.registers)
    assert CUBE.poses().possible(2).all()


@given(structure=structures(), seed=st.integers(0, 99))
def test_names_of_hidden_registers_do_not_matter(structure, seed):
    rng = np.random.default_rng(seed)
    hidden = range(structure.n_slots, structure.n_registers)
    new = [*range(structure.n_slots), *rng.permutation(hidden).tolist()]
    renamed = [[0] * structure.n_registers for _ in structure.sources]
    for sources, result in zip(structure.sources, renamed, strict=True):
        for register, source in enumerate(sources):
            result[new[register]] = new[source]
    other = SharedStructure(structure.n_slots, tuple(map(tuple, renamed)))
    assert other.canonical() == structure.canonical() == structure.canonical().canonical()


def test_registers_that_never_come_into_view_are_left_out():
    idle = SharedStructure(1, ((1, 0, 3, 2),))
    assert idle.canonical() == SharedStructure(1, ((1, 0),))


def test_a_register_that_takes_what_another_shows_is_left_out_if_it_never_gives_it_back():
    # What was in view goes to a hidden register, and from there nowhere.
    assert SharedStructure(1, ((1, 1, 0),)).canonical() == SharedStructure(1, ((1, 1),))


def test_a_larger_structure_is_less_probable_beforehand():
    # Two registers in view, three actions: (0.9/2!)^3; one hidden register more: 1/2 · 1! · (0.9/3!)^3.
    assert SharedStructure(2, ((0, 1),) * 3).log_prior == pytest.approx(3 * math.log(0.45))
    assert SharedStructure(2, ((0, 1, 2),) * 3).log_prior == pytest.approx(math.log(0.5) + 3 * math.log(0.15))


def test_an_irreversible_action_is_less_probable_beforehand():
    # Of 2² maps 2 are no permutations, of 3³ maps 21.
    assert SharedStructure(2, ((0, 0), (0, 1))).log_prior == pytest.approx(math.log(0.05 * 0.45))
    assert SharedStructure(2, ((0, 0, 1),)).log_prior == pytest.approx(math.log(0.5 * 0.1 / 21))


@pytest.mark.parametrize(("n_slots", "n_actions"), [(1, 2), (2, 1), (3, 1), (1, 1)])
def test_the_prior_is_that_of_all_names_of_hidden_registers_together(n_slots, n_actions):
    maps = itertools.product(range(3), repeat=3)
    structures = [SharedStructure(n_slots, sources) for sources in itertools.product(list(maps), repeat=n_actions)]
    canonical = {each.canonical() for each in structures}
    whole = [each for each in canonical if each.n_registers == 3]
    total = sum(math.exp(each.log_prior) for each in whole)
    hidden = 3 - n_slots
    labelled = sum(
        math.prod(0.9 / 6 if len(set(sources)) == 3 else 0.1 / 21 for sources in each.sources)
        for each in structures
        if each.canonical().n_registers == 3
    )
    assert total == pytest.approx(labelled / 2**hidden)
    assert labelled <= 1 + 1e-12


def test_more_poses_than_the_limit_are_refused():
    full = SharedStructure(1, ((1, 2, 3, 4, 5, 0), (1, 0, 2, 3, 4, 5)))  # generate all 720 permutations
    with pytest.raises(TooLargeError, match="more than 200 poses"):
        full.poses()


@pytest.mark.parametrize(
    ("n_slots", "sources"),
    [(0, ((0,),)), (1, ()), (1, ((0, 2),)), (1, ((0, 1), (0,))), (2, ((0,),)), (1, ((1, -1),))],
)
def test_what_is_no_structure_is_refused(n_slots, sources):
    with pytest.raises(InvalidInputError, match="structure"):
        SharedStructure(n_slots, sources)


@pytest.mark.parametrize("structure", [CUBE, SharedStructure(2, ((0, 2, 2), (1, 0, 2), (0, 1, 1))).canonical()])
def test_json_and_back_changes_nothing(structure):
    assert read_structure(write_structure(structure, ARCUBES), ARCUBES, "here") == structure


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"registers": 1}, "here.registers: 1; expected a whole number of at least 2"),
        ({"registers": 1000}, "here.registers: 1000; expected at most 64"),
        ({"sources": {}}, "here.sources: key 'flip' is missing"),
        (
            {"sources": {"flip": [0, 1], "left": [1, 0], "right": [1, 2]}},
            r"here.sources.right: \[1, 2\]; expected 2 numbers of 0 to 1",
        ),
        ({"sources": {"flip": [0, 1], "left": [1, 0], "right": [1]}}, r"here.sources.right: \[1\]; expected 2"),
        ({"sources": {"flip": [0, 1], "left": [1, 0], "right": 3}}, "here.sources.right: 3; expected a list"),
        ({"more": 1}, "here: unknown key 'more'"),
    ],
)
def test_a_malformed_structure_is_refused_with_place_and_value(change, message):
    value = {"registers": 2, "sources": {"flip": [0, 1], "left": [1, 0], "right": [1, 0]}, **change}
    with pytest.raises(InvalidInputError, match=message):
        read_structure(value, ARCUBES, "here")


def test_a_structure_with_too_many_poses_is_refused_in_a_file():
    turn, swap = [1, 2, 3, 4, 5, 0], [1, 0, 2, 3, 4, 5]
    value = {"registers": 6, "sources": {"flip": turn, "left": swap, "right": swap}}
    with pytest.raises(InvalidInputError, match="here: structure: more than 200 poses"):
        read_structure(value, ARCUBES, "here")


def test_the_ring_has_six_poses():
    assert len(RING.poses().registers) == 6


def renamed(structure, modes, hidden):
    """A structure with modes in another order, and with other names of the hidden registers of each mode."""
    places = [(0, 1, *each) for each in hidden]
    maps = []
    for mode in modes:
        for action in range(structure.n_actions):
            target, sources = structure.step(mode, action)
            row = [0] * structure.n_registers
            for register, source in enumerate(sources):
                row[places[target][register]] = places[mode][source]
            maps.append(tuple(row))
    following = [[modes.index(structure.step(mode, action)[0]) for action in range(3)] for mode in modes]
    return SharedStructure(structure.n_slots, tuple(maps), tuple(map(tuple, following)))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("modes", [(0, 1), (1, 0)])
def test_the_names_of_modes_and_of_their_hidden_registers_make_no_difference(seed, modes):
    rng = np.random.default_rng(seed)
    other = renamed(PRISM, modes, [(2 + rng.permutation(6)).tolist() for _ in range(2)])
    assert other.canonical() == PRISM
    assert other.log_prior == pytest.approx(PRISM.log_prior)
    assert len(other.poses().registers) == 24


def test_the_prior_of_two_modes_by_hand():
    # Of 8! permutations, 6 of them; 6 hidden registers of either mode and two modes by any names.
    each = np.log(0.5 * 0.9 / math.factorial(8))
    first = np.log(0.9 / math.factorial(8))
    names = 2 * math.lgamma(7) + math.log(2)
    expected = 3 * first + 3 * each + names - 6 * math.log(2) + math.log(0.2) - 6 * math.log(2)
    assert PRISM.log_prior == pytest.approx(expected)


def test_a_map_that_is_alike_in_both_modes_costs_little():
    tied = SharedStructure(2, (*RING.sources, *RING.sources), ((1, 0), (0, 1)))
    assert tied.log_prior > RING.log_prior + math.log(2 * 0.2 / 2**4 * 0.5**2) - 1e-9
    assert tied.log_prior < RING.log_prior


def test_the_prior_of_two_modes_that_share_some_maps_by_hand():
    # One map is tied, and names the hidden registers of the second mode; the other is one of 3!.
    mixed = SharedStructure(1, ((1, 2, 0), (1, 0, 2), (1, 2, 0), (0, 1, 2)), ((1, 0), (0, 1)))
    maps = 0.15**2 * (0.5 + 0.5 * 0.15) * 0.5 * 0.15
    assert mixed.log_prior == pytest.approx(math.log(2 / 2**2 * 2 * 0.2 / 2**4 * maps))


def test_poses_that_look_alike_until_one_of_the_actions_tells_them_apart_are_two():
    # The second action goes into a mode in which the third one no longer exchanges what is in view with what is not.
    modes = SharedStructure(1, ((0, 1), (0, 1), (1, 0), (0, 1), (0, 1), (0, 1)), ((0, 1, 0), (1, 1, 1)))
    poses = modes.poses()
    assert poses.registers[:, 0].tolist() == [0, 0, 1, 1]
    assert poses.successors.tolist() == [[0, 1, 2], [1, 1, 1], [2, 3, 0], [3, 3, 3]]


def test_modes_that_are_alike_make_no_more_poses():
    tied = SharedStructure(2, (*RING.sources, *RING.sources), ((1, 0), (0, 1)))
    alone, both = RING.poses(), tied.poses()
    assert len(both.registers) == len(alone.registers)
    assert both.first.tolist() == alone.first.tolist()


def test_a_new_prism_stands_or_lies_and_all_else_is_names():
    poses = PRISM.poses()
    assert len(poses.first) == 2
    assert poses.first_weights.tolist() == [0.5, 0.5]


def test_a_mode_that_is_never_reached_is_dropped():
    beside = SharedStructure(2, (*RING.sources, (0, 1, 2), (0, 1, 2)), ((0, 0), (1, 1)))
    assert beside.canonical() == RING.canonical()


@pytest.mark.parametrize("following", [((0, 0),), ((0, 2), (1, 0)), ((0,), (1,)), ((0, -1), (0, 0))])
def test_next_modes_that_are_none_are_refused(following):
    with pytest.raises(InvalidInputError, match="next modes"):
        SharedStructure(2, (*RING.sources, *RING.sources), following)


def test_a_structure_with_modes_is_kept_in_a_file():
    document = json.loads(json.dumps(write_structure(PRISM, ARCUBES)))
    assert len(document["modes"]) == 2
    assert read_structure(document, ARCUBES, "here") == PRISM


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(modes=d["modes"][:1]), r"here\.modes: 1; expected 2 to 8 of them"),
        (lambda d: d.update(modes=d["modes"] * 9), r"here\.modes: 18; expected 2 to 8 of them"),
        (
            lambda d: d["modes"][1]["next"].update(left=2),
            r"modes\[1\]\.next\.left: 2; expected a whole number from 0 to 1",
        ),
        (lambda d: d["modes"][0]["sources"].update(flip=[0]), r"here\.modes\[0\]\.sources\.flip"),
        (lambda d: d["modes"][0].pop("next"), r"here\.modes\[0\]"),
        (lambda d: d.update(sources={}), "here"),
    ],
)
def test_modes_in_a_file_that_are_none_are_refused(change, message):
    document = json.loads(json.dumps(write_structure(PRISM, ARCUBES)))
    change(document)
    with pytest.raises(InvalidInputError, match=message):
        read_structure(document, ARCUBES, "here")
