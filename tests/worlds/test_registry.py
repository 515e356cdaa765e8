from contextlib import closing
from itertools import pairwise
from math import sqrt

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv
from gymnasium.wrappers import (
    FlattenObservation,
    FrameStackObservation,
    RecordEpisodeStatistics,
    TimeLimit,
)

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import AtgError, InvalidInputError, UnknownNameError
from atg_fg.core.patterns import MISSING, Evidence
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern
from atg_fg.worlds.arcube_world import ARcubeWorld
from atg_fg.worlds.base import detection_of
from atg_fg.worlds.registry import WORLDS, make_world, make_world_with

CUBES = make_arcubes(3, seed=1)
N_STEPS = 4000


def episode(world: ARcubeWorld, seed: int, n_steps: int = 30) -> list[tuple]:
    rng = np.random.default_rng(seed)
    observation, info = world.reset(seed=seed)
    course = [(tuple(observation.tolist()), info)]
    for _ in range(n_steps):
        observation, _, _, _, info = world.step(np.int64(rng.integers(3)))
        course.append((tuple(observation.tolist()), info))
    return course


def frequent(count: int, n: int, probability: float) -> bool:
    """Within five standard deviations of a binomial."""
    return abs(count - n * probability) <= 5 * sqrt(n * probability * (1 - probability))


@pytest.mark.parametrize("noise", [{}, {"slip": 0.2, "wrong": 0.2, "missing": 0.3}])
def test_gymnasium_finds_nothing_wrong_with_the_world(noise: dict) -> None:
    check_env(ARcubeWorld(CUBES, **noise), skip_render_check=True)
    check_env(make_world("ideal", cubes=CUBES, **noise).unwrapped)


def test_the_ideal_world_is_found_by_its_short_and_by_its_registered_name() -> None:
    for name in ("ideal", "atg_fg:atg_fg/ARcube-v0"):
        world = make_world(name)
        assert isinstance(world.unwrapped, ARcubeWorld)
        assert len(world.unwrapped.cubes) == 100
        assert world.unwrapped.cubes == make_arcubes(100, seed=0)
    assert isinstance(gymnasium.make("atg_fg/ARcube-v0").unwrapped, ARcubeWorld)


#: All that need no simulator; those of ``sim`` have the same space, which their tests say.
IDS = sorted(name.partition(":")[2] for name in WORLDS.values() if name.startswith("atg_fg"))


@pytest.mark.parametrize("id_", IDS)
def test_environments_can_be_made_as_vectors_and_wrapped(id_: str) -> None:
    def wrapped() -> gymnasium.Env:
        made = RecordEpisodeStatistics(TimeLimit(gymnasium.make(id_, missing=0.3), 3))
        return FrameStackObservation(FlattenObservation(made), 2)

    for make in (lambda: gymnasium.make_vec(id_, num_envs=2, missing=0.3), lambda: SyncVectorEnv([wrapped, wrapped])):
        with closing(make()) as worlds:
            observations, _ = worlds.reset(seed=0)
            for _ in range(7):
                assert worlds.observation_space.contains(observations)
                observations, *_ = worlds.step(worlds.action_space.sample())
    assert observations.shape[:2] == (2, 2)


def test_environments_run_beside_one_another() -> None:
    with closing(gymnasium.make_vec(IDS[0], num_envs=2, vectorization_mode="async", missing=0.3)) as worlds:
        worlds.reset(seed=0)
        assert worlds.step(np.array([0, 1]))[0].shape == (2, 2)


def test_an_unknown_world_is_refused_with_the_names_there_are() -> None:
    with pytest.raises(UnknownNameError, match="ideal"):
        make_world("moon")
    with pytest.raises(InvalidInputError, match="cannot be made"):
        make_world("atg_fg:atg_fg/Moon-v0")
    with pytest.raises(InvalidInputError, match="cannot be made"):
        make_world("no_such_module:moon/Moon-v0")


@pytest.mark.parametrize("name", [name for name, place in WORLDS.items() if place.startswith("atg_fg")])
def test_an_option_that_a_world_does_not_know_is_named_and_no_other(name: str) -> None:
    with pytest.raises(InvalidInputError) as error:
        make_world_with(name, 100, 0, urdf="robot.urdf")
    assert str(error.value) == f"world {name!r}: option 'urdf': unknown; expected an option of the world's own"


@pytest.mark.parametrize("name", [":", "a:b:c", ".:x", "..:y", "a:", ":x", "a b:c", "\0:x", "1:2", "atg_fg:atg_fg/A:B"])
def test_a_name_of_no_form_is_refused_before_anything_is_imported(name: str) -> None:
    with pytest.raises(InvalidInputError, match="cannot be made"):
        make_world(name)


#: What ``json.loads`` can make of an option's text.
ODD = (
    None,
    True,
    "x",
    "",
    [],
    [1],
    {},
    {"a": 1},
    float("inf"),
    float("nan"),
    10**400,
    -1,
    1e308,
    10**12,
    "\ud800",
    2.5,
)


@pytest.mark.filterwarnings("ignore:.*render_mode")  # Gymnasium's own, of modes that a world does not know
@pytest.mark.parametrize("name", [name for name, place in WORLDS.items() if place.startswith("atg_fg")])
def test_an_option_of_any_value_is_taken_or_refused_in_one_line(name: str) -> None:
    own = ("slip", "n_symbols", "n_rings", "n_aspects", "n_slots", "n_successors", "concentration", "share")
    given = ("cubes", "n_objects", "objects_seed", "render_mode", "name", "seed", "id", "max_episode_steps", "family")
    for option in (*own, *given, "disable_env_checker", "additional_wrappers", "self", "options", "no_such"):
        for value in ODD:
            try:
                world = make_world_with(name, 4, 0, **{option: value})
            except AtgError as error:
                assert "\n" not in str(error)  # noqa: PT017
            else:
                world.reset(seed=0)
                world.step(np.int64(0))
                world.close()


def test_a_fault_in_a_world_of_the_users_own_is_shown_as_it_is() -> None:
    gymnasium.register(id="faulty/World-v0", entry_point=f"{__name__}:faulty_world")
    with pytest.raises(ZeroDivisionError):
        make_world(f"{__name__}:faulty/World-v0")


def faulty_world() -> None:
    raise ZeroDivisionError


@pytest.mark.parametrize("option", ["slip", "wrong", "missing"])
@pytest.mark.parametrize("value", [-0.1, 1.1, float("nan")])
def test_a_noise_that_is_no_probability_is_refused(option: str, value: float) -> None:
    with pytest.raises(InvalidInputError, match=option):
        ARcubeWorld(CUBES, **{option: value})


def test_a_world_without_cubes_is_refused() -> None:
    with pytest.raises(InvalidInputError, match="cubes"):
        ARcubeWorld([])


@pytest.mark.parametrize("orientation", range(24))
@pytest.mark.parametrize("action", range(3))
def test_without_noise_the_cube_turns_as_told_and_shows_what_is_there(orientation: int, action: int) -> None:
    world = ARcubeWorld(CUBES)
    observation, info = world.reset(options={"object": 2, "orientation": orientation})
    assert tuple(observation) == shown_pattern(CUBES[2], orientation) == info["pattern"]
    assert (info["object"], info["orientation"]) == (2, orientation)
    observation, reward, terminated, truncated, info = world.step(np.int64(action))
    turned = SUCCESSORS[orientation][action]
    assert tuple(observation) == shown_pattern(CUBES[2], turned) == info["pattern"]
    assert (info["object"], info["orientation"], info["slipped"]) == (2, turned, False)
    assert (reward, terminated, truncated) == (0.0, False, False)


def test_flip_left_and_right_show_in_front_what_was_on_top_left_and_right() -> None:
    front, back, left, right, top, _ = CUBES[0]
    world = ARcubeWorld(CUBES)
    for action, shown in enumerate([(top, back), (left, top), (right, top)]):
        observation, _ = world.reset(options={"object": 0, "orientation": 0})
        assert tuple(observation) == (front, top)
        assert tuple(world.step(np.int64(action))[0]) == shown


@pytest.mark.parametrize("noise", [{}, {"slip": 0.3, "wrong": 0.3, "missing": 0.3}])
def test_the_same_seed_gives_the_same_episode_and_another_seed_another(noise: dict) -> None:
    world = ARcubeWorld(CUBES, **noise)
    first = episode(world, seed=5)
    assert episode(world, seed=5) == first
    assert episode(ARcubeWorld(CUBES, **noise), seed=5) == first
    assert episode(world, seed=6) != first


def test_objects_and_orientations_are_drawn_uniformly() -> None:
    world = ARcubeWorld(CUBES)
    world.reset(seed=0)
    truths = [world.reset()[1] for _ in range(N_STEPS)]
    for i in range(3):
        assert frequent(sum(truth["object"] == i for truth in truths), N_STEPS, 1 / 3)
    for orientation in range(24):
        assert frequent(sum(truth["orientation"] == orientation for truth in truths), N_STEPS, 1 / 24)


@pytest.mark.parametrize("slip", [0.05, 0.5, 1.0])
def test_an_action_slips_as_often_as_asked_and_then_the_cube_stays(slip: float) -> None:
    course = episode(ARcubeWorld(CUBES, slip=slip), 3, N_STEPS)
    truths = [info for _, info in course]
    slipped = [now["slipped"] for now in truths[1:]]
    stayed = [now["orientation"] == before["orientation"] for before, now in pairwise(truths)]
    assert slipped == stayed  # each of the three actions turns the cube
    assert frequent(sum(slipped), N_STEPS, slip)


@pytest.mark.parametrize("wrong", [0.05, 0.5, 1.0])
def test_a_look_is_replaced_as_often_as_asked_by_any_pattern(wrong: float) -> None:
    course = episode(ARcubeWorld(CUBES, wrong=wrong), 4, N_STEPS)
    differs = [observation for observation, info in course if observation != info["pattern"]]
    assert frequent(len(differs), len(course), wrong * 131 / 132)  # a uniform pattern may be the right one
    assert {len(set(observation)) for observation in differs} == {2}
    if wrong == 1.0:
        assert len({observation for observation, _ in course}) == 132


@pytest.mark.parametrize("missing", [0.05, 0.5, 1.0])
def test_a_symbol_is_missing_as_often_as_asked_in_each_slot_alone(missing: float) -> None:
    course = episode(ARcubeWorld(CUBES, missing=missing), 5, N_STEPS)
    absent = np.array([[symbol == MISSING for symbol in observation] for observation, _ in course])
    for slot in range(2):
        assert frequent(int(absent[:, slot].sum()), len(course), missing)
    assert frequent(int(absent.all(axis=1).sum()), len(course), missing**2)
    for observation, info in course:
        assert all(symbol in (MISSING, truth) for symbol, truth in zip(observation, info["pattern"], strict=True))


def test_noise_does_not_touch_the_truth() -> None:
    for observation, info in episode(ARcubeWorld(CUBES, wrong=1.0, missing=0.5), seed=6):
        assert info["pattern"] == shown_pattern(CUBES[info["object"]], info["orientation"])
        assert all(MISSING <= symbol < 12 for symbol in observation)


@pytest.mark.parametrize("action", [-1, 3, 0.5, None])
def test_an_action_that_is_not_there_is_refused(action: object) -> None:
    world = ARcubeWorld(CUBES)
    _, before = world.reset(seed=0)
    with pytest.raises(InvalidInputError, match="action"):
        world.step(action)
    assert world.orientation == before["orientation"]


@pytest.mark.parametrize("options", [{"object": 3}, {"object": -1}, {"orientation": 24}, {"object": "0"}])
def test_a_reset_option_out_of_range_is_refused(options: dict) -> None:
    with pytest.raises(InvalidInputError, match="reset option"):
        ARcubeWorld(CUBES).reset(options=options)


def test_an_unknown_reset_option_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="object, orientation"):
        ARcubeWorld(CUBES).reset(options={"cube": 1})


@pytest.mark.parametrize(
    ("observation", "detection"),
    [([3, 4], (3, 4)), ([MISSING, 4], (None, 4)), ([0, MISSING], (0, None)), ([MISSING, MISSING], (None, None))],
)
def test_an_observation_is_a_detection_the_model_takes(observation: list[int], detection: tuple) -> None:
    assert detection_of(np.array(observation)) == detection
    evidence = Evidence.of_detection(arcube_assumptions().alphabet, detection_of(np.array(observation)))
    assert (evidence.pattern is None) == (None in detection)
