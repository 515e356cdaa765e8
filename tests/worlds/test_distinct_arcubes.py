import itertools

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.worlds.arcube import SUCCESSORS, canonical, make_arcubes, shown_pattern
from atg_fg.worlds.distinct_arcubes import expected_actions, make_distinct_arcubes

CUBE = (0, 1, 2, 3, 4, 5)


def by_enumeration(cubes, depth=4):
    """The same by trying every plan on every state, without sharing any work."""

    def cost(states, depth):
        if len({cube for cube, _ in states}) < 2 or not depth:
            return len(states) if len({cube for cube, _ in states}) > 1 else 0
        totals = []
        for action in range(3):
            after = [(cube, SUCCESSORS[stands][action]) for cube, stands in states]
            groups = {}
            for cube, stands in after:
                groups.setdefault(shown_pattern(cubes[cube], stands), []).append((cube, stands))
            totals.append(len(states) + sum(cost(group, depth - 1) for group in groups.values()))
        return min(totals)

    states = list(itertools.product(range(len(cubes)), range(24)))
    groups = {}
    for cube, stands in states:
        groups.setdefault(shown_pattern(cubes[cube], stands), []).append((cube, stands))
    return sum(cost(group, depth) for group in groups.values()) / len(states)


def test_one_cube_and_cubes_without_a_common_view_need_no_action():
    assert expected_actions([CUBE]) == 0.0
    assert expected_actions([CUBE, (6, 7, 8, 9, 10, 11)]) == 0.0


def test_two_cubes_with_two_tags_exchanged_need_an_action_where_neither_is_seen():
    # Front and back are exchanged, so that views of left, right, top and bottom alone (8 of 24) are shown by both, and
    # an action at best shows front or back.
    cubes = [CUBE, (1, 0, 2, 3, 4, 5)]
    assert expected_actions(cubes) == by_enumeration(cubes)
    assert expected_actions(cubes) >= 8 / 24


@pytest.mark.parametrize("seed", range(4))
def test_plans_are_those_that_enumeration_finds(seed):
    cubes = make_arcubes(5, seed)
    assert expected_actions(cubes) == pytest.approx(by_enumeration(cubes))


def test_a_cube_twice_is_refused():
    with pytest.raises(InvalidInputError, match="cubes: two are the same but for how they stand"):
        expected_actions([CUBE, (4, 5, 2, 3, 1, 0)])


def test_where_there_are_tags_enough_no_two_cubes_share_one():
    cubes = make_distinct_arcubes(3, range(20, 40))
    assert len({tag for cube in cubes for tag in cube}) == 18
    assert expected_actions(cubes) == 0.0


@pytest.mark.parametrize("n", [2, 3, 4, 6])
def test_chosen_cubes_are_told_apart_sooner_than_any_of_ten_drawn_sets(n):
    chosen = make_distinct_arcubes(n, range(12))
    assert len({canonical(cube) for cube in chosen}) == n
    assert expected_actions(chosen) <= min(expected_actions(make_arcubes(n, seed)) for seed in range(10))


def test_the_same_seed_chooses_the_same_cubes():
    assert make_distinct_arcubes(4, range(12), 3) == make_distinct_arcubes(4, range(12), 3)


@pytest.mark.slow
def test_six_tags_make_thirty_cubes_and_no_more():
    cubes = make_distinct_arcubes(30, np.arange(6).tolist())
    assert len({canonical(cube) for cube in cubes}) == 30
    with pytest.raises(InvalidInputError, match="number of cubes: 31; expected at most 30, all that 6 tags make"):
        make_distinct_arcubes(31, range(6))


@pytest.mark.parametrize(
    ("n", "tags", "message"),
    [
        (1, range(5), "5 different ones; expected at least six"),
        (1, [1] * 6, "1 different"),
        (0, range(6), "at least 1"),
    ],
)
def test_what_makes_no_cubes_is_refused(n, tags, message):
    with pytest.raises(InvalidInputError, match=message):
        make_distinct_arcubes(n, tags)
