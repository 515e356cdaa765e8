"""Evidence of plain ATGs against the Bayes filter, and against the sum over every path of aspects."""

import itertools
import math

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import begin_trial
from atg_fg.learning.likelihood import BEFORE, FILED, NEW
from atg_fg.learning.plain_evidence import SURE, UNCERTAIN, USUAL, PlainEvidence
from atg_fg.learning.raw_trials import RawTrial
from tests.learning.plain_paths import followed
from tests.learning.worlds import ARCUBES, cubes, trial_of, uncertain_object, uncertain_trial

SMALL = Assumptions(3, 3, ("turn", "tip"), PatternAlphabet(("front",), 4))


def small_trial(symbols, actions):
    return RawTrial(tuple((symbol,) for symbol in symbols), tuple(actions))


def exactly(trial, before, noise):
    """ln p(trial | the object of ``before``), ln p(trial | another), ln p(trial), by every path in exact fractions."""
    oracle = followed(SMALL, [before], trial, noise)
    weight = [sum(w for (i, _), w in oracle.weights.items() if i == number) for number in (0, 1)]
    return math.log(weight[0] * 3), math.log(weight[1] * 3 / 2), math.log(sum(weight))


@pytest.mark.parametrize("seed", range(6))
def test_small_cases_are_the_sum_over_every_path(seed):
    rng = np.random.default_rng(seed)
    trials = [small_trial(rng.integers(4, size=5).tolist(), rng.integers(2, size=4).tolist()) for _ in range(2)]
    evidence = PlainEvidence(SMALL)
    evidence.catch_up(trials, ["it", "it"])
    for column, noise in enumerate([SURE, *UNCERTAIN]):
        own, fresh, summed = exactly(trials[1], trials[0], noise)
        assert evidence.log_evidence[FILED, 1, column] == pytest.approx(own, abs=1e-9)
        assert evidence.log_evidence[NEW, 1, column] == pytest.approx(fresh, abs=1e-9)
        assert evidence.log_evidence[BEFORE, 1, column] == pytest.approx(summed, abs=1e-9)


@pytest.mark.parametrize("missing", [0.0, 0.3])
def test_the_evidence_of_all_trials_is_that_of_the_bayes_filter(missing):
    rng = np.random.default_rng(0)
    objects = cubes(3)
    trials = [trial_of(objects[number], 10, rng, missing=missing) for number in (0, 1, 2, 0, 1, 2)]
    owners = ["0", "1", "2", "0", "1", "2"]
    evidence, memory = PlainEvidence(ARCUBES), RobotMemory(ARCUBES)
    evidence.catch_up(trials[:2], owners[:2])
    evidence.catch_up(trials, owners)
    for number, (trial, owner) in enumerate(zip(trials, owners, strict=True)):
        for column in (0, 1, 1 + UNCERTAIN.index(USUAL)):
            noise = [SURE, *UNCERTAIN][column]
            filtering = begin_trial("bayes-filter", memory, ModelParameters(*noise))
            for time, look in enumerate(trial.detections):
                if time:
                    filtering.act(trial.actions[time - 1])
                filtering.observe(Evidence.of_detection(ARCUBES.alphabet, look))
            # Objects that share next to nothing with a trial are left out of the sum.
            assert evidence.log_evidence[BEFORE, number, column] == pytest.approx(
                filtering.log_evidence, abs=0.2 if missing else 0.02
            )
        patterns = [Evidence.of_detection(ARCUBES.alphabet, look).pattern for look in trial.detections]
        memory.learn(patterns, list(trial.actions), owner if owner in memory.names else None)
        memory.rename(memory.names[-1], owner) if owner not in memory.names else None


def test_where_actions_are_uncertain_that_is_what_the_trials_say():
    rng = np.random.default_rng(0)
    unsure, sure = [uncertain_object(rng) for _ in range(3)], cubes(3)
    trials = [uncertain_trial(unsure[number % 3], 12, rng) for number in range(9)]
    trials += [trial_of(sure[number % 3], 12, rng) for number in range(9)]
    evidence = PlainEvidence(ARCUBES)
    # Filed as objects of their own, as a robot does that does not yet know that actions are uncertain.
    evidence.catch_up(trials, list(map(str, range(18))))
    table = evidence.of_kinds(USUAL)
    uncertain, gain = table[:9].sum(axis=0), table[9:].sum(axis=0) @ (1, -1)
    assert uncertain[1] > uncertain[0] + 50
    assert gain > 5
    assert evidence.best_noise(np.repeat([1.0, 0.0], 9)).concentration >= 0.3


def test_noise_is_what_explains_most():
    rng = np.random.default_rng(1)
    unsure = uncertain_object(rng, n_states=4, n_successors=4)
    evidence = PlainEvidence(ARCUBES)
    evidence.catch_up([uncertain_trial(unsure, 12, rng) for _ in range(8)], ["it"] * 8)
    best = evidence.best_noise(np.ones(8))
    totals = dict(
        zip(itertools.chain([SURE], UNCERTAIN), evidence.log_evidence[BEFORE].sum(axis=0).tolist(), strict=True)
    )
    assert totals[best] > max(totals[SURE] + 50, totals[UNCERTAIN[0]])


def test_looks_at_nothing_say_nothing():
    evidence = PlainEvidence(ARCUBES)
    evidence.catch_up([RawTrial(((None, None), (None, None)), (0,))], ["it"])
    assert evidence.log_evidence[NEW] == pytest.approx(0.0)


def test_what_was_forgotten_has_no_say_in_what_comes_after():
    trials = [small_trial(looks, (0, 1)) for looks in ((0, 1, 2), (0, 2, 1), (0, 1, 2))]
    again, anew = PlainEvidence(SMALL), PlainEvidence(SMALL)
    again.catch_up(trials, ["one", "one", "two"])
    again.forget()
    for each in (again, anew):
        each.catch_up(trials, ["one", "two", "two"])
    np.testing.assert_array_equal(again.log_evidence, anew.log_evidence)


def test_of_many_objects_a_trial_may_be_of_those_that_share_most_with_it():
    many = Assumptions(30, 4, ("turn",), PatternAlphabet(("front",), 30))
    trials = [small_trial((0, 1, 2, 3), (0, 0, 0)), *(small_trial((0, 1, n, n), (0, 0, 0)) for n in range(4, 16))]
    filed, unfiled = PlainEvidence(many), PlainEvidence(many)
    for evidence, owner in ((filed, "0"), (unfiled, "another")):
        evidence.catch_up([*trials, trials[0]], [*map(str, range(13)), owner])
    assert unfiled.log_evidence[BEFORE, -1, 0] == pytest.approx(
        filed.log_evidence[FILED, -1, 0] - math.log(30), abs=1e-3
    )


@pytest.mark.parametrize("noise", UNCERTAIN[::5])
def test_noise_is_that_of_trials_whose_objects_are_summed_out(noise):
    evidence = PlainEvidence(SMALL)
    assert evidence.best_noise(np.zeros(0)) == USUAL  # it costs nothing beforehand
    table = evidence.log_evidence = np.zeros((3, 2, 1 + len(UNCERTAIN)))
    table[BEFORE, 0, 1 + UNCERTAIN.index(noise)] = 1.0
    table[BEFORE, 1, 1], table[FILED, 0, 1] = 9.0, 9.0  # of another trial, and of what was taken for the object
    assert evidence.best_noise(np.array([1.0, 0.0])) == noise
