import math

import networkx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.arcube import SUCCESSORS
from atg_fg.errors import InvalidInputError, TooLargeError
from atg_fg.structure.shared_structure import SharedStructure, read_structure, write_structure
from tests.structure.worlds import ARCUBES, CUBE, RING


@st.composite
def structures(draw: st.DrawFn) -> SharedStructure:
    n_slots = draw(st.integers(1, 2))
    n_registers = draw(st.integers(n_slots, 5))
    permutations = st.permutations(range(n_registers)).map(tuple)
    return SharedStructure(n_slots, tuple(draw(permutations) for _ in range(draw(st.integers(1, 3)))))


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


@given(structure=structures())
def test_poses_are_closed_and_do_what_the_sources_say(structure):
    poses = structure.poses(limit=120)
    assert len({tuple(row) for row in poses.registers.tolist()}) == len(poses.registers)
    assert math.factorial(structure.n_registers) % len(poses.registers) == 0  # Lagrange
    for action, sources in enumerate(structure.sources):
        turned = poses.registers[poses.successors[:, action]]
        np.testing.assert_array_equal(turned, poses.registers[:, list(sources)])


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


def test_a_larger_structure_is_less_probable_beforehand():
    # Two registers in view, three actions: 1/2!^3; one hidden register more: 1/2 · 1!/3!^3.
    assert SharedStructure(2, ((0, 1),) * 3).log_prior == pytest.approx(-3 * math.log(2))
    assert SharedStructure(2, ((0, 1, 2),) * 3).log_prior == pytest.approx(-math.log(2) - 3 * math.log(6))


def test_more_poses_than_the_limit_are_refused():
    full = SharedStructure(1, ((1, 2, 3, 4, 5, 0), (1, 0, 2, 3, 4, 5)))  # generate all 720 permutations
    with pytest.raises(TooLargeError, match="more than 200 poses"):
        full.poses()


@pytest.mark.parametrize(
    ("n_slots", "sources"),
    [(0, ((0,),)), (1, ()), (1, ((0, 0),)), (1, ((0, 1), (0,))), (2, ((0,),)), (1, ((1, 2),))],
)
def test_what_is_no_structure_is_refused(n_slots, sources):
    with pytest.raises(InvalidInputError, match="structure"):
        SharedStructure(n_slots, sources)


def test_json_and_back_changes_nothing():
    assert read_structure(write_structure(CUBE, ARCUBES), ARCUBES, "here") == CUBE


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"registers": 1}, "here.registers: 1; expected a whole number of at least 2"),
        ({"registers": 1000}, "here.registers: 1000; expected at most 64"),
        ({"sources": {}}, "here.sources: key 'flip' is missing"),
        (
            {"sources": {"flip": [0, 1], "left": [1, 0], "right": [1, 1]}},
            r"here.sources.right: \[1, 1\]; expected a",
        ),
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
