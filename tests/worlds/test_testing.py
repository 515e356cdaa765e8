"""``check_world`` takes what trials can be run in, and finds each kind of fault."""

import itertools
import random

import gymnasium
import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.worlds.registry import WORLDS, make_world
from atg_fg.worlds.testing import check_world

OURS = [name for name, place in WORLDS.items() if place.startswith("atg_fg")]


@pytest.mark.parametrize("trials", [1, pytest.param(4, marks=pytest.mark.slow)])
@pytest.mark.parametrize("noise", [{}, {"slip": 0.1, "wrong": 0.1, "missing": 0.1}])
@pytest.mark.parametrize("world", OURS)
def test_the_worlds_there_are_keep_what_they_promise(world, noise, trials):
    assert check_world(world, trials=trials, **noise) == trials * 21


def test_wrappers_and_options_are_taken():
    assert check_world(gymnasium.wrappers.TimeLimit(make_world("detector"), 5)) == 4 * 6
    assert check_world("lock", n_objects=2, trials=1, steps=3) == 4


class Cups(gymnasium.Env):
    """Two cups with three sides and a lid."""

    assumptions = Assumptions(2, 4, ("turn", "tip"), PatternAlphabet(("side",), 5))
    action_space = gymnasium.spaces.Discrete(2)
    observation_space = gymnasium.spaces.Box(-1, 4, (1,), np.int64)
    cups = ((0, 1, 2, 3), (4, 3, 0, 1))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.cup = int(self.np_random.integers(2))
        self.side = int(self.np_random.integers(3))
        return self.look()

    def step(self, action):
        self.side = (self.side + 1) % 3 if action == 0 else 3 - self.side
        return self.look()[0], 0.0, False, False, self.look()[1]

    def look(self):
        shown = self.cups[self.cup][self.side]
        return np.array([shown]), {"object": self.cup, "pattern": (shown,)}


class Far(Cups):
    def look(self):
        return np.array([7]), super().look()[1]


class Objectless(Cups):
    def look(self):
        return super().look()[0], {}


class Restless(Cups):
    def step(self, action):
        self.cup = 1 - self.cup
        return super().step(action)


class Unseeded(Cups):
    calls = itertools.count()  # one call after the other differs for sure, which draws of three sides would not

    def step(self, action):
        self.side = next(self.calls) % 3
        return self.look()[0], 0.0, False, False, self.look()[1]


class Shared(Cups):
    def step(self, action):
        random.random()
        return super().step(action)


class Stale(Cups):
    """Its looks are kept in few places, which it uses again and again."""

    seen = np.zeros((6, 1), dtype=np.int64)
    n_looks = 0

    def look(self):
        observation, info = super().look()
        self.n_looks += 1
        self.seen[self.n_looks % 6] = observation
        return self.seen[self.n_looks % 6], info


class Rich(Cups):
    assumptions = Assumptions(2, 2, ("turn", "tip"), PatternAlphabet(("side",), 5))


class Twice(Cups):
    assumptions = Assumptions(2, 4, ("turn", "tip"), PatternAlphabet(("side", "top"), 5))
    observation_space = gymnasium.spaces.Box(-1, 4, (2,), np.int64)

    def look(self):
        observation, info = super().look()
        return np.repeat(observation, 2), {"object": info["object"]}


class Priceless(Cups):
    def step(self, action):
        observation, _, *rest = super().step(action)
        return observation, float("inf"), *rest


class OfOneAction(Cups):
    action_space = gymnasium.spaces.Discrete(1)


class FromOne(Cups):
    action_space = gymnasium.spaces.Discrete(2, start=1)


class OfFewerSymbols(Cups):
    observation_space = gymnasium.spaces.Box(-1, 3, (1,), np.int64)


class Vague(Cups):
    assumptions = "cups"


class Broken(Cups):
    def reset(self, *, seed=None, options=None):
        raise ValueError("no cups")


class Lasting(Cups):
    """A world that wears out: what was done in the trials before is seen later on."""

    n_steps = 0

    def step(self, action):
        self.n_steps += 1
        if self.n_steps > 30:
            self.side = self.n_steps % 3
        return super().step(action)


@pytest.mark.parametrize(
    ("world", "message"),
    [
        (Far, "not within the observation space"),  # gymnasium says so, as of the next two
        (Unseeded, "Deterministic step observations are not equivalent"),
        (Broken, "check_env: ValueError: no cups"),
        (Objectless, r"info\['object'\] is None; expected the number or name of what is presented"),
        (Restless, "trial 0, look 1: object 1; expected 0, that of the whole trial"),
        (Shared, r"a generator that all share was used; expected self\.np_random"),
        (Stale, "look 2: has changed since it was given; expected an array of its own"),
        (Rich, "object 0 has shown 3 patterns; expected at most n_aspects = 2"),
        (Twice, "trial 0, look 0: detection, slot 'top': symbol . is repeated"),
        (Priceless, "trial 0, look 0: reward inf; expected a finite number"),
        (OfOneAction, r"action space Discrete\(1\); expected Discrete\(2\): turn, tip"),
        (FromOne, r"action space Discrete\(2, start=1\); expected Discrete\(2\)"),
        (OfFewerSymbols, "expected whole numbers from -1 to 4 in each of 1 slots: side"),
        (Vague, r"world's assumptions: 'cups'; expected an atg_fg\.Assumptions"),
        (Lasting, "trial 0, look .*; expected the same of the same seed"),
    ],
)
def test_a_fault_is_found_and_said(world, message):
    with pytest.raises(AssertionError, match=message):
        check_world(world())


def test_a_world_of_ones_own_that_keeps_them_is_taken():
    assert check_world(Cups()) == 4 * 21


def test_what_is_no_world_is_refused():
    with pytest.raises(UnknownNameError, match="world: unknown name 'magic'"):
        check_world("magic")
    with pytest.raises(InvalidInputError, match="option 'magic': unknown"):
        check_world("ideal", magic=1)
    with pytest.raises(AssertionError, match=r"expected a gymnasium\.Env"):
        check_world(object())
