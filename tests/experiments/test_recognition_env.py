"""Recognition as a task for reinforcement learning."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.engines import begin_trial
from atg_fg.experiments.exploration import complete_memory
from atg_fg.experiments.recognition_env import RecognitionEnv, make_recognition_env
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import Choice, as_policy
from atg_fg.policies.belief_features import BeliefFeatures
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.arcube_world import ARcubeWorld
from atg_fg.worlds.registry import make_world

PARAMETERS = preset("default")
CUBES = make_arcubes(4, seed=0)
ASSUMPTIONS = arcube_assumptions(4)


class Scripted:
    """Takes these actions in turn."""

    def __init__(self, actions):
        self.actions = iter(actions)

    def choose(self, inference, rng):
        return Choice(next(self.actions), None)


def episode(env, actions, **reset):
    """Return the first summary and what each step returned."""
    first, _ = env.reset(**reset)
    return first, [env.step(np.int64(action)) for action in actions]


@pytest.mark.parametrize("options", [{}, {"reward": "entropy", "world": "lid-box"}, {"preset": "learned"}])
def test_it_is_a_gymnasium_environment(options):
    if options.get("preset") == "learned":
        options = {**options, "engine": "learned-structure"}
    check_env(gymnasium.make("atg_fg/Recognition-v0", **options).unwrapped)


def test_an_episode_is_a_trial():
    env = make_recognition_env(n_actions=3)
    first, steps = episode(env, [0, 1, 2], seed=4)
    assert [step[2] for step in steps] == [False, False, True]
    record = steps[-1][4]["record"]
    assert record.actions == [0, 1, 2]
    assert len(record.steps) == 4

    world = make_world("ideal")
    inference = begin_trial("gtsam", RobotMemory(arcube_assumptions()), PARAMETERS)
    start = {"object": record.steps[0].truth["object"], "orientation": record.steps[0].truth["orientation"]}
    same = run_trial(world, inference, Scripted([0, 1, 2]), 3, np.random.default_rng(0), reset_options=start)
    assert record.detections == same.detections
    for one, other in zip(record.steps, same.steps, strict=True):
        np.testing.assert_allclose(one.belief.probabilities, other.belief.probabilities, atol=1e-12)
        assert one.log_evidence == pytest.approx(other.log_evidence, abs=1e-9)
    np.testing.assert_array_equal(steps[-1][0], env.summary.of(inference).astype(np.float32))
    assert first[7] == 1.0


def test_the_rewards_of_success_are_those_of_table_1():
    env = RecognitionEnv(ARcubeWorld(CUBES), RobotMemory(ASSUMPTIONS), PARAMETERS, n_actions=8, n_trials=12)
    rng = np.random.default_rng(0)
    presented, made_from, wins = set(), {}, 0
    env.reset(seed=1)
    for _ in range(12):
        done, total = False, 0.0
        while not done:
            _, reward, done, _, info = env.step(np.int64(rng.integers(3)))
            total += reward
        record, number = info["record"], info["object"]
        if number in presented:
            right = record.verdict == "known" and made_from[record.matched] == number
        else:
            right = record.verdict == "novel"
        assert (total, info["success"]) == (float(right), right)
        if record.verdict == "novel":
            made_from[env.memory.names[-1]] = number
        presented.add(number)
        wins += right
        env.reset()
    assert wins > 6


def test_the_rewards_of_entropy_sum_to_what_the_trial_has_taken_away():
    env = make_recognition_env(n_actions=5, reward="entropy")
    env.reset(seed=0)
    for _ in range(3):
        rewards, done = [], False
        while not done:
            _, reward, done, _, info = env.step(np.int64(1))
            rewards.append(reward)
        steps = info["record"].steps
        assert sum(rewards) == pytest.approx(steps[0].belief.entropy - steps[-1].belief.entropy)
        env.reset()


def test_the_memory_learns_until_a_test_is_over_or_a_seed_begins_another():
    env = make_recognition_env(n_actions=2, n_trials=3)
    sizes = []
    env.reset(seed=0)
    for _ in range(4):
        sizes.append(len(env.memory))
        env.step(np.int64(0))
        env.step(np.int64(0))
        env.reset()
    assert sizes == [0, 1, 2, 0]
    assert len(env.memory) == 1
    env.reset(seed=0)
    assert len(env.memory) == 0


def test_a_memory_that_does_not_learn_stays_as_it_is():
    memory = complete_memory(ASSUMPTIONS, CUBES[:2])
    owners = {name: number for number, name in enumerate(memory.names)}
    env = RecognitionEnv(ARcubeWorld(CUBES), memory, PARAMETERS, n_actions=8, learns=False, made_from=owners)
    for number in (0, 1, 2, 2):
        _, steps = episode(env, [0, 1, 2, 0, 1, 0, 2, 0], seed=number, options={"object": number})
        assert steps[-1][1] == 1.0
        assert env.memory == memory


def test_the_same_seed_gives_the_same_episodes():
    one, other = (make_recognition_env(n_actions=3, world_options={"slip": 0.3, "wrong": 0.2}) for _ in range(2))
    for seed in (3, None, None):
        (first, steps), (again, others) = (episode(env, [0, 1, 0], seed=seed) for env in (one, other))
        np.testing.assert_array_equal(first, again)
        for step, same in zip(steps, others, strict=True):
            np.testing.assert_array_equal(step[0], same[0])
            assert step[1:3] == same[1:3]


class Loses(ARcubeWorld):
    """Loses the object at the second action."""

    def reset(self, **options):
        self.actions = 0
        return super().reset(**options)

    def step(self, action):
        observation, reward, _, truncated, info = super().step(action)
        self.actions += 1
        return observation, reward, self.actions == 2, truncated, {**info, "lost": self.actions == 2}


@pytest.mark.parametrize("reward", ["success", "entropy"])
def test_a_lost_object_ends_the_trial_without_a_reward(reward):
    env = RecognitionEnv(Loses(CUBES), RobotMemory(ASSUMPTIONS), PARAMETERS, n_actions=5, reward=reward)
    _, steps = episode(env, [0, 1], seed=0)
    assert steps[-1][1:3] == (0.0, True)
    assert steps[-1][4]["record"].verdict == "lost"
    assert not steps[-1][4]["success"]
    assert len(env.memory) == 0


def test_as_a_policy_an_agent_sees_what_it_saw_in_training():
    """A greedy agent in the environment, and in the same trial as a policy."""
    seen = []

    class Greedy:
        def predict(self, observation, deterministic):
            seen.append(observation)
            return observation[8:11].argmax(), None

    start = {"object": 2, "orientation": 5}
    env = RecognitionEnv(ARcubeWorld(CUBES), RobotMemory(ASSUMPTIONS), PARAMETERS, n_actions=4)
    observation, _ = env.reset(seed=0, options=start)
    for _ in range(4):
        observation, *_ = env.step(Greedy().predict(observation, True)[0])
    inference = begin_trial("bayes-filter", RobotMemory(ASSUMPTIONS), PARAMETERS)
    rng = np.random.default_rng(0)
    run_trial(ARcubeWorld(CUBES), inference, as_policy(Greedy()), 4, rng, reset_options=start)
    assert len(seen) == 8
    np.testing.assert_array_equal(seen[:4], seen[4:])


def test_a_summary_of_ones_own_is_what_is_seen():
    summary = BeliefFeatures(arcube_assumptions(), top=2, expected_entropies=False)
    env = make_recognition_env(summary=summary)
    assert env.reset(seed=0)[0].shape == env.observation_space.shape == (2 + 3 + 24,)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"reward": "fame"}, UnknownNameError, "reward: unknown name 'fame'; expected one of: entropy, success"),
        ({"n_actions": 0}, InvalidInputError, "n_actions: 0; expected"),
        ({"n_trials": 0}, InvalidInputError, "n_trials: 0; expected"),
        ({"engine": "magic"}, UnknownNameError, "engine"),
        ({"world": "magic"}, UnknownNameError, "world"),
        ({"preset": "magic"}, UnknownNameError, "preset"),
        ({"preset": "learned"}, InvalidInputError, "does not know learn_structure"),
        ({"made_from": {"cup": 1}}, InvalidInputError, "made_from: cup; expected the object of each of the 0 ATGs"),
    ],
)
def test_what_it_cannot_be_made_from_is_refused(options, error, message):
    with pytest.raises(error, match=message):
        make_recognition_env(**options)


def test_steps_out_of_turn_and_actions_that_are_not_there_are_refused():
    env = make_recognition_env(n_actions=1)
    with pytest.raises(InvalidInputError, match="expected a reset first"):
        env.step(np.int64(0))
    env.reset(seed=0)
    with pytest.raises(InvalidInputError, match="action: 3; expected 0 to 2"):
        env.step(3)
    env.step(np.int64(0))
    with pytest.raises(InvalidInputError, match="expected a reset first"):
        env.step(np.int64(0))
