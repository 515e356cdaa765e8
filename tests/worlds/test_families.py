import math

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.worlds.arcube import SUCCESSORS
from atg_fg.worlds.families import (
    FAMILIES,
    cubes_with_repeated_tags,
    half_and_half,
    hexagonal_prisms,
    lid_boxes,
    mixed_kinds,
    random_atgs,
    ring_locks,
)

FLIP, LEFT, RIGHT = range(3)


def successor(thing, state, action):
    return int(thing.mechanism.successors[state, action, 0])


@pytest.mark.parametrize("name", FAMILIES)
class TestEveryFamily:
    def test_its_objects_all_look_different(self, name):
        family = FAMILIES[name](40, 1)
        assert len({thing.appearance for thing in family.objects}) == len(family.objects) == 40

    def test_it_is_the_same_by_the_same_seed_only(self, name):
        first, again, other = (
            [thing.appearance for thing in FAMILIES[name](6, seed).objects] for seed in (1, 1, 2)
        )  # fmt: skip
        assert first == again != other

    def test_the_robot_can_take_its_size_for_granted(self, name):
        family = FAMILIES[name](9, 3)
        assumptions = family.assumptions
        assert assumptions.n_objects == 9
        assert assumptions.n_aspects <= len(assumptions.alphabet)
        for thing in family.objects:
            assert thing.n_aspects <= assumptions.n_aspects
            for pattern in thing.patterns:
                assert assumptions.alphabet.check_pattern(pattern) == pattern

    @pytest.mark.parametrize("n", [0, -1, 2.5, "3", True])
    def test_a_number_of_objects_that_is_none_is_refused(self, name, n):
        with pytest.raises(InvalidInputError, match="objects: "):
            FAMILIES[name](n, 0)

    @pytest.mark.parametrize("seed", [-1, None, 0.5])
    def test_a_seed_that_is_none_is_refused(self, name, seed):
        with pytest.raises(InvalidInputError, match="objects_seed"):
            FAMILIES[name](3, seed)


def turned(axis, degrees):
    """The rotation about an axis, anticlockwise as seen from its tip."""
    cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    rotation = np.eye(3)
    rotation[a, a] = rotation[b, b] = cosine
    rotation[a, b], rotation[b, a] = -sine, sine
    return rotation


class TestPrisms:
    def test_a_prism_turns_as_a_body_does(self):
        # x points to the right, y away from the robot, z up; sides run anticlockwise around end 0, which is on top.
        prism = hexagonal_prisms(1, 0).objects[0]
        angles = np.radians(-90 + 60 * np.arange(6))
        sides = np.stack((np.cos(angles), np.sin(angles), np.zeros(6)), axis=1)
        normals = np.concatenate((sides, [[0, 0, 1], [0, 0, -1]]))
        tags = self.tags(prism)
        rng = np.random.default_rng(0)
        state, rotation = 0, np.eye(3)
        standing = True
        for action in rng.integers(3, size=400):
            state = successor(prism, state, action)
            if action == FLIP:
                rotation, standing = turned(0, 90) @ rotation, not standing
            else:
                # Left brings to the front, or on top, what is at the left of it.
                sign = 1 if action == LEFT else -1
                rotation = (turned(2, 60 * sign) if standing else turned(1, 60 * sign)) @ rotation
            now = normals @ rotation.T
            front, top = (int((now @ np.array(direction)).argmax()) for direction in ([0, -1, 0], [0, 0, 1]))
            assert prism.patterns[state] == (tags[front], tags[top])

    @staticmethod
    def tags(prism):
        """Tags of the six sides and two ends, read off by turning the prism on from state 0."""
        state, sides = 0, []
        for _ in range(6):
            sides.append(prism.patterns[state][0])
            state = successor(prism, state, RIGHT)
        lying = successor(prism, 0, FLIP)
        upside_down = successor(prism, lying, FLIP)
        return [*sides, prism.patterns[0][1], prism.patterns[upside_down][1]]

    def test_it_has_24_aspects_12_of_them_standing(self):
        prism = hexagonal_prisms(1, 0).objects[0]
        ends = {prism.patterns[state][1] for state in range(24)} & {self.tags(prism)[6], self.tags(prism)[7]}
        assert prism.n_aspects == prism.mechanism.n_states == 24
        assert sum(pattern[1] in ends for pattern in prism.patterns) == 12

    def test_left_and_right_undo_each_other_and_four_flips_are_none(self):
        prism = hexagonal_prisms(1, 0).objects[0]
        for state in range(24):
            assert successor(prism, successor(prism, state, LEFT), RIGHT) == state
            flipped = state
            for _ in range(4):
                flipped = successor(prism, flipped, FLIP)
            assert flipped == state

    def test_there_must_be_symbols_enough(self):
        with pytest.raises(InvalidInputError, match="n_symbols: 7; expected a whole number of at least 8"):
            hexagonal_prisms(1, 0, n_symbols=7)


class TestLocks:
    @pytest.mark.parametrize(("n_rings", "n_states"), [(2, 18), (3, 81)])
    def test_a_lock_has_its_states_and_each_shows_another_pattern(self, n_rings, n_states):
        family = ring_locks(2, 0, n_rings=n_rings)
        assert {thing.mechanism.n_states for thing in family.objects} == {n_states}
        assert family.assumptions.n_aspects == n_states
        assert len(family.alphabet.slots) == n_rings

    def test_its_actions_swap_the_rings_and_turn_one(self):
        lock = ring_locks(1, 0).objects[0]
        for state, (left, right) in enumerate(lock.patterns):
            swap, turn_left, turn_right = (lock.patterns[successor(lock, state, action)] for action in range(3))
            assert swap == (right, left)
            assert (turn_left[1], turn_right[0]) == (right, left)
            assert left != turn_left[0]
            assert right != turn_right[1]
            thrice = state
            for _ in range(3):
                thrice = successor(lock, thrice, 1)
            assert thrice == state

    @pytest.mark.parametrize("n_rings", [0, 1, 4, "2"])
    def test_another_number_of_rings_is_refused(self, n_rings):
        with pytest.raises(InvalidInputError, match=r"n_rings: .*; expected 2 or 3"):
            ring_locks(1, 0, n_rings=n_rings)

    def test_more_locks_than_there_are_are_refused(self):
        assert len(ring_locks(40, 0, n_symbols=6).objects) == 40  # 6! ways to put the symbols, 18 of them the same lock
        with pytest.raises(InvalidInputError, match=r"n_objects: 41; expected fewer, .* found only 40"):
            ring_locks(41, 0, n_symbols=6)


class TestBoxes:
    def test_the_lid_comes_off_once_and_for_all_and_shows_what_is_inside(self):
        box = lid_boxes(1, 0).objects[0]
        lid, inside = box.patterns[0][2], box.patterns[successor(box, 0, 0)][2]
        assert lid != inside
        shut = [state for state, pattern in enumerate(box.patterns) if pattern[2] == lid]
        opened = [state for state, pattern in enumerate(box.patterns) if pattern[2] == inside]
        assert (len(shut), len(opened)) == (4, 4)
        for state in shut:
            front, right, _ = box.patterns[state]
            assert box.patterns[successor(box, state, 0)] == (front, right, inside)
        for state in opened:
            assert successor(box, state, 0) == state
            assert {successor(box, state, action) for action in range(3)} <= set(opened)

    def test_it_turns_by_a_wall_whether_it_is_open_or_not(self):
        box = lid_boxes(1, 0).objects[0]
        for state, (front, right, top) in enumerate(box.patterns):
            at_right, at_left = (box.patterns[successor(box, state, action)] for action in (2, 1))
            assert (at_right[0], at_right[2]) == (right, top)
            assert (at_left[1], at_left[2]) == (front, top)


class TestRandomGraphs:
    @pytest.mark.parametrize("n_slots", [1, 2, 3])
    def test_patterns_are_unique_on_an_object_in_any_number_of_slots(self, n_slots):
        family = random_atgs(5, 0, n_aspects=7, n_slots=n_slots, n_symbols=8)
        assert len(family.alphabet.slots) == n_slots
        assert all(thing.n_aspects == thing.mechanism.n_states == 7 for thing in family.objects)

    def test_successors_of_an_action_are_different_and_probabilities_drawn(self):
        table = random_atgs(1, 0, n_successors=4).objects[0].mechanism
        assert table.successors.shape == table.probabilities.shape == (24, 3, 4)
        assert all(len(set(row)) == 4 for row in table.successors.reshape(-1, 4).tolist())
        assert len(set(table.probabilities.ravel().tolist())) == table.probabilities.size

    def test_a_larger_concentration_makes_probabilities_more_alike(self):
        spreads = [
            random_atgs(1, 0, concentration=concentration).objects[0].mechanism.probabilities.std()
            for concentration in (0.1, 1.0, 100.0)
        ]
        assert spreads == sorted(spreads, reverse=True)

    def test_one_successor_makes_it_deterministic(self):
        thing = random_atgs(1, 0, n_successors=1).objects[0]
        assert thing.mechanism.probabilities.tolist() == np.ones((24, 3, 1)).tolist()

    def test_objects_share_nothing(self):
        first, second = random_atgs(2, 0).objects
        assert (first.mechanism.successors != second.mechanism.successors).mean() > 0.8

    @pytest.mark.parametrize(
        ("options", "message"),
        [
            ({"n_slots": 4}, "n_slots: 4; expected 1, 2 or 3"),
            ({"n_slots": 1}, "n_aspects: 24; expected a whole number from 1 to 12"),
            ({"n_aspects": 0}, "n_aspects: 0; expected a whole number from 1 to 132"),
            ({"n_symbols": 1}, "n_symbols: 1; expected a whole number of at least 2"),
            ({"n_successors": 0}, "n_successors: 0; expected a whole number from 1 to 24"),
            ({"n_successors": 25}, "n_successors: 25; expected a whole number from 1 to 24"),
            ({"concentration": 0.0}, "concentration: 0.0; expected a finite number from 1e-06"),
            ({"concentration": float("nan")}, "concentration: nan"),
            ({"concentration": float("inf")}, "concentration: inf"),
            ({"concentration": "1"}, "concentration: '1'"),
        ],
    )
    def test_bad_options_are_refused(self, options, message):
        with pytest.raises(InvalidInputError, match=message):
            random_atgs(2, 0, **options)


class TestCubes:
    @staticmethod
    def is_cube(thing):
        return thing.mechanism.successors[..., 0].tolist() == [list(row) for row in SUCCESSORS]

    @pytest.mark.parametrize(("n", "n_cubes"), [(2, 1), (7, 4), (10, 5)])
    def test_half_of_the_objects_are_cubes(self, n, n_cubes):
        family = half_and_half(n, 0)
        assert sum(map(self.is_cube, family.objects)) == n_cubes
        assert family.assumptions.n_aspects == 24

    @pytest.mark.parametrize(
        ("n", "shares", "counts"),
        [
            (100, {}, [34, 33, 33]),
            (8, {"cubes": 0.5, "prisms": 0.25, "locks": 0.25}, [4, 2, 2]),
            (7, {"cubes": 0, "prisms": 1, "locks": 0.4}, [0, 5, 2]),
            (1, {}, [1, 0, 0]),
        ],
    )
    def test_kinds_are_mixed_by_their_shares(self, n, shares, counts):
        family = mixed_kinds(n, 0, **shares)
        n_cubes, n_prisms, n_locks = counts
        assert [*map(self.is_cube, family.objects)] == [True] * n_cubes + [False] * (n - n_cubes)
        assert [thing.n_aspects for thing in family.objects] == [24] * (n_cubes + n_prisms) + [18] * n_locks
        assert len({thing.appearance for thing in family.objects}) == n

    @pytest.mark.parametrize("shares", [{"cubes": 0, "prisms": 0, "locks": 0}, {"cubes": -0.1}, {"locks": 1.1}])
    def test_shares_of_no_kind_are_refused(self, shares):
        with pytest.raises(InvalidInputError, match=r"cubes|locks"):
            mixed_kinds(10, 0, **shares)

    def test_one_object_has_no_halves(self):
        with pytest.raises(InvalidInputError, match="n_objects: 1; expected a whole number from 2 to 100000"):
            half_and_half(1, 0)

    @pytest.mark.parametrize(("share", "n_repeating"), [(0.0, 0), (1 / 3, 4), (1.0, 12)])
    def test_a_share_of_the_cubes_has_a_tag_twice(self, share, n_repeating):
        family = cubes_with_repeated_tags(12, 0, share=share)
        assert all(map(self.is_cube, family.objects))
        assert [thing.n_aspects for thing in family.objects] == [16] * n_repeating + [24] * (12 - n_repeating)
        assert family.assumptions.n_aspects == (16 if share == 1 else 24)

    @pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
    def test_a_share_that_is_none_is_refused(self, share):
        with pytest.raises(InvalidInputError, match="share"):
            cubes_with_repeated_tags(12, 0, share=share)
