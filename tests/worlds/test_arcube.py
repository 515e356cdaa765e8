from collections import Counter
from itertools import product

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.worlds.arcube import (
    ACTION_SOURCES,
    BACK,
    BOTTOM,
    FRONT,
    LEFT,
    N_TAGS,
    ORIENTATIONS,
    RIGHT,
    SUCCESSORS,
    TOP,
    canonical,
    make_arcubes,
    shown_pattern,
)

FLIP, TURN_LEFT, TURN_RIGHT = range(3)
CUBE = (0, 1, 2, 3, 4, 5)  # front, back, left, right, top, bottom
everywhere = pytest.mark.parametrize("orientation", range(24))


def after(orientation: int, *actions: int) -> int:
    for action in actions:
        orientation = SUCCESSORS[orientation][action]
    return orientation


def parity(permutation: tuple[int, ...]) -> int:
    return sum(a > b for i, a in enumerate(permutation) for b in permutation[i + 1 :]) % 2


def test_the_actions_are_those_of_the_paper() -> None:
    assert tuple(ACTION_SOURCES) == ("flip", "left", "right")


def test_there_are_24_orientations_each_reached_and_no_mirror_image() -> None:
    assert len(set(ORIENTATIONS)) == 24
    assert ORIENTATIONS[0] == (FRONT, BACK, LEFT, RIGHT, TOP, BOTTOM)
    assert all(sorted(orientation) == list(range(6)) for orientation in ORIENTATIONS)
    opposite = {FRONT: BACK, BACK: FRONT, LEFT: RIGHT, RIGHT: LEFT, TOP: BOTTOM, BOTTOM: TOP}
    for faces in ORIENTATIONS:
        assert all(faces[opposite[place]] == opposite[faces[place]] for place in range(6))
    # Round the corner of front, left and top the faces go one way, and those of a mirror image the other.
    corners = {(faces[FRONT], faces[LEFT], faces[TOP]) for faces in ORIENTATIONS}
    assert len(corners) == 24
    assert not any((a, c, b) in corners for a, b, c in corners)


@everywhere
def test_flip_puts_the_top_face_in_front(orientation: int) -> None:
    before, now = ORIENTATIONS[orientation], ORIENTATIONS[after(orientation, FLIP)]
    assert now[FRONT] == before[TOP]
    assert now[BOTTOM] == before[FRONT]
    assert (now[LEFT], now[RIGHT]) == (before[LEFT], before[RIGHT])


@everywhere
def test_left_puts_the_left_face_in_front(orientation: int) -> None:
    before, now = ORIENTATIONS[orientation], ORIENTATIONS[after(orientation, TURN_LEFT)]
    assert now[FRONT] == before[LEFT]
    assert now[RIGHT] == before[FRONT]
    assert (now[TOP], now[BOTTOM]) == (before[TOP], before[BOTTOM])


@everywhere
def test_right_puts_the_right_face_in_front(orientation: int) -> None:
    before, now = ORIENTATIONS[orientation], ORIENTATIONS[after(orientation, TURN_RIGHT)]
    assert now[FRONT] == before[RIGHT]
    assert now[LEFT] == before[FRONT]
    assert (now[TOP], now[BOTTOM]) == (before[TOP], before[BOTTOM])


@everywhere
def test_turns_are_undone_as_turns_are(orientation: int) -> None:
    assert after(orientation, TURN_LEFT, TURN_RIGHT) == orientation
    for action in (FLIP, TURN_LEFT, TURN_RIGHT):
        assert after(orientation, action) != orientation
        assert after(orientation, action, action, action, action) == orientation


@pytest.mark.parametrize("action", [FLIP, TURN_LEFT, TURN_RIGHT])
def test_an_action_never_leads_to_one_orientation_from_two(action: int) -> None:
    assert sorted(row[action] for row in SUCCESSORS) == list(range(24))
    assert {parity(ORIENTATIONS[i]) != parity(ORIENTATIONS[row[action]]) for i, row in enumerate(SUCCESSORS)} == {True}


def test_a_cube_shows_its_front_and_its_top() -> None:
    assert shown_pattern((7, 1, 2, 3, 9, 5), 0) == (7, 9)
    assert shown_pattern((7, 1, 2, 3, 9, 5), after(0, FLIP)) == (9, 1)  # the back has come up
    assert shown_pattern((7, 1, 2, 3, 9, 5), after(0, TURN_LEFT)) == (2, 9)
    assert shown_pattern((7, 1, 2, 3, 9, 5), after(0, TURN_RIGHT)) == (3, 9)


def test_each_cube_has_24_different_patterns_and_never_two_opposite_tags() -> None:
    for cube in make_arcubes(100, seed=0):
        patterns = {shown_pattern(cube, orientation) for orientation in range(24)}
        opposite = {frozenset(cube[i : i + 2]) for i in (0, 2, 4)}
        expected = {p for p in product(cube, repeat=2) if p[0] != p[1] and frozenset(p) not in opposite}
        assert patterns == expected
        assert len(patterns) == 24


def test_turning_a_cube_does_not_make_it_another() -> None:
    for faces in ORIENTATIONS:
        turned = tuple(CUBE[face] for face in faces)
        assert canonical(turned) == canonical(CUBE)
    mirrored = (0, 1, 3, 2, 4, 5)
    assert canonical(mirrored) != canonical(CUBE)


@pytest.mark.parametrize("seed", range(5))
def test_made_cubes_are_distinct_up_to_rotation(seed: int) -> None:
    cubes = make_arcubes(100, seed)
    assert len({canonical(cube) for cube in cubes}) == len(cubes) == 100
    for cube in cubes:
        assert len(set(cube)) == 6
        assert set(cube) <= set(range(N_TAGS))


def test_many_cubes_are_distinct_and_use_every_tag() -> None:
    cubes = make_arcubes(2000, seed=3)
    assert len({canonical(cube) for cube in cubes}) == 2000
    assert Counter(tag for cube in cubes for tag in cube).keys() == set(range(N_TAGS))


def test_the_same_seed_makes_the_same_cubes_and_more_only_adds_to_them() -> None:
    assert make_arcubes(30, seed=7) == make_arcubes(30, seed=7)
    assert make_arcubes(30, seed=7) != make_arcubes(30, seed=8)
    assert make_arcubes(60, seed=7)[:30] == make_arcubes(30, seed=7)
    assert make_arcubes(0, seed=7) == ()


@pytest.mark.parametrize("n", [-1, 27_721])
def test_a_number_of_cubes_that_cannot_be_is_refused(n: int) -> None:
    with pytest.raises(InvalidInputError, match="0 to 27720"):
        make_arcubes(n, seed=0)
