"""The filter against exact fractions: exact where it says so, and how far off where it does not."""

import itertools
import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from atg_fg.learning.likelihood import score_trials
from atg_fg.learning.rates import AGAIN, FAILED_BEFORE, SLIP, Rates
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure
from tests.learning import oracle
from tests.learning.completions import exact_log_evidence
from tests.learning.worlds import ARCUBES, BOX, CUBE, DOUBLE, NEVER, RING, RING_WORLD, cubes, objects_of, trial_of

ALPHABET = RING_WORLD.alphabet
#: Slips and wrong looks as often as on a bad robot.
OFTEN = Rates(slip=0.05, wrong=0.02, repeat=1e-12)
#: Slips come together, too.
TOGETHER = Rates(slip=0.05, slip_again=0.5, wrong=0.02, repeat=1e-12)
ROTATION = SharedStructure(2, ((1, 2, 3, 0),))


def oracle_of(structure, n_symbols, rates):
    slip, slip_again, wrong = (Fraction(str(rate)) for rate in (*rates.slips, rates.wrong))
    return oracle.Structure(structure.n_slots, structure.sources, n_symbols, slip, wrong, slip_again)


def trials_of(structure, n, seed, n_actions=5, **noise):
    rng = np.random.default_rng(seed)
    contents = [rng.permutation(5)[: structure.n_registers].tolist() for _ in range(n)]
    return contents, [trial_of(each, n_actions, rng, **noise) for each in objects_of(structure, contents)]


@pytest.mark.parametrize("missing", [0.0, 0.3])
@pytest.mark.parametrize("structure", [RING, BOX], ids=["ring", "box"])
def test_objects_whose_contents_are_known_are_filtered_exactly(structure, missing):
    contents, trials = trials_of(structure, 10, seed=1, slip=0.2, wrong=0.1, missing=missing)
    known = np.eye(5)[np.array(contents)]
    scores = score_trials(structure, trials, OFTEN, ALPHABET, known)
    exact = oracle_of(structure, 5, OFTEN)
    expected = [
        math.log(exact.probability(tuple(each), trial.detections, trial.actions))
        for each, trial in zip(contents, trials, strict=True)
    ]
    np.testing.assert_allclose(scores.log_evidence, expected, rtol=0, atol=1e-7)
    np.testing.assert_allclose(scores.contents, known, atol=1e-12)


@pytest.mark.parametrize("missing", [0.0, 0.3])
@pytest.mark.parametrize("structure", [RING, BOX], ids=["ring", "box"])
def test_how_far_off_the_mean_of_what_failed_before_is(structure, missing):
    contents, trials = trials_of(structure, 40, seed=1, n_actions=8, slip=0.3, wrong=0.1, missing=missing)
    scores = score_trials(structure, trials, TOGETHER, ALPHABET, np.eye(5)[np.array(contents)])
    exact = oracle_of(structure, 5, TOGETHER)
    errors = np.abs(
        [
            score - math.log(exact.probability(tuple(each), trial.detections, trial.actions))
            for score, each, trial in zip(scores.log_evidence, contents, trials, strict=True)
        ]
    )
    print(f"error of ln p(trial), missing {missing}: mean {errors.mean():.3f}, worst {errors.max():.3f} nats")
    assert errors.max() < 0.3
    assert errors.mean() < 0.02


def test_an_action_that_fails_in_a_row_is_filtered_exactly():
    """Looks are never wrong, so that which actions failed is known, and a fresh ring shows all it has."""
    rates = Rates(slip=0.05, slip_again=0.5, wrong=1e-12, repeat=1e-12)
    looks = ((0, 1), (0, 1), (0, 1), (1, 2), (1, 2), (2, 0))
    trial = RawTrial(looks, (0, 0, 0, 1, 0))
    turned = score_trials(RING, [trial], rates, ALPHABET)
    exact = replace(oracle_of(RING, 5, rates), wrong=Fraction(0))
    expected = math.log(exact.fresh(trial.detections, trial.actions))
    assert turned.log_evidence[0] == pytest.approx(expected, abs=1e-7)


def test_a_pose_that_shows_one_register_twice_explains_no_look():
    contents, trials = trials_of(RING, 10, seed=1, slip=0.2, wrong=0.1)
    exact = oracle_of(DOUBLE, 5, OFTEN)
    expected = [
        math.log(exact.probability(tuple(each), trial.detections, trial.actions))
        for each, trial in zip(contents, trials, strict=True)
    ]
    actual = score_trials(DOUBLE, trials, OFTEN, ALPHABET, np.eye(5)[np.array(contents)]).log_evidence
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-4)  # rows below 1e-9 are dropped


@pytest.mark.parametrize("structure", [RING, BOX], ids=["ring", "box"])
def test_a_new_object_is_filtered_exactly_if_nothing_goes_wrong(structure):
    # A new box may be met with its lid on or off.
    _, trials = trials_of(structure, 10, seed=2)
    scores = score_trials(structure, trials, NEVER, ALPHABET)
    exact = oracle_of(structure, 5, NEVER)
    expected = [math.log(exact.fresh(trial.detections, trial.actions)) for trial in trials]
    np.testing.assert_allclose(scores.log_evidence, expected, rtol=0, atol=1e-7)


@pytest.mark.parametrize("structure", [RING, BOX], ids=["ring", "box"])
@pytest.mark.parametrize(("missing", "worst", "usual"), [(0.0, 0.5, 0.05), (0.3, 0.5, 0.1)])
def test_how_far_off_the_mean_of_merged_contents_is(structure, missing, worst, usual):
    # Slips and wrong looks leave contents in doubt: errors in nats of log evidences of about -10.
    _, trials = trials_of(structure, 40, seed=3, slip=0.05, wrong=0.02, missing=missing)
    scores = score_trials(structure, trials, OFTEN, ALPHABET)
    exact = [exact_log_evidence(structure, trial, OFTEN, ALPHABET) for trial in trials]
    errors = np.abs(scores.log_evidence - exact)
    print(f"error of ln p(trial), missing {missing}: mean {errors.mean():.3f}, worst {errors.max():.3f} nats")
    assert errors.max() < worst
    assert errors.mean() < usual


@pytest.mark.parametrize("structure", [RING, ROTATION, BOX], ids=["ring", "rotation", "box"])
def test_the_sum_over_all_contents_is_that_of_plain_loops(structure):
    rng = np.random.default_rng(4)
    (shown,) = objects_of(structure, [rng.permutation(5)[: structure.n_registers].tolist()])
    exact = oracle_of(structure, 5, OFTEN)
    for _ in range(2):
        trial = trial_of(shown, 3, rng, slip=0.2, wrong=0.2, missing=0.2)
        actual = exact_log_evidence(structure, trial, OFTEN, ALPHABET)
        assert actual == pytest.approx(math.log(exact.fresh(trial.detections, trial.actions)), abs=1e-12)


def test_with_modes_it_is_the_sum_over_every_mode_arrangement_and_contents():
    # Its loops know of no poses: a walk through the maps themselves, from every mode and arrangement that is reached.
    structure = SharedStructure(2, ((1, 0, 2), (1, 2, 0), (0, 1, 2), (0, 2, 1)), ((1, 0), (0, 1)))
    rng = np.random.default_rng(7)
    reached = [(0, (0, 1, 2))]
    for mode, places in reached:
        for action in range(2):
            target, sources = structure.step(mode, action)
            new = target, tuple(places[source] for source in sources)
            reached += [new] if new not in reached else []
    contents = list(itertools.permutations(range(5), 3))
    for (shown,) in (objects_of(structure, [rng.permutation(5)[:3].tolist()]) for _ in range(6)):
        trial = trial_of(shown, 4, rng)
        explained = 0
        for (mode, places), symbols in itertools.product(reached, contents):
            seen = [tuple(symbols[place] for place in places[:2])]
            for action in trial.actions:
                mode, sources = structure.step(mode, action)
                places = tuple(places[source] for source in sources)
                seen.append(tuple(symbols[place] for place in places[:2]))
            explained += tuple(seen) == trial.detections
        expected = math.log(explained / len(reached) / len(contents))
        (actual,) = score_trials(structure, [trial], NEVER, ALPHABET).log_evidence
        assert actual == pytest.approx(expected, abs=1e-7)


def test_trials_of_different_lengths_are_scored_as_they_are_alone():
    rng = np.random.default_rng(5)
    trials = [
        trial_of(each, n_actions, rng, slip=0.1, missing=missing)
        for each, n_actions, missing in zip(cubes(6), (3, 8, 3, 0, 8, 1), (0, 0, 0.3, 0, 0.3, 1.0), strict=True)
    ]
    together = score_trials(CUBE, trials, Rates(), ARCUBES.alphabet)
    for number, trial in enumerate(trials):
        alone = score_trials(CUBE, [trial], Rates(), ARCUBES.alphabet)
        assert together.log_evidence[number] == pytest.approx(alone.log_evidence[0], abs=1e-5)
        np.testing.assert_allclose(together.contents[number], alone.contents[0], atol=1e-5)
        np.testing.assert_allclose(together.events[number], alone.events[0], atol=1e-5)


def test_a_look_at_nothing_says_nothing():
    blind = trial_of(cubes(1)[0], 6, np.random.default_rng(0), missing=1.0)
    scores = score_trials(CUBE, [blind], Rates(), ARCUBES.alphabet)
    assert scores.log_evidence[0] == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(scores.contents, 0, atol=1e-9)


def test_a_clean_trial_of_a_cube_reveals_its_tags():
    cube = cubes(1)[0]
    trial = trial_of(cube, 40, np.random.default_rng(0))
    contents = score_trials(CUBE, [trial], Rates(), ARCUBES.alphabet).contents[0]
    tags = contents.argmax(axis=1)
    assert (contents.max(axis=1) > 0.99).all()
    shown = {tuple(tags[registers[:2]].tolist()) for registers in CUBE.poses().registers}
    assert shown == set(cube.patterns)


def test_slips_and_wrong_looks_are_counted():
    rng = np.random.default_rng(6)
    trials = [trial_of(each, 20, rng, slip=0.1, wrong=0.02) for each in cubes(30)]
    events = score_trials(CUBE, trials, Rates(), ARCUBES.alphabet).events.sum(axis=0)
    slips, wrong, repeats, reveals, again, n_failed_before = events
    assert slips == pytest.approx(60, abs=25)  # of 600 actions; the few that leave what is in view are not seen
    assert wrong == pytest.approx(12.6, abs=10)
    assert reveals == pytest.approx(180, abs=10)
    assert repeats < 10
    assert again == pytest.approx(6, abs=6)  # a tenth of
    assert n_failed_before == pytest.approx(56, abs=25)  # slips, but for the last ones of their action


def test_slips_after_slips_are_counted():
    """What is seen tells all: of six turns the first, second and fourth fail, and the last swap."""
    looks = ((0, 1), (0, 1), (0, 1), (1, 2), (1, 2), (2, 1), (1, 0), (0, 2), (0, 2))
    trial = RawTrial(looks, (0, 0, 0, 0, 1, 0, 0, 1))
    rates = Rates(slip=0.05, slip_again=0.5, wrong=1e-12, repeat=1e-12)
    (events,) = score_trials(RING, [trial], rates, ALPHABET, np.eye(5)[[[0, 1, 2]]]).events
    assert (events[SLIP], events[AGAIN], events[FAILED_BEFORE]) == pytest.approx((4, 1, 3), abs=1e-6)


def test_a_repeated_tag_is_held_for_less_probable_but_possible():
    beside = {b for a, b in CUBE.poses().registers[:, :2].tolist() if a == 0}
    (opposite,) = set(range(1, 6)) - beside
    contents = [0, 1, 2, 3, 4, 5]
    contents[opposite] = 0
    trials = [trial_of(each, 30, np.random.default_rng(1)) for each in objects_of(CUBE, [range(6), contents])]
    rates = Rates(repeat=0.02)
    never = Rates(repeat=1e-9)
    usual, repeated = score_trials(CUBE, trials, rates, ARCUBES.alphabet).log_evidence
    _, refused = score_trials(CUBE, trials, never, ARCUBES.alphabet).log_evidence
    assert usual - 10 < repeated < usual
    assert refused < repeated - 3
