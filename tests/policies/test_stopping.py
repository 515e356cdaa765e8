import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import EntropyPolicy, StoppingPolicy, make_policy
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.arcube_world import ARcubeWorld


def a_trial(memory, policy, seed, n_actions=20):
    inference = begin_trial("bayes-filter", memory, preset("default"))
    rng = np.random.default_rng(seed)
    return run_trial(ARcubeWorld(make_arcubes(10, 0)), inference, policy, n_actions, rng)


@pytest.fixture(scope="module")
def memory():
    memory = RobotMemory(arcube_assumptions())
    for seed in range(5):
        record = a_trial(memory, EntropyPolicy(), seed)
        memory.learn(record.patterns, record.actions, record.matched)
    return memory


def test_it_stops_at_the_first_look_that_settles_the_verdict_and_chooses_as_before_until_then(memory):
    early = 0
    for seed in range(10, 30):
        whole, stopped = (a_trial(memory, make_policy("entropy", settled), seed) for settled in (None, 0.05))
        open_looks = [step.belief.entropy_of_verdict > 0.05 for step in whole.steps]
        n_looks = open_looks.index(False) + 1 if False in open_looks else len(open_looks)
        assert len(stopped.steps) == n_looks
        assert stopped.patterns == whole.patterns[:n_looks]
        assert stopped.actions == whole.actions[: n_looks - 1]
        early += n_looks < len(open_looks)
    assert early > 5


def test_it_says_why_the_trial_ended(memory):
    record = a_trial(memory, make_policy("entropy", 1.0), 3)
    assert len(record.actions) < 20
    assert [step.purpose for step in record.steps] == [None] * len(record.actions) + ["settled"]


def test_where_nothing_is_remembered_one_look_settles_that_the_object_is_new():
    record = a_trial(RobotMemory(arcube_assumptions()), make_policy("entropy", 0.01), 0)
    assert (record.actions, record.verdict) == ([], "novel")


def test_a_smaller_entropy_takes_at_least_as_many_actions(memory):
    for seed in range(5):
        numbers = [len(a_trial(memory, make_policy("random", settled), seed).actions) for settled in (1.0, 0.1, 0.001)]
        assert numbers == sorted(numbers)


@pytest.mark.parametrize("settled", [0.0, -1.0, float("nan"), float("inf")])
def test_an_entropy_that_means_nothing_is_refused(settled):
    with pytest.raises(
        InvalidInputError, match=f"entropy_threshold: {settled}; expected a finite entropy above 0 nats"
    ):
        StoppingPolicy(EntropyPolicy(), settled)
