import numpy as np
import pytest

from benchmarks.contestants import Contestant, follow
from benchmarks.measuring import alternate, median_of, ratios, repeats_for, spread
from benchmarks.memories import course_for, remembered


class FakeClock:
    """A clock that only moves when it is told to."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def wait(self, seconds):
        self.now += seconds


class Slow(Contestant):
    """Every call takes a time of its own; decisions take longer and longer."""

    name, preset = "slow", "paper"

    def __init__(self, clock):
        self.clock, self.calls = clock, []

    def begin(self):
        self.calls.append("begin")
        self.clock.wait(1000)

    def look(self, evidence):
        self.calls.append(("look", evidence.pattern))
        self.clock.wait(1)

    def act(self, action):
        self.calls.append(("act", action))
        self.clock.wait(2)

    def decide(self):
        self.clock.wait(10 * (1 + sum(call == "decide" for call in self.calls)))
        self.calls.append("decide")

    def identity(self):
        return np.ones(1)


def test_contestants_take_turns_and_another_one_begins_each_round():
    turns = []

    def taking(name, seconds):
        def sample():
            turns.append(name)
            return {"decision": seconds.pop(0)}

        return sample

    times = {"a": [1.0, 2.0, 3.0], "b": [10.0, 10.0, 60.0], "c": [5.0, 5.0, 5.0]}
    taken = alternate({name: taking(name, list(seconds)) for name, seconds in times.items()}, 3)
    assert turns == ["a", "b", "c", "b", "c", "a", "c", "a", "b"]
    assert taken == {name: {"decision": seconds} for name, seconds in times.items()}


def test_ratios_are_taken_round_by_round():
    # The medians are 10 and 2; a slow second round meets both, and the ratio does not see it.
    assert ratios([10.0, 50.0, 10.0], [2.0, 10.0, 4.0]) == [5.0, 5.0, 2.5]


def test_a_spread_is_median_and_quartiles():
    assert spread([5.0, 1.0, 2.0, 4.0, 3.0]) == {"median": 3.0, "quartiles": [2.0, 4.0]}
    assert spread([7.0]) == {"median": 7.0, "quartiles": [7.0, 7.0]}


def test_the_median_is_taken_of_each_quantity():
    samples = [{"step": 1.0, "trial": 9.0}, {"step": 3.0, "trial": 7.0}, {"step": 2.0, "trial": 8.0}]
    assert median_of(samples) == {"step": 2.0, "trial": 8.0}


def test_what_is_quick_is_repeated():
    assert repeats_for(0.01, 0.2, 50) == 20
    assert repeats_for(0.001, 0.2, 50) == 50
    assert repeats_for(3.0, 0.2, 50) == 1
    assert repeats_for(0.0, 0.2, 50) == 50


def test_steps_decisions_and_the_whole_trial_are_told_apart():
    clock = FakeClock()
    contestant = Slow(clock)
    course = course_for(remembered(1), 3)
    seconds = follow(contestant, course, clock)
    assert seconds == {"step": 3, "decision": 20, "first decision": 10, "last decision": 30, "trial": 1070}
    looks, actions = course.patterns, course.actions
    assert contestant.calls == [
        "begin",
        ("look", looks[0]),
        *(call for time in range(3) for call in ("decide", ("act", actions[time]), ("look", looks[time + 1]))),
    ]


@pytest.mark.parametrize("n_rounds", [0, 2])
def test_nobody_to_measure_is_no_mistake(n_rounds):
    assert alternate({}, n_rounds) == {}
