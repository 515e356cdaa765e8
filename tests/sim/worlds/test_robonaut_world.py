import gc
import multiprocessing

import gymnasium
import numpy as np
import pybullet
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import MISSING
from atg_fg.engines import begin_trial
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.experiments.trial import check_world_fits, run_trial
from atg_fg.policies import EntropyPolicy
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import SUCCESSORS, rotation_of
from atg_fg.worlds.registry import make_world
from atg_fg.worlds.testing import check_world
from sim.bodies.cube import CUBE_CENTRE
from sim.vision.cube_pose import CubePose
from sim.worlds.domain_randomization import Circumstances, Condition
from sim.worlds.robonaut_arcube_world import RobonautARcubeWorld
from sim.worlds.robonaut_world import LARGEST_OFFSET

FLIP, LEFT, RIGHT = (np.int64(action) for action in range(3))


@pytest.fixture
def make():
    made = []

    def maker(**options):
        made.append(RobonautARcubeWorld(**options))
        return made[-1]

    yield maker
    for world in made:
        world.close()


@pytest.fixture(scope="module")
def world():
    made = RobonautARcubeWorld()
    yield made
    made.close()


def fingerprint(world, observation, info):
    """Everything of a step that can be compared bit for bit."""
    angles, velocities = world.scene.robot.state()
    position, rotation = world.scene.cube.pose()
    arrays = (observation, angles, velocities, position, rotation, world.frame)
    return [array.tobytes() for array in arrays], repr(info)


def history(world, seed, actions):
    observation, info = world.reset(seed=seed)
    prints = [fingerprint(world, observation, info)]
    for action in actions:
        observation, _, _, _, info = world.step(np.int64(action))
        prints.append(fingerprint(world, observation, info))
    return prints


@pytest.mark.parametrize("action", [FLIP, LEFT, RIGHT], ids=["flip", "left", "right"])
def test_an_action_brings_the_cube_to_the_next_orientation_and_the_camera_sees_it(world, action):
    _, before = world.reset(seed=int(action), options={"object": 2, "orientation": 5})
    observation, _, lost, truncated, info = world.step(action)
    assert info["orientation"] == SUCCESSORS[before["orientation"]][action]
    assert (info["right"], info["slipped"], lost, truncated) == (True, False, False, False)
    assert info["angle_error"] < 3
    assert info["position_error"] < 0.012
    assert 0 < info["peak_force"] < 400
    assert tuple(observation) == info["pattern"]
    exertion = world.controller.exertion
    assert exertion.velocity.max() <= 1
    assert exertion.effort.max() <= 1
    assert world.scene.self_contacts == 0


def test_the_world_keeps_gymnasiums_contract(make):
    world = make(render_mode="rgb_array")
    assert check_world(world, trials=1, steps=2) == 3


def test_its_spaces_are_those_of_the_ideal_world(world):
    ideal = make_world("ideal")
    assert (world.action_space, world.observation_space) == (ideal.action_space, ideal.observation_space)
    check_world_fits(world, arcube_assumptions())


def test_the_same_seed_presents_the_same_cube_as_in_the_ideal_world(world):
    for seed in (0, 1):
        _, here = world.reset(seed=seed)
        _, there = make_world("ideal").reset(seed=seed)
        assert [here[key] for key in ("object", "orientation", "pattern")] == [
            there[key] for key in ("object", "orientation", "pattern")
        ]


def test_a_trial_is_the_same_whatever_was_before_it(make):
    world = make(condition="worn")
    first = history(world, 4, [LEFT])
    history(world, 5, [FLIP])
    assert history(world, 4, [LEFT]) == first


# Its quicker twins are of the world with several stations, which is this one on rails.
@pytest.mark.slow
def test_a_trial_is_the_same_in_another_process():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply(_history_elsewhere, (3, [0]))
    assert there == _history_elsewhere(3, [0])


def _history_elsewhere(seed, actions):
    world = RobonautARcubeWorld()
    prints = history(world, seed, actions)
    world.close()
    return prints


@pytest.mark.slow
def test_a_state_that_was_kept_replays_bit_for_bit(make):
    world = make(condition="worn")
    world.reset(seed=1)
    kept = world.save()

    def go():
        observation, _, _, _, info = world.step(RIGHT)
        return fingerprint(world, observation, info)

    first = go()
    world.step(FLIP)
    world.restore(kept)
    assert go() == first
    world.restore(kept)
    assert go() == first


def test_a_state_of_another_trial_is_refused(world):
    world.reset(seed=0)
    kept = world.save()
    world.reset(seed=0)
    with pytest.raises(InvalidInputError, match="another trial"):
        world.restore(kept)


def test_a_cube_off_its_place_is_found_by_the_camera_and_brought_back(world):
    place = np.add(CUBE_CENTRE[:2], [0.9 * LARGEST_OFFSET, -0.9 * LARGEST_OFFSET])
    _, before = world.reset(seed=0, options={"position": tuple(place)})
    assert np.linalg.norm(np.subtract(before["position"][:2], place)) < 0.002
    _, _, _, _, info = world.step(FLIP)
    assert info["right"]
    assert info["position_error"] < 0.012


@pytest.mark.parametrize("place", [(0.8, 0.0), (0.42, 0.2), (np.nan, 0.0), (0.42,), "here", None])
def test_a_cube_beyond_reach_is_refused_before_anything_moves(world, place):
    with pytest.raises(InvalidInputError, match="reset option 'position'"):
        world.reset(options={"position": place})


def test_a_cube_that_leaves_the_table_ends_the_episode_as_lost(make):
    world = make()
    world.reset(seed=0)
    # As if somebody had pushed it: the robot sees nothing, acts, and the world says what has become of it.
    world.scene.cube.place(np.add(CUBE_CENTRE, [0.0, 0.5, 0.0]), rotation_of(0))
    observation, _, lost, truncated, info = world.step(FLIP)
    assert (lost, truncated, info["lost"], info["right"]) == (True, False, True, False)
    assert observation.tolist() == [MISSING, MISSING]
    with pytest.raises(InvalidInputError, match="lost; expected a reset"):
        world.step(FLIP)
    _, info = world.reset(seed=0)
    assert not info["lost"]


def test_a_cube_seen_where_the_hands_cannot_hold_it_is_lost(make):
    world = make()
    world.reset(seed=0)
    world.manipulator.look = lambda: CubePose(np.add(CUBE_CENTRE, [0.2, 0.0, 0.0]), 0.0)
    _, _, lost, _, info = world.step(LEFT)
    assert lost
    assert not info["right"]


def test_a_heavy_cube_slips_from_polished_pads(make):
    world = make()
    world.condition = Condition("slippery", (3.0, 3.0), (0.1, 0.1), (0.03, 0.03), 0.0, Circumstances().imaging)
    _, before = world.reset(seed=0)
    observation, _, lost, _, info = world.step(FLIP)
    assert not info["right"]
    assert not lost
    assert info["slipped"]
    assert info["orientation"] == before["orientation"]
    assert tuple(observation) == info["pattern"] == before["pattern"]


def test_pictures_are_of_the_sizes_they_should_be(make):
    world = make(render_mode="rgb_array", image_size=(160, 120))
    assert world.reset(seed=0)[1]["object"] >= 0
    assert world.render().shape == (360, 480, 3)
    for mode in ("head", "detections"):
        world.render_mode = mode
        assert world.render().shape == (120, 160, 3)
    world.render_mode = None
    assert world.render() is None


@pytest.mark.slow
def test_a_film_shows_the_action_once(make):
    world = make(render_mode="rgb_array_list")
    world.reset(seed=0)
    assert len(world.render()) <= 2
    world.step(FLIP)
    pictures = world.render()
    assert len(pictures) > 10
    assert pictures[0].shape == (360, 480, 3)
    moved = np.abs(pictures[0].astype(int) - pictures[len(pictures) // 2]).max(axis=2) > 30
    assert moved.mean() > 0.01
    assert world.render() == []


def test_filming_changes_nothing(make):
    assert history(make(render_mode="rgb_array_list"), 2, [FLIP]) == history(make(), 2, [FLIP])


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"condition": "new"}, UnknownNameError, "condition: unknown name 'new'; expected one of: nominal, worn"),
        ({"render_mode": "human"}, UnknownNameError, "render mode"),
        ({"image_size": (0, 10)}, InvalidInputError, "image_size"),
        ({"urdf": "nowhere.urdf"}, InvalidInputError, "nowhere.urdf: cannot be read as URDF"),
        ({"cubes": []}, InvalidInputError, "cubes"),
    ],
)
def test_bad_options_are_refused(options, error, message):
    with pytest.raises(error, match=message):
        RobonautARcubeWorld(**options)


@pytest.mark.parametrize("action", [3, -1, 0.5, None])
def test_only_the_three_actions_are_taken(world, action):
    world.reset(seed=0)
    with pytest.raises(InvalidInputError, match="action"):
        world.step(action)


def test_no_client_is_left_behind(make):
    def connected():
        gc.collect()
        return sum(bool(pybullet.isConnected(client)) for client in range(40))

    before = connected()
    world = make()
    for seed in range(3):
        world.reset(seed=seed)
    assert connected() == before + 1
    world.close()
    assert connected() == before
    with pytest.raises(InvalidInputError):
        RobonautARcubeWorld(urdf="nowhere.urdf")
    assert connected() == before


def test_two_actions_of_a_trial_are_recognition_on_the_robot():
    with gymnasium.make("sim/RobonautARcube-v0", disable_env_checker=True) as world:
        inference = begin_trial("gtsam", RobotMemory(arcube_assumptions()), preset("default"))
        record = run_trial(world, inference, EntropyPolicy(), 2, np.random.default_rng(0))
    assert record.verdict == "novel"
    assert [step.detection for step in record.steps] == [step.truth["pattern"] for step in record.steps]


def test_a_camera_that_sees_nothing_leaves_the_trial_undecided(make):
    blind = make()
    blind._detect = lambda: (MISSING, MISSING)
    inference = begin_trial("bayes-filter", RobotMemory(arcube_assumptions()), preset("default"))
    record = run_trial(blind, inference, EntropyPolicy(), 1, np.random.default_rng(0))
    assert record.verdict == "undecided"


@pytest.mark.slow
def test_a_short_test_on_the_robot_has_the_counts_of_the_ideal_world():
    plan = {"engine": "bayes-filter", "n_trials": 8, "n_actions": 6}
    robot = run_test(TestPlan(world="robonaut", **plan), 0)
    assert robot.lost == robot.undecided == 0
    assert robot == run_test(TestPlan(world="ideal", **plan), 0)
