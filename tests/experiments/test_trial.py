import json

import gymnasium
import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import EntropyPolicy, RandomPolicy
from atg_fg.storage.memory_json import read_assumptions
from atg_fg.storage.presets import preset
from atg_fg.storage.trial_log import to_json_lines
from atg_fg.worlds.arcube_world import ARcubeWorld
from atg_fg.worlds.registry import make_world


def a_trial(memory, seed=0, n_actions=5, policy=None, engine="bayes-filter", **world_options):
    inference = begin_trial(engine, memory, preset("default"))
    rng = np.random.default_rng(seed)
    world = make_world("ideal", **world_options)
    return run_trial(world, inference, policy or EntropyPolicy(), n_actions, rng, reset_options={"object": 3})


@pytest.fixture
def empty():
    return RobotMemory(arcube_assumptions())


def test_a_trial_looks_once_more_than_it_acts(empty):
    record = a_trial(empty, n_actions=7)
    assert len(record.steps) == 8
    assert len(record.actions) == 7
    assert record.steps[-1].action is None


def test_with_an_empty_memory_everything_is_new(empty):
    record = a_trial(empty)
    assert record.judged_novel
    assert record.matched is None


def test_an_object_met_before_is_recognised(empty):
    first = a_trial(empty, n_actions=20)
    name = empty.learn(first.patterns, first.actions, first.matched)
    second = a_trial(empty, seed=1, n_actions=10)
    assert second.matched == name


def test_the_same_generator_gives_the_same_record(empty):
    options = {"slip": 0.1, "wrong": 0.1, "missing": 0.1}
    lines = [to_json_lines(a_trial(empty, seed=5, n_actions=10, **options)) for _ in range(2)]
    assert lines[0] == lines[1]
    assert to_json_lines(a_trial(empty, seed=6, n_actions=10, **options)) != lines[0]


def test_every_engine_leaves_the_same_record(empty):
    first = a_trial(empty, n_actions=6)
    empty.learn(first.patterns, first.actions, None)
    records = [a_trial(empty, seed=2, n_actions=4, engine=engine) for engine in ("gtsam", "bayes-filter")]
    assert records[0].actions == records[1].actions
    for one, other in zip(*(record.steps for record in records), strict=True):
        np.testing.assert_allclose(one.belief.objects, other.belief.objects, atol=1e-12)


def test_the_record_holds_every_step_as_json_lines(empty):
    lines = [json.loads(line) for line in to_json_lines(a_trial(empty, n_actions=3), seed=0).splitlines()]
    header, *steps, last = lines
    assert read_assumptions(header.pop("assumptions"), "header") == empty.assumptions
    assert header == {"format": "atg-fg/trial", "version": 1, "objects": [], "seed": 0}
    assert [step["step"] for step in steps] == [0, 1, 2, 3]
    assert set(steps[0]["expected_entropy"]) == {"flip", "left", "right"}
    assert steps[0]["truth"]["object"] == 3
    assert steps[-1]["action"] is None
    assert last["verdict"]["judged_novel"] is True


def test_a_policy_that_does_not_look_ahead_leaves_no_expected_entropies(empty):
    assert a_trial(empty, policy=RandomPolicy()).steps[0].expected_entropies is None


@pytest.mark.parametrize("n_actions", [0, -1])
def test_a_trial_without_actions_is_refused(empty, n_actions):
    with pytest.raises(InvalidInputError, match=f"actions: {n_actions}; expected"):
        a_trial(empty, n_actions=n_actions)


def test_a_world_with_other_spaces_is_refused(empty):
    inference = begin_trial("bayes-filter", empty, preset("default"))
    world = gymnasium.make("CartPole-v1")
    with pytest.raises(InvalidInputError, match=r"world: .*expected 3 actions"):
        run_trial(world, inference, EntropyPolicy(), 3, np.random.default_rng(0))


class EndingWorld(ARcubeWorld):
    """Ends the episode after two actions, and says what it is told to."""

    def __init__(self, **ending):
        super().__init__()
        self.ending, self.n_actions = ending, 0

    def step(self, action):
        observation, reward, _, _, truth = super().step(action)
        self.n_actions += 1
        return (
            observation,
            reward,
            self.n_actions == 2,
            False,
            {**truth, **(self.ending if self.n_actions == 2 else {})},
        )


def ended(memory, **ending):
    inference = begin_trial("bayes-filter", memory, preset("default"))
    return run_trial(EndingWorld(**ending), inference, EntropyPolicy(), 5, np.random.default_rng(0))


def test_a_world_that_ends_the_episode_ends_the_trial_with_a_last_look(empty):
    record = ended(empty)
    assert (len(record.steps), len(record.actions)) == (3, 2)
    assert record.verdict == "novel"


def test_a_lost_object_ends_the_trial_without_a_verdict_on_it(empty):
    record = ended(empty, lost=True)
    assert (len(record.steps), len(record.actions)) == (2, 2)
    assert (record.verdict, record.judged_novel, record.matched) == ("lost", False, None)
    last = json.loads(to_json_lines(record).splitlines()[-1])["verdict"]
    assert (last["outcome"], last["judged_novel"], last["matched"], last["truth"]["lost"]) == (
        "lost",
        False,
        None,
        True,
    )


def test_a_trial_in_which_nothing_was_seen_is_undecided(empty):
    record = a_trial(empty, missing=1.0)
    assert (record.verdict, record.judged_novel, record.matched) == ("undecided", False, None)


def test_one_symbol_is_enough_to_decide(empty):
    record = a_trial(empty, missing=0.9, n_actions=10)
    assert any(symbol is not None for step in record.steps for symbol in step.detection)
    assert record.verdict == "novel"
