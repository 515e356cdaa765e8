"""Agents of other libraries choose as policies do."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from gymnasium import spaces

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import begin_trial
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import AgentPolicy, EntropyPolicy, SampledPolicy, as_policy, make_policy
from atg_fg.policies.belief_features import BeliefFeatures
from atg_fg.worlds.registry import make_world
from tests.small import graph, one_slot, trial

PLAN = TestPlan(engine="bayes-filter", n_actions=3, n_trials=6)


class Greedy:
    """The contract of Stable-Baselines3, with a rule in place of a network: the greatest expected gain in sight."""

    def __init__(self, n_actions=3):
        self.n_actions = n_actions
        self.seen = []

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        assert deterministic
        self.seen.append(observation)
        first = 5 + 3
        return np.array(observation[first : first + self.n_actions].argmax()), None


def answering(action, state=None):
    return SimpleNamespace(predict=lambda observation, deterministic: (action, state))


def looked():
    """Two objects that show 0; pushing tells them apart, pulling does not."""
    assumptions = one_slot(2, 3, 4, ("pull", "push"))
    one = graph(assumptions, "one", [(0,), (1,)], (0, 1, 1, 1), (0, 0, 0, 1))
    other = graph(assumptions, "other", [(0,), (2,)], (0, 1, 1, 1), (0, 0, 0, 1))
    memory = RobotMemory(assumptions, [one, other])
    return trial("bayes-filter", memory, ModelParameters(1e-8, 1e-8), 0)


def test_an_agent_sees_the_summary_and_its_action_is_taken():
    inference = looked()
    agent = Greedy(n_actions=2)
    choice = AgentPolicy(agent).choose(inference, np.random.default_rng(0))
    assert choice.action == EntropyPolicy().choose(inference, np.random.default_rng(0)).action == 1
    np.testing.assert_array_equal(agent.seen[0], BeliefFeatures(inference.memory.assumptions).of(inference))


@pytest.mark.parametrize("action", [1, np.int64(1), np.array(1), np.array([1])])
def test_an_action_may_be_a_number_or_an_array_of_one(action):
    assert AgentPolicy(answering(action)).choose(looked(), np.random.default_rng(0)).action == 1


@pytest.mark.parametrize("action", [2, -1, 0.0, np.array([0, 1]), None, "push", True])
def test_what_is_no_action_is_refused(action):
    with pytest.raises(InvalidInputError, match=r"agent: action .*expected 0 to 1"):
        AgentPolicy(answering(action)).choose(looked(), np.random.default_rng(0))


def test_an_agent_that_keeps_a_state_is_refused():
    with pytest.raises(InvalidInputError, match="keeps a state"):
        AgentPolicy(answering(0, state=np.zeros(2))).choose(looked(), np.random.default_rng(0))


def test_an_agent_that_was_trained_on_other_observations_is_refused():
    agent = answering(0)
    agent.observation_space = spaces.Box(0, 1, (3,))
    with pytest.raises(InvalidInputError, match=r"observations of shape \(3,\); expected the summary's \(14,\)"):
        AgentPolicy(agent).choose(looked(), np.random.default_rng(0))


def test_a_test_of_the_paper_scores_an_agent():
    greedy = run_test(PLAN, 0, policy=AgentPolicy(Greedy()))
    assert greedy.success[1] == 6
    assert greedy == run_test(PLAN, 0, policy=AgentPolicy(Greedy()))


def test_a_policy_that_the_plan_does_not_name_leaves_no_records(tmp_path):
    with pytest.raises(InvalidInputError, match="records: of a policy that the plan does not name"):
        run_test(PLAN, 0, tmp_path, policy=AgentPolicy(Greedy()))


def test_the_samples_of_a_space_are_actions_and_alike_for_the_same_generator():
    memory = RobotMemory(arcube_assumptions())
    with make_world("ideal") as world:
        records = [
            run_trial(
                world,
                begin_trial("bayes-filter", memory, ModelParameters()),
                SampledPolicy(world.action_space),
                30,
                np.random.default_rng(7),
            )
            for _ in range(2)
        ]
    assert records[0].actions == records[1].actions
    assert set(records[0].actions) == {0, 1, 2}


def test_a_space_of_something_else_is_refused():
    with pytest.raises(InvalidInputError, match="expected 0 to 1"):
        SampledPolicy(spaces.Box(0, 1, (2,))).choose(looked(), np.random.default_rng(0))


@pytest.mark.parametrize(
    ("given", "kind"),
    [
        (Greedy, AgentPolicy),
        (Greedy(), AgentPolicy),
        (EntropyPolicy, EntropyPolicy),
        (EntropyPolicy(), EntropyPolicy),
        (spaces.Discrete(3), SampledPolicy),
    ],
)
def test_policies_agents_spaces_and_classes_of_them_are_policies(given, kind):
    assert isinstance(as_policy(given), kind)


@pytest.fixture
def own_module(tmp_path, monkeypatch):
    (tmp_path / "own_policies.py").write_text(
        "from gymnasium.spaces import Discrete\nclass Agents:\n    actions = Discrete(3)\nnothing = 3\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("own_policies", None)


@pytest.mark.usefixtures("own_module")
def test_a_policy_of_ones_own_goes_by_module_and_name():
    assert isinstance(make_policy("own_policies:Agents.actions"), SampledPolicy)
    assert make_policy("own_policies:Agents.actions", entropy_threshold=0.1).name == "stopping"
    named = TestPlan(engine="bayes-filter", n_actions=3, n_trials=6, policy="own_policies:Agents.actions")
    assert run_test(named, 0) == run_test(PLAN, 0, policy=SampledPolicy(spaces.Discrete(3)))


@pytest.mark.usefixtures("own_module")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nowhere:agent", "policy 'nowhere:agent': cannot be imported: No module named 'nowhere'"),
        (":agent", "policy ':agent': cannot be imported"),
        (".a:b", "policy '.a:b': cannot be imported"),
        (".:x", "policy '.:x': cannot be imported"),
        ("a b:c", "policy 'a b:c': cannot be imported"),
        ("atg_fg.policies:GoalPolicy", "cannot be made without arguments"),
        ("own_policies:", "own_policies has no ''; expected module:object"),
        ("own_policies:other", "own_policies has no 'other'; expected module:object"),
        ("own_policies:nothing", "policy 'own_policies:nothing': 3; expected an object with choose"),
    ],
)
def test_a_name_that_leads_to_no_policy_is_refused(name, message):
    with pytest.raises(InvalidInputError, match=message.replace("(", r"\(")):
        make_policy(name)


def test_an_agent_without_predict_is_refused():
    with pytest.raises(InvalidInputError, match="expected an object with predict"):
        AgentPolicy(object())
