import gc
import hashlib
import importlib.util
import multiprocessing
import resource

import numpy as np
import pybullet
import pytest
from gymnasium.utils.env_checker import check_env

from atg_fg.core.errors import InvalidInputError, MissingDependencyError, UnknownNameError
from atg_fg.core.patterns import MISSING
from atg_fg.worlds.registry import make_world
from atg_fg.worlds.testing import check_world
from sim.worlds.rendered_world import RenderedARcubeWorld

NOMINAL = {"position_jitter": 0.02, "yaw_jitter": 5.0, "light_jitter": 0.3, "image_noise": 10.0}


@pytest.fixture
def make():
    worlds = []

    def made(**options):
        worlds.append(RenderedARcubeWorld(**options))
        return worlds[-1]

    yield made
    for world in worlds:
        world.close()


def episode_hash(seed):
    """Hash of the frames and observations of a short noisy episode."""
    world = RenderedARcubeWorld(**NOMINAL)
    digest = hashlib.sha256()
    world.reset(seed=seed)
    for action in (0, 1, 2, 0):
        digest.update(world.frame.tobytes())
        digest.update(world.step(np.int64(action))[0].tobytes())
    world.close()
    return digest.hexdigest()


def test_the_world_keeps_the_gymnasium_contract():
    world = make_world("rendered", render_mode="rgb_array", **NOMINAL)
    check_env(world.unwrapped)
    assert check_world(world, trials=1, steps=6) == 7
    world.close()


def test_it_has_the_spaces_of_the_ideal_world(make):
    ideal = make_world("ideal")
    world = make()
    assert world.action_space == ideal.action_space
    assert world.observation_space == ideal.observation_space


def test_both_tags_are_read_in_every_orientation_under_jitter_and_noise(make):
    world = make(**NOMINAL)
    for orientation in range(24):
        shown = {"object": orientation % 3, "orientation": orientation}
        observation, truth = world.reset(seed=orientation, options=shown)
        assert tuple(observation) == truth["pattern"]


@pytest.mark.slow
def test_a_thousand_looks_have_no_wrong_symbol_and_few_missing(make):
    world = make(**NOMINAL)
    missed = 0
    for seed in range(1000):
        observation, truth = world.reset(seed=seed)
        for seen, true in zip(observation, truth["pattern"], strict=True):
            assert seen in (true, MISSING)
            missed += seen == MISSING
    assert missed <= 20


def test_it_agrees_with_the_ideal_world_step_by_step(make):
    world, ideal = make(), make_world("ideal")
    start = {"object": 11, "orientation": 17}
    seen, _ = world.reset(seed=0, options=start)
    expected, _ = ideal.reset(seed=0, options=start)
    np.testing.assert_array_equal(seen, expected)
    for action in np.random.default_rng(0).integers(3, size=12):
        np.testing.assert_array_equal(world.step(action)[0], ideal.step(action)[0])


def test_the_same_seed_gives_the_same_frames_in_any_process():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        elsewhere = pool.apply(episode_hash, (3,))
    assert episode_hash(3) == elsewhere
    assert episode_hash(4) != elsewhere


def test_what_cannot_be_seen_is_missing_and_no_error(make):
    world = make(image_noise=400.0)
    observation, _ = world.reset(seed=0)
    assert observation.tolist() == [MISSING, MISSING]


def test_slips_leave_the_cube_as_it_is(make):
    world = make(slip=1.0)
    before, _ = world.reset(seed=0)
    after, _, _, _, truth = world.step(np.int64(0))
    assert truth["slipped"]
    np.testing.assert_array_equal(before, after)


def test_two_worlds_live_side_by_side(make):
    one, other = make(), make()
    start = {"object": 5, "orientation": 3}
    one.reset(seed=0, options=start)
    other.reset(seed=0, options={"object": 6, "orientation": 9})
    frame = one.frame
    one.reset(seed=0, options=start)
    np.testing.assert_array_equal(one.frame, frame)


def test_changing_cubes_does_not_grow_memory(make):
    world = make(image_size=(32, 24))
    for cube in range(100):
        world.reset(seed=cube, options={"object": cube})
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for cube in range(100):
        world.reset(seed=cube, options={"object": cube})
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 20_000  # kB; one texture for each reset would be 225,000


def test_render_gives_the_frame_of_the_last_look(make):
    world = make(render_mode="rgb_array", image_size=(160, 120))
    world.reset(seed=0)
    assert world.render().shape == (120, 160, 3)
    assert world.render().dtype == np.uint8
    np.testing.assert_array_equal(world.render(), world.frame)
    assert make().render() is None


def test_render_can_outline_what_was_detected(make):
    world = make(render_mode="detections")
    world.reset(seed=0)
    assert world.render().shape == world.frame.shape
    assert (world.render() != world.frame).any()


@pytest.mark.parametrize("option", ["position_jitter", "yaw_jitter", "light_jitter", "image_noise", "blur"])
@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_jitter_that_is_no_number_from_zero_is_refused(option, value):
    with pytest.raises(InvalidInputError, match=f"{option}: .*; expected a finite number of at least 0"):
        RenderedARcubeWorld(**{option: value})


def test_an_unknown_render_mode_is_refused():
    with pytest.raises(UnknownNameError, match="'human'; expected one of: detections, rgb_array"):
        RenderedARcubeWorld(render_mode="human")


@pytest.mark.parametrize(("module", "package"), [("pybullet", "pybullet"), ("cv2", "opencv-python-headless")])
def test_a_missing_package_is_named_with_the_extra_that_brings_it(monkeypatch, module, package):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == module else find(name))
    with pytest.raises(MissingDependencyError, match=rf"{package} is not installed.*atg-fg\[sim\]"):
        make_world("rendered")


def test_the_same_seed_slips_here_and_in_the_ideal_world_alike(make):
    world, ideal = make(slip=0.3, image_size=(64, 48)), make_world("ideal", slip=0.3)
    for seed in (7, None):
        truths = [world.reset(seed=seed)[1], ideal.reset(seed=seed)[1]]
        for action in (0, 1, 2) * 5:
            assert truths[0]["object"] == truths[1]["object"]
            assert truths[0]["orientation"] == truths[1]["orientation"]
            truths = [made.step(np.int64(action))[4] for made in (world, ideal)]


@pytest.mark.parametrize("size", [(0, 0), (-1, 5), "big", (320.5, 240), (320,), None, (100_000, 100_000)])
def test_an_image_size_that_is_none_is_refused(size):
    with pytest.raises(InvalidInputError, match=r"image_size: .*; expected width and height"):
        RenderedARcubeWorld(image_size=size)


@pytest.mark.parametrize("cube", [(0, 1, 2, 3, 4, 12), (0, 1, 2, 3, 4, -1), (0, 1, 2)])
def test_a_cube_without_a_tag_for_each_face_is_refused(cube):
    with pytest.raises(InvalidInputError, match=r"cubes: .*; expected 6 different tags from 0 to 11"):
        RenderedARcubeWorld([cube])


def test_a_world_that_nobody_closes_leaves_pybullet():
    world = RenderedARcubeWorld(image_size=(64, 48))
    client = world._client
    assert pybullet.isConnected(client)
    del world
    gc.collect()
    assert not pybullet.isConnected(client)
