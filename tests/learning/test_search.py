import numpy as np
import pytest

from atg_fg.learning.quick_score import QuickScore
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.search import SearchPlan, propose_structures
from atg_fg.learning.shared_structure import SharedStructure
from tests.learning.worlds import ARCUBES, BOX, CUBE, RING, RING_WORLD, cubes, objects_of, trial_of


def cube_trials(n, seed, n_actions=10, **noise):
    rng = np.random.default_rng(seed)
    return [trial_of(each, n_actions, rng, **noise) for each in cubes(n, seed)]


def scores(structure, trials, assumptions=ARCUBES):
    return QuickScore(trials, assumptions)(np.array([structure.sources]))[0]


def test_trials_that_follow_the_structure_score_by_their_contents_alone():
    trials = cube_trials(5, 0)
    revealed = [len({symbol for look in trial.detections for symbol in look}) for trial in trials]
    expected = [-sum(np.log(12 - np.arange(n))) for n in revealed]
    np.testing.assert_allclose(scores(CUBE, trials), expected)


def test_a_structure_that_is_not_the_cubes_scores_less():
    trials = cube_trials(5, 0)
    swapped = SharedStructure(2, (CUBE.sources[1], CUBE.sources[0], CUBE.sources[2]))
    assert scores(swapped, trials).sum() < scores(CUBE, trials).sum() - 50


def test_candidates_are_scored_as_they_are_alone():
    trials = [*cube_trials(3, 1), *cube_trials(2, 2, n_actions=4, missing=0.3)]
    rng = np.random.default_rng(0)
    sources = np.array([[rng.permutation(6) for _ in range(3)] for _ in range(4)])
    together = QuickScore(trials, ARCUBES)(sources)
    for candidate, row in zip(sources, together, strict=True):
        for trial, score in zip(trials, row, strict=True):
            assert QuickScore([trial], ARCUBES)(candidate[None])[0, 0] == pytest.approx(score)


@pytest.mark.parametrize("seed", range(3))
def test_the_cubes_structure_is_found_from_a_few_trials(seed):
    found = propose_structures(cube_trials(10, seed), ARCUBES, np.random.default_rng(seed))
    assert found.structures[0] == CUBE


def test_it_is_found_in_spite_of_slips_wrong_looks_and_gaps():
    trials = cube_trials(20, 5, slip=0.02, wrong=0.005, missing=0.05)
    assert propose_structures(trials, ARCUBES, np.random.default_rng(0)).structures[0] == CUBE


def test_other_structures_are_found_too():
    rng = np.random.default_rng(0)
    objects = objects_of(RING, [rng.permutation(5)[:3].tolist() for _ in range(12)])
    found = propose_structures([trial_of(each, 8, rng) for each in objects], RING_WORLD, rng)
    assert found.structures[0] == RING


@pytest.mark.parametrize("seed", range(3))
def test_irreversible_actions_are_found(seed):
    rng = np.random.default_rng(seed)
    objects = objects_of(BOX, [rng.permutation(5)[:4].tolist() for _ in range(20)])
    found = propose_structures([trial_of(each, 8, rng) for each in objects], RING_WORLD, rng)
    assert found.structures[0] == BOX


def test_a_trial_that_begins_after_an_irreversible_action_is_explained_from_there():
    # The front is 0, the top 1: open from the beginning, where opening changes nothing.
    opened, turned = ((0, 1), (0, 1)), ((0, 1), (2, 1), (2, 1), (0, 1))
    score = QuickScore([RawTrial(opened, (0,)), RawTrial(turned, (1, 0, 1))], RING_WORLD)
    sources = np.array([BOX.sources])
    revealed = -np.cumsum(np.log([5, 4, 3]))
    np.testing.assert_allclose(score.from_any_start(sources), [revealed[[1, 2]]])
    assert (score(sources) < revealed[[1, 2]] - 5).all()
    permutations = np.array([RING.sources])
    np.testing.assert_array_equal(score.from_any_start(permutations), score(permutations))


def test_the_same_generator_finds_the_same():
    trials = cube_trials(3, 0)
    first, second = (propose_structures(trials, ARCUBES, np.random.default_rng(7)) for _ in range(2))
    assert first == second


def test_the_search_is_bounded_and_says_how_much_it_did():
    plan = SearchPlan(max_hidden=2, n_chains=2, n_steps=5, n_copying_steps=4)
    found = propose_structures(cube_trials(3, 0), ARCUBES, np.random.default_rng(0), plan=plan)
    assert found.n_evaluations == (5 * 2 + 4) * (2 + 3 + 4)
    assert len(set(found.structures)) == len(found.structures) <= 9
    assert all(structure.canonical() == structure for structure in found.structures)


def test_it_begins_from_what_is_known():
    plan = SearchPlan(n_chains=1, n_steps=1, coldest=1e-9, hottest=1e-9)
    found = propose_structures(cube_trials(3, 0), ARCUBES, np.random.default_rng(0), plan=plan, incumbents=[CUBE])
    assert found.structures[0] == CUBE


def test_nothing_comes_of_nothing():
    assert propose_structures([], ARCUBES, np.random.default_rng(0)).structures == ()


def test_long_trials_are_cut():
    trial = RawTrial(tuple((0, 1) for _ in range(12)), tuple(range(11)))
    pieces = trial.pieces(5)
    assert [len(piece.actions) for piece in pieces] == [5, 5]
    assert [piece.actions for piece in pieces] == [(0, 1, 2, 3, 4), (6, 7, 8, 9, 10)]
    assert RawTrial(((0, 1),), ()).pieces(5) == [RawTrial(((0, 1),), ())]
