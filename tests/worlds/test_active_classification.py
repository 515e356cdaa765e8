"""Worlds as tasks of Active Perception Gym, held against what its own checks and wrappers ask for."""

import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from atg_fg.core.errors import InvalidInputError, MissingDependencyError, UnknownNameError
from atg_fg.worlds.registry import WORLDS

ID = "atg_fg.worlds:atg_fg/ActiveClassification-v0"


def test_without_it_its_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "ap_gym", None)
    monkeypatch.delitem(sys.modules, "atg_fg.worlds.active_classification", raising=False)
    with pytest.raises(MissingDependencyError, match=r'pip install "atg-fg\[ap-gym\]"'):
        gymnasium.make(ID)


def needs_ap_gym(test):
    """It loads many libraries, which have warnings of their own."""
    return pytest.mark.peers(pytest.mark.filterwarnings("ignore")(test))


@pytest.fixture(scope="module")
def ap_gym():
    return pytest.importorskip("ap_gym", reason="ap_gym is not installed: pip install atg-fg[ap-gym]")


@needs_ap_gym
@pytest.mark.parametrize("world", [name for name, place in WORLDS.items() if place.startswith("atg_fg")])
def test_all_worlds_are_tasks_that_its_checks_take(ap_gym, world):
    task = ap_gym.make(ID, world=world, n_objects=4, slip=0.1, missing=0.1)
    check_env(task.unwrapped, skip_render_check=True)
    task.reset(seed=0)
    ended = [any(task.step(task.action_space.sample())[2:4]) for _ in range(10)]
    assert ended == [False] * 9 + [True]
    assert task.prediction_space.shape == (4,)
    assert task.prediction_target_space == gymnasium.spaces.Discrete(4)


@needs_ap_gym
def test_the_reward_is_the_loss_of_what_was_predicted(ap_gym):
    """By hand: of 4 objects ln 4 is the loss of a blind guess, over which it is taken."""
    task = ap_gym.make(ID, world="lock", n_objects=4)
    task.reset(seed=0, options={"object": 2})
    for logits, loss in (
        (np.zeros(4), 1.0),
        (np.array([0, 0, 50, 0]), 0.0),
        (np.log([0.1, 0.1, 0.25, 0.55]), 1.0),
        (np.log([0.2, 0.2, 0.5, 0.1]), 0.5),
    ):
        _, reward, *_, info = task.step({"action": 0, "prediction": logits.astype(np.float32)})
        assert info["prediction"]["target"] == 2
        assert info["prediction"]["loss"] == pytest.approx(loss, abs=1e-6)
        assert reward == pytest.approx(-loss, abs=1e-6)


@needs_ap_gym
def test_the_object_is_not_given_away(ap_gym):
    observation, info = ap_gym.make(ID, n_objects=3).reset(seed=0)
    assert info == {}
    assert observation.shape == (2,)


@needs_ap_gym
def test_its_wrappers_and_vectors_take_it(ap_gym):
    logged = ap_gym.ActiveClassificationLogWrapper(ap_gym.make(ID, world="detector", n_objects=3))
    logged.reset(seed=0)
    prediction = np.array([0.0, 9.0, 0.0], np.float32)
    for _ in range(10):
        *_, info = logged.step({"action": 0, "prediction": prediction})
    assert info["prediction"]["target"] in range(3)
    tasks = ap_gym.make_vec(ID, 3, world="detector", n_objects=3)
    tasks.reset(seed=0)
    _, rewards, *_ = tasks.step(tasks.action_space.sample())
    assert rewards.shape == (3,)
    tasks.close()


@needs_ap_gym
@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"n_objects": 1}, InvalidInputError, "n_objects: 1; expected a whole number of at least 2"),
        ({"world": "magic"}, UnknownNameError, "world: unknown name 'magic'"),
        ({"world": "lock", "colour": 3}, InvalidInputError, "colour"),
    ],
)
def test_what_cannot_be_made_is_refused(ap_gym, options, error, message):
    with pytest.raises(error, match=message):
        ap_gym.make(ID, **options)


@needs_ap_gym
def test_a_world_whose_objects_have_no_numbers_is_refused(ap_gym):
    from atg_fg.worlds.active_classification import ActiveClassificationWorld
    from atg_fg.worlds.registry import make_world

    task = ActiveClassificationWorld(make_world("lock", n_objects=6), n_objects=3)
    with pytest.raises(InvalidInputError, match="world: object 5; expected its number, 0 to 2"):
        task.reset(seed=0, options={"object": 5})
