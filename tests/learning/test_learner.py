import json
import math
from dataclasses import astuple, replace
from fractions import Fraction

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.learning.kinds import choose_kinds
from atg_fg.learning.learner import N_CHAINS, StructureLearner
from atg_fg.learning.milestones import is_milestone
from atg_fg.learning.plain_evidence import SURE, USUAL
from atg_fg.learning.rates import Rates
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.register_search import n_scored
from atg_fg.learning.state_merging import N_DRAWS
from atg_fg.storage.structure_json import read_learner, write_learner
from atg_fg.worlds.families import hexagonal_prisms
from tests.learning.oracle import Structure
from tests.learning.plain_paths import followed
from tests.learning.worlds import (
    ARCUBES,
    CUBE,
    PRISM,
    RING,
    RING_WORLD,
    Object,
    cubes,
    objects_of,
    prisms,
    random_objects,
    trial_of,
    uncertain_object,
    uncertain_trial,
)


def learned(objects, order, seed=0, n_actions=10, assumptions=ARCUBES, **noise):
    """A learner that has met objects in an order; each is known by its number."""
    rng = np.random.default_rng(seed)
    learner = StructureLearner(assumptions)
    for number in order:
        learner.learn(str(number), trial_of(objects[number], n_actions, rng, **noise))
    return learner


def test_the_cubes_structure_is_learned_from_three_trials():
    learner = learned(cubes(3), range(3))
    (best, *_) = learner.believed(["0", "1", "2"])
    assert best.structure == CUBE
    assert best.weight > 0.9
    assert (best.followers > 0.99).all()
    assert learner.gain > 50


def test_where_there_is_no_structure_none_is_believed_and_the_search_is_bounded():
    rng = np.random.default_rng(0)
    learner = learned(random_objects(15, rng), range(15))
    weights = [each.weight for each in learner.believed([])]
    assert sum(weights) < 0.02
    milestones = sum(is_milestone(n) for n in range(1, 16))
    annealed, merged = milestones * n_scored(2, 3, N_CHAINS), (milestones - 5) * (N_DRAWS[0] + 35 * N_DRAWS[1])
    assert learner.n_evaluations == annealed + merged


def test_of_half_and_half_each_object_is_told_apart():
    rng = np.random.default_rng(1)
    objects = [*cubes(10), *random_objects(10, rng)]
    learner = learned(objects, rng.permutation(20))
    best = learner.believed([str(number) for number in range(20)])[0]
    assert best.structure == CUBE
    assert (best.followers[:10] > 0.99).all()
    assert (best.followers[10:] < 0.01).all()
    assert learner.rates.share == pytest.approx(0.5, abs=0.15)


@pytest.mark.slow
def test_prisms_are_learned_with_their_two_modes():
    learner = learned(prisms(13), range(13))
    best = learner.believed(["0", "12"])[0]
    assert best.structure == PRISM
    assert best.weight > 0.99
    assert (best.followers > 0.99).all()


@pytest.fixture(scope="module")
def mixed():
    order = np.random.default_rng(0).permutation(22)
    return learned([*cubes(7), *prisms(15)], order)


@pytest.mark.slow
def test_each_object_of_two_kinds_is_of_its_own(mixed):
    believed = {each.structure: each for each in mixed.believed([str(number) for number in range(22)])}
    assert believed.keys() == {CUBE, PRISM}
    assert (believed[CUBE].followers > 0.99).tolist() == [True] * 7 + [False] * 15
    assert (believed[PRISM].followers > 0.99).tolist() == [False] * 7 + [True] * 15
    assert believed[CUBE].share == pytest.approx(8 / 25, abs=0.02)
    assert believed[PRISM].share == pytest.approx(16 / 25, abs=0.02)
    assert {each.weight for each in believed.values()} == {1.0}


@pytest.mark.slow
def test_kinds_are_better_than_any_structure_alone(mixed):
    alone = [choose_kinds([each], mixed._of_plain(), mixed.rates)[0] for each in mixed._candidates]
    assert mixed._sets[0].log_evidence > max(each.log_evidence for each in alone) + 50


@pytest.mark.slow
def test_kinds_are_the_same_after_they_were_kept(mixed):
    document = json.loads(json.dumps(write_learner(mixed)))
    names = [str(number) for number in range(22)]
    again = read_learner(document, ARCUBES, names, "here")
    assert again.same_as(mixed)
    for mine, yours in zip(mixed.believed(names), again.believed(names), strict=True):
        assert mine.structure == yours.structure
        assert mine.followers == pytest.approx(yours.followers)
        assert mine.share == pytest.approx(yours.share)


@pytest.mark.slow
def test_rates_are_learned_with_the_structure():
    rng = np.random.default_rng(2)
    order = rng.integers(20, size=40)
    clean, noisy = (learned(cubes(20), order, slip=slip, wrong=wrong) for slip, wrong in ((0, 0), (0.05, 0.01)))
    assert clean.candidates[0] == noisy.candidates[0] == CUBE
    assert clean.rates.slip < 0.005
    assert clean.rates.wrong < 0.002
    assert noisy.rates.slip == pytest.approx(0.05, abs=0.025)
    assert noisy.rates.wrong == pytest.approx(0.01, abs=0.007)


def test_an_action_that_fails_all_through_some_trials_makes_no_kind_of_its_own():
    """In each eighth trial a cube slips out of every flip: it is a cube, and its flips fail together."""
    rng, learner = np.random.default_rng(1), StructureLearner(ARCUBES)
    for number, cube in enumerate(cubes(40)):
        successors = np.array(cube.successors)
        if number % 8 == 0:
            successors[:, 0] = range(24)
        learner.learn(str(number), trial_of(Object(cube.patterns, successors), 10, rng))
    (best,) = learner.believed([str(number) for number in range(40)])
    assert best.structure == CUBE
    assert best.followers.min() > 0.99
    assert learner.rates.slip < 0.03
    assert learner.rates.slip_again > 0.8
    document = json.loads(json.dumps(write_learner(learner)))
    assert read_learner(document, ARCUBES, learner.owners, "here").rates == learner.rates


def test_structure_and_contents_come_of_looks_with_gaps():
    learner = learned(cubes(15), range(15), missing=0.15)
    best = learner.believed([str(number) for number in range(15)])[0]
    assert best.structure == CUBE
    assert (best.contents.max(axis=2) > 0.9).mean() > 0.85


@pytest.mark.slow
def test_tags_that_come_twice_are_learned():
    beside = {b for a, b in CUBE.poses().registers[:, :2].tolist() if a == 0}
    (opposite,) = set(range(1, 6)) - beside
    rng = np.random.default_rng(3)
    contents = [rng.permutation(12)[:6] for _ in range(24)]
    for each in contents[::3]:
        each[opposite] = each[0]
    learner = learned(objects_of(CUBE, contents), range(24))
    best = learner.believed([str(number) for number in range(24)])[0]
    assert best.structure == CUBE
    assert learner.rates.repeat > Rates().repeat
    assert (best.followers > 0.99).all()


def test_a_small_world_of_another_structure_is_learned():
    rng = np.random.default_rng(4)
    contents = [rng.permutation(5)[:3].tolist() for _ in range(10)]
    learner = learned(objects_of(RING, contents), range(10), n_actions=8, assumptions=RING_WORLD)
    assert learner.candidates[0] == RING


def test_it_is_deterministic():
    order = [0, 1, 0, 2, 3, 1]
    one, other = (learned(cubes(4), order, slip=0.05) for _ in range(2))
    assert one.same_as(other)
    assert not one.same_as(learned(cubes(4), order, seed=1, slip=0.05))
    for mine, yours in zip(one.believed(["0", "3"]), other.believed(["0", "3"]), strict=True):
        assert mine.weight == yours.weight
        np.testing.assert_array_equal(mine.contents, yours.contents)


def test_an_object_of_which_there_is_no_trial_follows_nothing():
    best = learned(cubes(3), range(3)).believed(["0", "stranger"])[0]
    assert best.followers[0] > 0.99
    assert best.followers[1] == 0
    assert not best.contents[1].any()


def test_trials_that_change_hands_are_learned_from_as_if_they_had_always_been_of_their_objects():
    rng, names = np.random.default_rng(0), ["two", "new", "one"]
    objects = [
        *objects_of(RING, [(0, 1, 2), (0, 3, 1)]),
        Object([(0, 2), (3, 4), (4, 1)], rng.integers(3, size=(3, 2)).tolist()),
    ]
    trials = [trial_of(objects[number % 3], 8, rng) for number in range(9)]
    learner, anew = StructureLearner(RING_WORLD), StructureLearner(RING_WORLD)
    learner.restore(["one"] * 5 + ["two"] * 4, trials, [RING], Rates())
    before = learner.believed(names)[0]
    learner.hand_over({1: "two", 4: "two", 5: "new", 6: "one", 8: "new"})
    anew.restore(["one", "two", "one", "one", "two", "new", "one", "two", "new"], trials, [RING], Rates())
    (mine,), (yours,) = learner.believed(names), anew.believed(names)
    assert not np.allclose(mine.contents, before.contents)
    for found, expected in zip(mine[1:], yours[1:], strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-12)
    for found, expected in zip(learner.uncertain(names)[1:], anew.uncertain(names)[1:], strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-12)
    assert learner.gain == pytest.approx(anew.gain)


def test_in_whatever_order_objects_are_asked_for_each_has_its_own_contents():
    contents = [(0, 1, 2), (3, 4, 0), (2, 0, 4)]
    rng, learner = np.random.default_rng(0), StructureLearner(RING_WORLD)
    trials = [trial_of(each, 12, rng) for each in objects_of(RING, contents * 2)]
    learner.restore(["0", "1", "2"] * 2, trials, [RING], Rates())
    (best, *_), (again, *_) = learner.believed(["0", "1", "2"]), learner.believed(["2", "nobody", "0"])
    for name, own in zip("012", best.contents, strict=True):
        assert sorted(own.argmax(axis=1).tolist()) == sorted(contents[int(name)])
    np.testing.assert_array_equal(again.contents[[0, 2]], best.contents[[2, 0]])
    np.testing.assert_array_equal(again.followers[[0, 2]], best.followers[[2, 0]])
    of_plain = choose_kinds([], learner._of_plain(), learner.rates)[0].log_evidence
    assert learner.gain == pytest.approx(learner._sets[0].log_evidence - of_plain)
    # Against the model in which looks err it is weighed by objects never met, however trials are filed.
    apart = StructureLearner(RING_WORLD)
    apart.restore(list("012345"), trials, [RING], Rates())
    assert learner.log_evidence == pytest.approx(apart.log_evidence)
    assert learner.gain > apart.gain + 1
    learner.settle()
    assert learner.rates.share == pytest.approx((1 + 3) / (2 + 3), abs=0.005)
    assert learner.rates.slip == pytest.approx(1 / (100 + 6 * 12), rel=0.02)


def test_sets_of_kinds_are_believed_in_by_their_evidence_and_followers_are_those_of_the_set():
    trials = [trial_of(each, 3, np.random.default_rng(0)) for each in cubes(2)]
    learner = StructureLearner(ARCUBES)
    learner.restore(["0", "1"], trials, [CUBE], Rates())
    sets = {each.structures: each for each in learner._sets}
    (cube,) = learner.believed(["0", "1"])
    odds = math.exp(sets[(0,)].log_evidence - sets[()].log_evidence)
    assert 0.01 < cube.weight < 0.99
    assert cube.weight == pytest.approx(odds / (1 + odds))
    assert cube.share == pytest.approx(sets[(0,)].trials.shares[-1])
    np.testing.assert_allclose(cube.followers, sets[(0,)].trials.responsibilities[:, -1], atol=0.02)


def test_a_restored_learner_goes_on_as_the_old_one_would():
    rng = np.random.default_rng(5)
    old = learned(cubes(6), [0, 1, 2, 0, 3, 4, 1, 5, 2], slip=0.02)
    new = StructureLearner(ARCUBES)
    new.restore(old.owners, old.trials, old.candidates, old.rates)
    for number in (1, 3, 5):
        trial = trial_of(cubes(6)[number], 10, rng)
        old.learn(str(number), trial)
        new.learn(str(number), trial)
    assert old.candidates == new.candidates
    of_old, of_new = (astuple(replace(each, slip_again=each.slips[1])) for each in (old.rates, new.rates))
    np.testing.assert_allclose(of_old, of_new, rtol=1e-6)
    names = [str(number) for number in range(6)]
    for mine, yours in zip(old.believed(names), new.believed(names), strict=True):
        np.testing.assert_allclose(mine.contents, yours.contents, atol=1e-6)
        np.testing.assert_allclose(mine.weight, yours.weight, atol=1e-6)


def test_milestones_come_ever_more_rarely():
    milestones = [n for n in range(1, 101) if is_milestone(n)]
    assert milestones == [1, 2, 3, 4, 5, 6, 7, 8, 10, 13, 17, 22, 28, 35, 44, 55, 69, 87]


@pytest.mark.parametrize("rate", [0.0, 1.0, True, "much", float("nan")])
@pytest.mark.parametrize("name", ["slip", "slip_again"])
def test_a_rate_is_between_0_and_1(name, rate):
    with pytest.raises(InvalidInputError, match=f"rate {name}: {rate!r}"):
        Rates(**{name: rate})


@pytest.mark.parametrize("name", ["slip", "wrong", "repeat", "share"])
def test_only_slips_after_slips_may_have_no_rate(name):
    assert Rates(slip_again=None).slips == (0.01, 0.01)
    with pytest.raises(InvalidInputError, match=f"rate {name}: None"):
        Rates(**{name: None})


def test_a_structure_that_is_nearly_right_is_not_believed_beside_the_right_one():
    # What an action does to a prism's sides depends on whether it stands, so that no permutation of few registers
    # explains it without taking every sixth look for an error; with two modes each look is explained.
    family = hexagonal_prisms(60, 0)
    objects = [Object(each.patterns, each.mechanism.successors[:, :, 0]) for each in family.objects]
    learner = learned(objects, range(60), seed=1)
    (best,) = learner.believed(["0"])
    assert best.structure == PRISM
    assert best.weight > 0.99


@pytest.fixture(scope="module")
def unsure():
    """A learner of 3 cubes and of 3 objects whose actions are uncertain, which it took for another one each time."""
    rng = np.random.default_rng(0)
    known, others = cubes(3), [uncertain_object(rng) for _ in range(3)]
    learner = StructureLearner(ARCUBES)
    for number in range(12):
        learner.learn(f"cube {number % 3}", trial_of(known[number % 3], 10, rng))
        learner.learn(f"other {number}", uncertain_trial(others[number % 3], 10, rng))
    return learner


def test_objects_whose_actions_are_uncertain_are_a_kind_of_their_own(unsure):
    names = [f"cube {number}" for number in range(3)] + [f"other {number}" for number in range(12)]
    uncertain = unsure.uncertain(names)
    (cube,) = unsure.believed(names)
    assert cube.structure == CUBE
    assert (uncertain.members[:3] < 0.01).all()
    assert (uncertain.members[3:] > 0.5).mean() > 0.8
    assert uncertain.share > 0.3
    assert uncertain.noise.concentration >= 0.3
    assert unsure._unexplained() == list(range(1, 24, 2))


def plain_atg(before, trial, noise):
    """p(trial | the plain ATG that the trials before it made), by every path in exact fractions."""
    oracle = followed(replace(RING_WORLD, n_objects=2), before, trial, noise)
    weights = [weight for (hypothesis, _), weight in oracle.weights.items() if hypothesis == 0]
    return sum(weights) * (2 if before else 1)  # without an ATG hypothesis 0 is of all objects


#: Looks of the ring that slips once, or of a plain object that stays as it is once.
DOUBTFUL = [((4, 2), (4, 2), (3, 4)), ((0, 2), (3, 0), (3, 0)), ((0, 2), (0, 2))]


def test_of_which_kind_a_remembered_object_is_sums_over_contents_poses_and_aspects():
    rng, rates = np.random.default_rng(3), Rates(slip=0.05, wrong=0.02, repeat=1e-9)
    sure = objects_of(RING, [(0, 1, 2), (0, 3, 1)])
    owners = ["sure 0", "sure 1"] * 3 + ["once", "twice", "twice"]
    trials = [trial_of(sure[number % 2], 14, rng) for number in range(6)]
    trials += [RawTrial(looks, (0, 0)[: len(looks) - 1]) for looks in DOUBTFUL]
    learner = StructureLearner(RING_WORLD)
    learner.restore(owners, trials, [RING], rates)
    (followed,) = [each for each in learner.believed(["once", "twice"]) if each.weight > 1 - 1e-6]
    uncertain = learner.uncertain(["once", "twice"])
    exact = Structure(2, RING.sources, 5, Fraction(1, 20), Fraction(1, 50), Fraction(1, 20))
    shares = [1.0 - followed.share - uncertain.share, uncertain.share, followed.share]
    for number, of in enumerate((trials[6:7], trials[7:])):
        each_kind, before = np.array(shares), [(trial.detections, trial.actions) for trial in of]
        for later, trial in enumerate(of):
            plain = [plain_atg(of[:later], trial, noise) for noise in (SURE, uncertain.noise)]
            each_kind *= [*map(float, plain), float(exact.again(before[:later], *before[later]))]
        each_kind /= each_kind.sum()
        assert 0.01 < each_kind[2] < 0.99
        # What was known of an object is kept register by register, not of all of them together.
        assert followed.followers[number] == pytest.approx(each_kind[2], abs=0.015)
        assert uncertain.members[number] == pytest.approx(each_kind[1], abs=0.015)


def test_of_an_object_without_a_trial_its_kind_is_as_of_any_plain_one(unsure):
    uncertain = unsure.uncertain(["nobody"])
    assert uncertain.share < uncertain.members[0] < 1.0
    assert StructureLearner(ARCUBES).uncertain([]) is None


def test_uncertain_actions_are_the_same_after_they_were_kept(unsure):
    document = json.loads(json.dumps(write_learner(unsure)))
    assert document["uncertain"] == unsure.noise._asdict() if unsure.noise != USUAL else "uncertain" not in document
    document["uncertain"] = {"concentration": 0.6, "noise": 0.001}
    names = list(dict.fromkeys(unsure.owners))
    twin = read_learner(document, ARCUBES, names, "memory")
    assert tuple(twin.noise) == (0.6, 0.001)
    assert not twin.same_as(unsure)
    for wrong in ({"concentration": 7.0, "noise": 0.001}, {"concentration": -1.0, "noise": 0.0}, {"noise": 0.001}, 3):
        with pytest.raises(InvalidInputError, match=r"memory\.uncertain"):
            read_learner({**document, "uncertain": wrong}, ARCUBES, names, "memory")
