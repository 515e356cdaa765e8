"""Annealing by exact evidence."""

import numpy as np
import pytest

from atg_fg.core.patterns import MISSING
from atg_fg.learning.kernels import TrialArrays
from atg_fg.learning.likelihood import NEW
from atg_fg.learning.plain_evidence import PlainEvidence
from atg_fg.learning.raw_trials import Recording
from atg_fg.learning.register_search import n_scored, search_registers
from atg_fg.learning.shared_structure import SharedStructure
from tests.learning.worlds import ARCUBES, BOX, CUBE, RING, RING_WORLD, cubes, objects_of, random_objects, trial_of


def found(trials, assumptions=ARCUBES, seed=0, n_chains=3):
    recording = Recording.of(trials, assumptions.alphabet.n_symbols)
    labels, symbols = recording.labels[..., None], np.arange(assumptions.alphabet.n_symbols)
    looks = np.where(labels == symbols, 0.99, 0.01 / (len(symbols) - 1))
    looks = np.where(labels == MISSING, 1.0, looks)
    plain = PlainEvidence(assumptions)
    plain.catch_up(trials, [str(number) for number in range(len(trials))])
    sizes = len(assumptions.alphabet.slots), len(assumptions.actions), n_chains
    arrays = TrialArrays(looks, recording.actions, recording.lengths)
    return search_registers(arrays, plain.log_evidence[NEW, :, 0], *sizes, np.random.default_rng(seed))


def cube_trials(n, seed, n_actions=10, **noise):
    rng = np.random.default_rng(seed)
    return [trial_of(each, n_actions, rng, **noise) for each in cubes(n, seed)]


@pytest.mark.parametrize("seed", range(3))
def test_the_cubes_structure_is_found_from_a_few_trials(seed):
    assert found(cube_trials(4, seed), seed=seed)[0] == CUBE


def test_it_is_found_in_spite_of_slips_wrong_looks_and_gaps():
    assert found(cube_trials(20, 5, slip=0.02, wrong=0.005, missing=0.05))[0] == CUBE


def test_it_is_found_beside_objects_that_do_not_follow_it():
    rng = np.random.default_rng(0)
    others = [trial_of(each, 10, rng) for each in random_objects(8, rng)]
    assert found([*others, *cube_trials(8, 1)])[0] == CUBE


def test_other_structures_are_found_too():
    rng = np.random.default_rng(0)
    objects = objects_of(RING, [rng.permutation(5)[:3].tolist() for _ in range(12)])
    assert found([trial_of(each, 8, rng) for each in objects], RING_WORLD)[0] == RING


@pytest.mark.parametrize("seed", range(3))
def test_irreversible_actions_are_found(seed):
    rng = np.random.default_rng(seed)
    objects = objects_of(BOX, [rng.permutation(5)[:4].tolist() for _ in range(20)])
    assert BOX in found([trial_of(each, 8, rng) for each in objects], RING_WORLD)[:4]


def test_the_best_is_first_and_none_comes_twice():
    structures = found(cube_trials(6, 0), n_chains=1)
    assert len(set(structures)) == len(structures) <= 2 * 7
    assert all(isinstance(each, SharedStructure) and each.canonical() == each for each in structures)


def test_the_same_generator_finds_the_same():
    trials = cube_trials(3, 0)
    assert found(trials, seed=7, n_chains=1) == found(trials, seed=7, n_chains=1)


def test_it_says_how_much_it_does():
    # For 2 to 8 registers of 3 actions: a move scores P candidates, or 2 P where sources are copied, too.
    squares = sum(size**2 for size in range(2, 9))
    assert n_scored(2, 3, 1) == 3 * squares * (40 + 2 * 12)
    assert n_scored(2, 3, 3) == 3 * squares * (120 + 2 * 12)
