from itertools import pairwise
from math import sqrt

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.patterns import MISSING, PatternAlphabet
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.experiments.trial import check_world_fits
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.arcube_world import ARcubeWorld
from atg_fg.worlds.base import symbols_of
from atg_fg.worlds.finite_objects import FiniteObject, Mechanism, ObjectFamily
from atg_fg.worlds.object_world import ObjectWorld, make_object_world
from atg_fg.worlds.registry import (
    ARCUBE_WORLDS,
    WORLDS,
    assumptions_of,
    check_arcube_world,
    make_world,
    make_world_with,
)
from tests.small import one_slot

OBJECT_WORLDS = [name for name, place in WORLDS.items() if place.startswith("atg_fg") and name not in ARCUBE_WORLDS]
NOISE = {"slip": 0.2, "wrong": 0.2, "missing": 0.3}
N_STEPS = 2000


def episode(world, seed, n_steps=30):
    rng = np.random.default_rng(seed)
    observation, info = world.reset(seed=seed)
    course = [(tuple(observation.tolist()), info)]
    for _ in range(n_steps):
        observation, _, _, _, info = world.step(np.int64(rng.integers(world.action_space.n)))
        course.append((tuple(observation.tolist()), info))
    return course


def frequent(count, n, probability):
    """Within five standard deviations of a binomial."""
    return abs(count - n * probability) <= 5 * sqrt(n * probability * (1 - probability))


@pytest.mark.parametrize("name", OBJECT_WORLDS)
class TestEveryWorld:
    @pytest.mark.parametrize("noise", [{}, NOISE])
    def test_gymnasium_finds_nothing_wrong_with_it(self, name, noise):
        check_env(make_world(name, n_objects=4, **noise).unwrapped)

    def test_it_is_found_by_its_registered_name_too(self, name):
        world = gymnasium.make(WORLDS[name], n_objects=2).unwrapped
        assert isinstance(world, ObjectWorld)
        assert len(world.family.objects) == 2

    @pytest.mark.parametrize("noise", [{}, NOISE])
    def test_the_same_seed_gives_the_same_episode_and_another_seed_another(self, name, noise):
        world = make_world(name, n_objects=5, **noise)
        first = episode(world, 5)
        assert episode(make_world(name, n_objects=5, **noise), 5) == episode(world, 5) == first
        assert episode(world, 6) != first

    def test_without_noise_it_shows_what_is_there(self, name):
        world = make_world(name, n_objects=3)
        for observation, info in episode(world, 0):
            thing = world.unwrapped.family.objects[info["object"]]
            assert observation == info["pattern"] == thing.patterns[info["state"]]
            assert not info["slipped"]

    def test_a_reset_can_set_object_and_state(self, name):
        world = make_world(name, n_objects=3)
        for state in (0, 5):
            _, info = world.reset(options={"object": 1, "state": state})
            assert (info["object"], info["state"]) == (1, state)

    def test_a_reset_option_that_is_none_is_refused(self, name):
        world = make_world(name, n_objects=3)
        for options in ({"object": 3}, {"state": -1}, {"state": 1000}, {"object": "0"}):
            with pytest.raises(InvalidInputError, match="reset option"):
                world.reset(options=options)
        with pytest.raises(UnknownNameError, match="object, state"):
            world.reset(options={"orientation": 1})

    def test_an_action_that_slips_changes_nothing(self, name):
        world = make_world(name, n_objects=3, slip=0.5)
        truths = [info for _, info in episode(world, 3, N_STEPS)]
        for before, now in pairwise(truths):
            assert not now["slipped"] or now["state"] == before["state"]
        assert frequent(sum(info["slipped"] for info in truths[1:]), N_STEPS, 0.5)

    def test_looks_fail_as_often_as_asked(self, name):
        world = make_world(name, n_objects=3, wrong=0.5)
        n_patterns = len(world.unwrapped.family.alphabet)
        course = episode(world, 4, N_STEPS)
        differing = sum(observation != info["pattern"] for observation, info in course)
        # A detector's wrong label is always another one; other worlds draw from all patterns.
        assert frequent(differing, len(course), 0.5 if name == "detector" else 0.5 * (1 - 1 / n_patterns))
        course = episode(make_world(name, n_objects=3, missing=0.5), 4, N_STEPS)
        absent = np.array([[symbol == MISSING for symbol in observation] for observation, _ in course])
        for slot in range(absent.shape[1]):
            assert frequent(int(absent[:, slot].sum()), len(course), 0.5)

    def test_it_says_what_to_take_for_granted(self, name):
        world = make_world_with(name, 8, 1)
        assumptions = assumptions_of(world, 100)
        assert assumptions.n_objects == 8
        check_world_fits(world, assumptions)

    def test_objects_are_those_of_the_seed(self, name):
        appearances = [
            [thing.appearance for thing in make_world_with(name, 3, seed).unwrapped.family.objects]
            for seed in (1, 1, 2)
        ]
        assert appearances[0] == appearances[1] != appearances[2]

    def test_recognition_works_end_to_end(self, name):
        plan = TestPlan(world=name, engine="bayes-filter", n_trials=12, n_actions=6, n_objects=4)
        records = []
        result = run_test(plan, 0, on_trial=lambda _, record: records.append(record))
        assert result == run_test(plan, 0)
        assert result.success[0] >= 2
        assert all(record.assumptions.n_objects == 4 for record in records)

    def test_an_option_it_does_not_know_is_refused(self, name):
        # To the mixed world cubes are a share of its objects.
        for options in ({"magic": 1}, *([] if name == "mixed" else [{"cubes": make_arcubes(2, 0)}])):
            with pytest.raises(
                InvalidInputError, match=f"world '{name}': option '{next(iter(options))}': unknown; expected"
            ):
                make_world(name, **options)

    @pytest.mark.parametrize("option", ["slip", "wrong", "missing"])
    def test_a_noise_that_is_no_probability_is_refused(self, name, option):
        with pytest.raises(InvalidInputError, match=f"{option}: 1.5; expected a probability"):
            make_world(name, n_objects=2, **{option: 1.5})

    def test_it_is_no_world_of_arcubes(self, name):
        with pytest.raises(InvalidInputError, match=f"--world: '{name}'; expected a world of ARcubes: ideal, rendered"):
            check_arcube_world("--world", name)


def test_patterns_have_one_two_or_three_slots():
    slots = {name: len(symbols_of(make_world(name, n_objects=2).observation_space)) for name in OBJECT_WORLDS}
    assert (slots["prism"], slots["lock"], slots["lid-box"]) == (2, 2, 3)
    one = make_world("random-atg", n_objects=2, n_slots=1, n_aspects=12)
    assert one.observation_space.shape == (1,)
    check_env(one.unwrapped)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("random-atg", {"n_slots": 1, "n_aspects": 12, "n_successors": 1}),
        ("random-atg", {"n_slots": 3}),
        ("lock", {"n_rings": 3}),
    ],
)
def test_recognition_works_in_one_slot_and_in_three(name, options):
    plan = TestPlan(world=name, world_options=options, engine="bayes-filter", n_trials=8, n_actions=4, n_objects=3)
    assert run_test(plan, 1).identification[1] == 8


def test_a_box_that_was_opened_stays_open():
    world = make_world("lid-box", n_objects=1)
    world.reset(seed=0, options={"object": 0, "state": 0})
    inside = int(world.step(np.int64(0))[0][2])
    rng = np.random.default_rng(0)
    assert {int(world.step(np.int64(rng.integers(3)))[0][2]) for _ in range(100)} == {inside}


def test_a_random_edge_is_taken_as_often_as_it_says():
    world = make_world("random-atg", n_objects=1)
    mechanism = world.unwrapped.family.objects[0].mechanism
    world.reset(seed=0)
    reached = []
    for _ in range(N_STEPS):
        world.reset(options={"object": 0, "state": 2})
        reached.append(world.step(np.int64(1))[4]["state"])
    branches = mechanism.successors[2, 1].tolist()
    assert set(reached) <= set(branches)
    for successor, probability in zip(branches, mechanism.probabilities[2, 1], strict=True):
        assert frequent(reached.count(successor), N_STEPS, probability)


def test_objects_of_ones_own_make_a_world():
    coin = FiniteObject(Mechanism.deterministic([[1], [0]]), ((0,), (1,)))
    world = ObjectWorld(ObjectFamily(("push",), PatternAlphabet(("front",), 2), (coin,)))
    check_env(world, skip_render_check=True)
    assert world.assumptions == one_slot(1, 2, 2)


def test_a_family_that_is_not_there_is_refused():
    with pytest.raises(UnknownNameError, match="family of objects: unknown name 'moon'; expected one of: half"):
        make_object_world("moon")


class TestAssumptionsOfAWorld:
    def test_a_world_without_any_is_of_arcubes(self):
        assert assumptions_of(ARcubeWorld(make_arcubes(3, 0)), 50) == arcube_assumptions(50)
        assert assumptions_of(make_world("ideal"), 100) == arcube_assumptions()

    def test_a_users_world_can_say_its_own_through_any_wrapper(self):
        world = make_world("ideal")
        world.unwrapped.assumptions = Assumptions(7, 12, ("a", "b", "c"), PatternAlphabet(("x", "y"), 12))
        assert assumptions_of(world, 100).n_objects == 7

    def test_anything_else_is_refused(self):
        world = make_world("ideal")
        world.unwrapped.assumptions = {"n_objects": 7}
        with pytest.raises(InvalidInputError, match=r"world's assumptions: .*; expected an atg_fg"):
            assumptions_of(world, 100)

    def test_a_memory_of_another_world_is_refused_though_sizes_are_the_same(self):
        with pytest.raises(InvalidInputError, match="actions swap, turn-left, turn-right; expected those remembered"):
            check_world_fits(make_world("lock", n_objects=2), arcube_assumptions())
