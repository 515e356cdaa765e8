"""The world of things of odd shapes: what it says, what its camera cuts out, and that things are told apart."""

from contextlib import closing

import cv2
import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.policies import RandomPolicy
from atg_fg.policies.testing import check_policy
from atg_fg.senses.face_features import VIEW, view_features
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import ORIENTATIONS, rotation_of
from atg_fg.worlds.registry import assumptions_of, make_world_with, sense_of
from atg_fg.worlds.testing import check_world
from sim.bodies.meshes import N_FOR_CALIBRATION, N_MESHES, calibration_meshes, make_meshes


@pytest.fixture(scope="module")
def world():
    with closing(make_world_with("meshes", 4, 3, weight=True)) as made:
        yield made


@pytest.mark.parametrize("weight", [False, True])
def test_trials_can_be_run_in_it(weight):
    with closing(make_world_with("meshes", 4, 3, weight=weight)) as made:
        assert check_world(made, trials=1, steps=4) == 5


@pytest.mark.parametrize("policy", ["entropy", "random", "explore"])
def test_policies_choose_among_things_that_were_felt(world, policy):
    memory = RobotMemory(assumptions_of(world, 4), sense=sense_of(world))
    for kilograms in (0.3, 0.6):
        memory.learn([0, 1], [0], None, measured=[(), (("weight", kilograms),)])
    assert check_policy(policy, memory, cases=2) == 10


def test_things_are_different_ones_and_none_of_those_that_calibrate():
    things = make_meshes(N_MESHES - N_FOR_CALIBRATION, 1)
    paths = {thing.path for thing in things}
    assert len(paths) == len(things)
    assert not paths & {thing.path for thing in calibration_meshes(20, np.random.default_rng(0))}
    extents = [float(np.ptp(thing.vertices, axis=0).max()) for thing in things[:50]]
    assert 0.239 < min(extents) < max(extents) < 0.301
    assert [thing.path for thing in make_meshes(5, 1)] == [thing.path for thing in things[:5]]


def test_each_way_in_which_each_thing_lies_has_a_pattern_of_its_own(world):
    _, info = world.reset(seed=2, options={"object": 2, "orientation": 5})
    assert info["pattern"] == (2 * len(ORIENTATIONS) + 5,)


def test_a_weight_is_felt_when_a_thing_is_turned_and_errs_by_8_percent(world):
    first, _ = world.reset(seed=1, options={"object": 1})
    assert first["measured"].tolist() == [0]
    true = world.get_wrapper_attr("meshes")[1].weight
    readings = np.array([world.step(np.int64(0))[0]["weight"][0] for _ in range(120)])
    errors = np.log(readings / true)
    assert abs(errors.mean()) < 0.03
    assert 0.06 < errors.std() < 0.10


def test_what_is_cut_out_holds_the_whole_thing_wherever_it_stands(world):
    camera = world.get_wrapper_attr("camera")
    for thing in world.get_wrapper_attr("meshes"):
        frame = camera.frame(thing, rotation_of(7), np.random.default_rng(0))
        view = camera.view(frame)
        assert view.shape == (VIEW, VIEW, 3)
        # A thing is grey, and wood is not.
        grey = np.argwhere(cv2.medianBlur((np.ptp(view.astype(int), axis=2) < 40).astype(np.uint8), 5))
        assert np.abs((grey.min(axis=0) + grey.max(axis=0) - VIEW) / 2).max() < 4
        assert grey.min() > 0
        assert grey.max() < VIEW - 1


def test_looks_at_one_side_are_nearer_to_each_other_than_to_other_sides(world):
    camera, rng = world.get_wrapper_attr("camera"), np.random.default_rng(0)
    thing = world.get_wrapper_attr("meshes")[0]
    looks = [
        [view_features(camera.view(camera.frame(thing, rotation_of(k), rng))) for _ in range(3)] for k in (0, 5, 11)
    ]
    same = max(np.linalg.norm(a - b) for each in looks for a in each for b in each)
    other = min(np.linalg.norm(a - b) for a in looks[0] for b in (*looks[1], *looks[2]))
    assert same < other


@pytest.mark.slow
def test_things_are_recognised_by_their_views_and_weights(world):
    memory = RobotMemory(assumptions_of(world, 4), sense=sense_of(world))
    verdicts = []
    for number in range(12):
        rng = np.random.default_rng(100 + number)
        inference = begin_trial("bayes-filter", memory, preset("default"))
        record = run_trial(world, inference, RandomPolicy(), 8, rng, reset_options={"object": number % 4})
        verdicts.append(record.matched)
        learn_from(record, memory)
    assert verdicts[:4] == [None] * 4
    assert sum(verdict == f"object-{number % 4:03d}" for number, verdict in enumerate(verdicts)) >= 6


def test_a_frame_of_another_size_or_type_is_refused_in_one_line(world):
    camera = world.get_wrapper_attr("camera")
    for frame in (np.zeros((10, 10, 3), dtype=np.uint8), np.zeros((120, 160, 3)), np.zeros((120, 160), dtype=np.uint8)):
        with pytest.raises(InvalidInputError, match=r"frame: shape .* expected RGB bytes, 160 by 120 pixels"):
            camera.view(frame)
