import numpy as np

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import ExplorationPolicy, RandomPolicy
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.arcube_world import ARcubeWorld


def explored(policy, n_actions, seed):
    """The ATG that a robot without memory makes of a cube."""
    memory = RobotMemory(arcube_assumptions())
    inference = begin_trial("bayes-filter", memory, preset("default"))
    rng = np.random.default_rng(seed)
    record = run_trial(ARcubeWorld(make_arcubes(5, 0)), inference, policy, n_actions, rng)
    return memory[memory.learn(record.patterns, record.actions, matched=None)]


def test_it_tries_every_action_of_every_aspect_in_less_than_twice_as_many_actions():
    for seed in range(3):
        assert len(explored(ExplorationPolicy(), 2 * 72, seed).counts) == 72


def test_it_learns_more_edges_than_chance():
    ours = [len(explored(ExplorationPolicy(), 40, seed).counts) for seed in range(5)]
    chance = [len(explored(RandomPolicy(), 40, seed).counts) for seed in range(5)]
    assert np.mean(ours) > np.mean(chance) + 5


def test_an_action_never_tried_here_comes_first():
    assert all(len(explored(ExplorationPolicy(), 3, seed).counts) == 3 for seed in range(5))
