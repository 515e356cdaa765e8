"""Structures that a trial contradicts, and what they are repaired to."""

from dataclasses import replace

import numpy as np
import pytest

from atg_fg.learning.learner import StructureLearner
from atg_fg.learning.likelihood import score_trials
from atg_fg.learning.rates import Rates
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.structure_repair import follows, repairs
from tests.learning.worlds import ARCUBES, CUBE, NEVER, PRISM, RING, cubes, prisms, trial_of

KINDS = {"cube": (CUBE, cubes), "prism": (PRISM, prisms)}


def exchanged(structure, number, one, two):
    """The structure with two entries of one map exchanged."""
    row = list(structure.sources[number])
    row[one], row[two] = row[two], row[one]
    return replace(structure, sources=(*structure.sources[:number], tuple(row), *structure.sources[number + 1 :]))


def trials_of(make, n, seed=0, n_actions=10, **noise):
    rng = np.random.default_rng(seed)
    return [trial_of(each, n_actions, rng, **noise) for each in make(n, seed)]


@pytest.mark.parametrize("kind", KINDS)
def test_trials_without_an_error_follow_their_structure_and_those_with_one_do_not(kind):
    structure, make = KINDS[kind]
    assert all(follows(trial, structure) for trial in trials_of(make, 20))
    erring = trials_of(make, 20, wrong=0.1)
    evidence = score_trials(structure, erring, NEVER, ARCUBES.alphabet).log_evidence  # an error costs 27 nats
    assert [follows(trial, structure) for trial in erring] == (evidence > -35).tolist()
    assert 0 < np.count_nonzero(evidence > -35) < 20


def test_missing_symbols_contradict_nothing():
    assert all(follows(trial, PRISM) for trial in trials_of(prisms, 10, missing=0.3))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(3))
def test_any_two_entries_that_were_exchanged_are_put_back(kind, seed):
    """A fault planted in a map of hidden registers: the first trial that contradicts it names it."""
    structure, make = KINDS[kind]
    rng = np.random.default_rng(seed)
    number = int(rng.integers(len(structure.sources)))
    one, two = rng.choice(np.arange(2, structure.n_registers), 2, replace=False).tolist()
    wrong, trials = exchanged(structure, number, one, two), trials_of(make, 40, seed)
    contradicting = next(trial for trial in trials if not follows(trial, wrong))
    assert repairs(wrong, contradicting, trials)[0] == structure


def test_a_register_holds_one_symbol_and_a_symbol_is_in_one_register():
    turned = [RawTrial(((0, 1), look), (0,)) for look in ((1, 2), (1, 0), (2, 3))]
    assert [follows(trial, RING) for trial in turned] == [True, False, False]


def test_what_no_more_trials_follow_is_no_repair():
    wrong, trials = exchanged(CUBE, 1, 2, 4), trials_of(cubes, 10)
    contradicting = next(trial for trial in trials if not follows(trial, wrong))
    assert repairs(wrong, contradicting, [contradicting])[0] != wrong
    assert repairs(wrong, contradicting, []) == []


def test_what_is_right_is_not_repaired():
    trials = trials_of(prisms, 30)
    slipped = RawTrial((trials[0].detections[0], trials[0].detections[0]), (0,))
    assert not follows(slipped, PRISM)
    assert repairs(PRISM, slipped, [*trials, slipped]) == []


def test_a_learner_repairs_what_it_believes_after_one_trial():
    """Else it would take what contradicts a structure for slips and wrong looks of more and more trials."""
    trials = trials_of(prisms, 40)
    wrong = exchanged(PRISM, 2, 4, 6)
    before = [trial for trial in trials if follows(trial, wrong)][:8]
    learner = StructureLearner(ARCUBES)
    learner.restore([str(number) for number in range(8)], before, [wrong.canonical()], Rates())
    assert learner.believed([])[0].structure == wrong.canonical()
    learner.learn("8", next(trial for trial in trials if not follows(trial, wrong)))
    assert learner.believed([])[0].structure == PRISM
