"""``check_policy`` takes what keeps the promises of ``Policy``, and finds each kind of fault."""

import random

import gymnasium
import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.goals import Goal
from atg_fg.policies import POLICIES, AgentPolicy, Choice, GoalPolicy, SampledPolicy, StoppingPolicy, make_policy
from atg_fg.policies.testing import check_policy
from tests.storage.database.small import plain


@pytest.mark.parametrize("policy", POLICIES)
def test_the_policies_there_are_keep_what_they_promise(policy):
    assert check_policy(policy, cases=4) == 4 * 5


def test_so_do_those_that_end_trials_and_those_that_know_one_kind_of_objects():
    assert 6 <= check_policy(StoppingPolicy(make_policy("entropy"), 0.5), cases=6) < 6 * 5
    memory = plain()
    check_policy(GoalPolicy(Goal.parse(memory.assumptions.alphabet, "front=0")), memory, cases=3)
    check_policy(SampledPolicy(gymnasium.spaces.Discrete(3)), memory, cases=3)
    check_policy(AgentPolicy(Constant()), memory, cases=3)


class Constant:
    def predict(self, observation, *, deterministic):
        return np.array(1), None


class Plain:
    name = "plain"

    def choose(self, inference, rng):
        return Choice(int(rng.integers(inference.model.n_actions)), None)


class Bare(Plain):
    def choose(self, inference, rng):
        return 0


class TooFar(Plain):
    def choose(self, inference, rng):
        return Choice(inference.model.n_actions, None)


class NoNumber(Plain):
    def choose(self, inference, rng):
        return Choice(np.float64(0.0), None)


class Truthful(Plain):
    def choose(self, inference, rng):
        return Choice(True, None)


class Short(Plain):
    def choose(self, inference, rng):
        return Choice(0, np.zeros(inference.model.n_actions + 1))


class Undefined(Plain):
    def choose(self, inference, rng):
        return Choice(0, np.full(inference.model.n_actions, np.nan))


class Mute(Plain):
    def choose(self, inference, rng):
        return Choice(0, None, 7)


class Unseeded(Plain):
    def choose(self, inference, rng):
        return super().choose(inference, np.random.default_rng())


class Shared(Plain):
    def choose(self, inference, rng):
        return Choice(random.randrange(inference.model.n_actions), None)


class SharedArrays(Plain):
    def choose(self, inference, rng):
        return Choice(int(np.random.randint(inference.model.n_actions)), None)  # noqa: NPY002


class Acting(Plain):
    def choose(self, inference, rng):
        inference.act(0)
        return Choice(0, None)


class Remembering(Plain):
    n_asked = 0

    def choose(self, inference, rng):
        self.n_asked += 1
        return Choice(self.n_asked % inference.model.n_actions, None)


class Bound(Plain):
    def __init__(self):
        self.rule = lambda n_actions: 0

    def choose(self, inference, rng):
        return Choice(self.rule(inference.model.n_actions), None)


class Nameless(Plain):
    name = None


class Surprised(Plain):
    def choose(self, inference, rng):
        return Choice(int(inference.identity().objects.argmax()) * 0, None)


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        (Bare, "case 0, after look 0: 0; expected a Choice"),
        (TooFar, "action 1; expected a whole number from 0 to 0"),
        (NoNumber, r"action np\.float64\(0\.0\); expected a whole number"),
        (Truthful, "action True; expected a whole number"),
        (Short, "expected entropies .*; expected one of at least 0 for each of 1 actions"),
        (Undefined, "expected entropies .*nan"),
        (Mute, "purpose 7; expected words or None"),
        (Unseeded, "when it .*; expected the same"),
        (Shared, "a generator that all share was used; expected the trial's own"),
        (SharedArrays, "a generator that all share was used; expected the trial's own"),
        (Acting, "the engine has changed; expected that a policy only asks it"),
        (Remembering, "when it was asked again; expected the same"),
        (Bound, "cannot be sent to another process: .*; expected what pickle takes"),
        (Nameless, "name is None; expected a str"),
        (Surprised, "case 0, after look 0: ValueError: .*; expected a choice"),
    ],
)
def test_a_fault_is_found_and_said(policy, message):
    with pytest.raises(AssertionError, match=message):
        check_policy(policy)


def test_an_instance_a_class_and_a_name_are_taken():
    assert check_policy(Plain, cases=4) == check_policy(Plain(), cases=4) == check_policy("random", cases=4) == 20


def test_what_is_no_policy_is_refused():
    with pytest.raises(UnknownNameError, match="policy: unknown name 'magic'"):
        check_policy("magic")
    with pytest.raises(InvalidInputError, match="expected an object with choose"):
        check_policy(object())


class Knowing(Plain):
    def choose(self, inference, rng):
        assert inference.memory.names == ("object-000", "object-001", "object-002")
        return Choice(2, None)


def test_a_memory_of_ones_own_is_asked_about():
    assert check_policy(Knowing, plain(), cases=2) == 10
    with pytest.raises(AssertionError, match="case 0, after look 0: AssertionError"):
        check_policy(Knowing)
