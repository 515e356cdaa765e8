"""Structures read off from trials that merge."""

import itertools

import numpy as np
import pytest

from atg_fg.learning import state_merging
from atg_fg.learning.kernels import TrialArrays
from atg_fg.learning.map_kernels import anneal_maps, fresh_trials, map_log_evidence, no_maps
from atg_fg.learning.merging_kernels import Automaton, add, unite
from atg_fg.learning.raw_trials import RawTrial, Recording
from atg_fg.learning.shared_structure import is_permutation
from atg_fg.learning.state_merging import Merged, mode_automata
from atg_fg.learning.state_merging import merge_states as merge_into
from tests.learning.worlds import CUBE, PRISM, PRISM_MODES, RING, cubes, objects_of, prisms, random_objects, trial_of

ONE_MODE = ((0, 0, 0),)


def merge_states(trials, next_modes):
    return merge_into(trials, [next_modes])[0]


def trials_of(objects, seed=0, n_actions=10):
    rng = np.random.default_rng(seed)
    return [trial_of(each, n_actions, rng) for each in objects]


@pytest.mark.parametrize(
    ("other", "is_possible"),
    [((0, 2, 1), True), ((1, 2, 1), False), ((0, 1, 1), False), ((0, 2, 0), False)],
    ids=["another look", "another mode", "another place", "another symbol of one look"],
)
def test_what_cannot_be_one_state_is_none(other, is_possible):
    def table(*shape):
        return np.zeros(shape, dtype=np.int64)

    columns = (table(2), table(2), table(2), table(2, 1), table(2), table(2, 9), table(2, 9), table(2), table(9, 2))
    automaton = Automaton(*columns, table(3))
    one, two = add(automaton, 0, 2, 0), add(automaton, *other)
    assert unite(automaton, one, two, table(9, 2)) == is_possible


@pytest.mark.parametrize("seed", range(3))
def test_trials_of_cubes_merge_into_the_cube(seed):
    merged = merge_states(trials_of(cubes(12, seed), seed), ONE_MODE)
    assert merged.structure == CUBE
    assert merged.n_trials == 12


def test_small_rings_merge_into_the_ring():
    rng = np.random.default_rng(0)
    objects = objects_of(RING, [rng.permutation(5)[:3] for _ in range(4)])
    assert merge_states(trials_of(objects, n_actions=8), ((0, 0),)).structure == RING.canonical()


@pytest.mark.parametrize("seed", range(3))
def test_trials_of_prisms_merge_into_the_prism_with_its_two_modes_alone(seed):
    trials = trials_of(prisms(12, seed), seed)
    assert merge_states(trials, ONE_MODE) is None
    automata = mode_automata(2, 3)
    found = {modes: merged for modes, merged in zip(automata, merge_into(trials, automata), strict=True) if merged}
    assert list(found) == [PRISM_MODES]
    assert found[PRISM_MODES].structure == PRISM
    assert len(PRISM.poses().registers) == 24


def test_objects_that_share_nothing_do_not_merge():
    trials = trials_of(random_objects(12, np.random.default_rng(0)))
    for automata in (mode_automata(1, 3), mode_automata(2, 3)):
        assert merge_into(trials, automata) == [None] * len(automata)


def test_a_trial_with_a_fault_is_left_out():
    trials = trials_of(cubes(12))
    looks = list(trials[6].detections)
    looks[5] = looks[5][::-1]
    trials[6] = RawTrial(tuple(looks), trials[6].actions)
    merged = merge_states(trials, ONE_MODE)
    assert (merged.structure, merged.n_trials) == (CUBE, 11)


@pytest.mark.parametrize("n_trials", [4, 8])
@pytest.mark.parametrize("seed", range(2))
def test_exact_evidence_of_all_trials_has_nothing_to_mend(n_trials, seed):
    """Those with errors too, which merging leaves out: annealing that begins with what merged stays there."""
    rng = np.random.default_rng(seed)
    trials = [trial_of(each, 10, rng, slip=0.02, wrong=0.005) for each in cubes(n_trials, seed)]
    merged = merge_states(trials, ONE_MODE)
    assert merged.n_trials < n_trials
    recording, sources, prior = Recording.of(trials, 12), np.array(merged.structure.sources), np.full(12, 1 / 12)
    looks = np.where(recording.labels[..., None] == np.arange(12), 0.99, 0.01 / 11)
    arrays = TrialArrays(looks, recording.actions, recording.lengths)
    fresh = fresh_trials(arrays, np.full(n_trials, -60.0), 2, prior)
    before, cold = map_log_evidence(fresh, sources), np.array([1.0, 20.0])
    after = anneal_maps(fresh, no_maps(len(sources)), sources, cold, False, 0.0, np.random.default_rng(0))
    assert after == before
    assert sources.tolist() == list(map(list, CUBE.sources))


def test_actions_that_were_exchanged_are_found_out():
    """A fault planted in what was done rather than in what was seen."""
    trials = trials_of(cubes(12))
    exchanged = tuple({0: 1, 1: 0}.get(action, action) for action in trials[4].actions)
    trials[4] = RawTrial(trials[4].detections, exchanged)
    assert merge_states(trials, ONE_MODE).n_trials == 11


def test_looks_with_missing_symbols_or_one_twice_are_passed_over():
    trials = trials_of(cubes(12))
    trials[2] = RawTrial(((None, 3), *trials[2].detections[1:]), trials[2].actions)
    trials[3] = RawTrial(((3, 3), *trials[3].detections[1:]), trials[3].actions)
    assert merge_states(trials, ONE_MODE).n_trials == 10
    assert merge_states(trials[2:4], ONE_MODE) is None


def test_the_order_of_trials_does_not_matter_where_all_agree():
    trials = trials_of(prisms(12))
    assert merge_states(trials[::-1], PRISM_MODES).structure == PRISM


def test_what_no_trial_says_is_filled_up_with_permutations():
    merged = merge_states([RawTrial(((0, 1), (2, 0)), (1,)), RawTrial(((5, 4), (3, 5)), (1,))], ONE_MODE)
    assert merged.n_trials == 2
    assert all(map(is_permutation, merged.structure.sources))


def test_mode_automata_are_all_up_to_the_names_of_modes():
    assert mode_automata(1, 3) == (ONE_MODE,)
    found = mode_automata(2, 2)
    # Of 16 automata of two modes and two actions one keeps the modes apart; 0 and 1 exchanged they pair up.
    assert len(found) == len(set(found))
    assert ((0, 1), (1, 0)) in found or ((1, 0), (0, 1)) in found
    assert ((0, 0), (1, 1)) not in found


def test_of_what_draws_merge_into_the_best_is_what_most_trials_follow_and_then_the_most_probable(monkeypatch):
    found = itertools.cycle([Merged(RING, 3), Merged(PRISM, 9), Merged(CUBE, 9), None, Merged(CUBE, 4)])
    monkeypatch.setattr(state_merging, "merge_states", lambda trials, automata: [next(found)])
    merged, n_tried = state_merging.merged_draws(trials_of(cubes(12)), 3, np.random.default_rng(0))
    assert merged == [CUBE, PRISM, RING]
    assert n_tried == sum(state_merging.N_DRAWS)  # nine of twelve trials are not yet most
