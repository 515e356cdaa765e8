"""The engine against an independent reference on a small world, and with a memory that has learned nothing."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.experiments.table1 import TestPlan, run_test, run_tests
from atg_fg.experiments.trial import run_trial
from atg_fg.learning.believed_structure import UncertainObjects
from atg_fg.learning.evidence_learner import BelievedChain
from atg_fg.learning.learner import StructureLearner
from atg_fg.learning.plain_evidence import PlainNoise
from atg_fg.learning.rates import Rates
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.policies import EntropyPolicy
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.registry import make_world
from tests.learning import oracle
from tests.learning.worlds import ARCUBES, CUBE, RING, RING_WORLD, cubes, objects_of, random_objects, trial_of
from tests.models import random_case
from tests.oracle import Oracle

LEARNED = preset("learned")
RATES = Rates(slip=0.05, wrong=0.02, repeat=1e-9, share=1 - 1e-9)
#: |O| = 4, of which two are remembered: U = 2.
CONTENTS = [(0, 1, 2), (0, 3, 1)]


def remembered(objects, n_actions, seed=0, assumptions=ARCUBES, repeats=1):
    """A memory of objects, each met in trials of random actions."""
    memory, rng = StructuredMemory(assumptions), np.random.default_rng(seed)
    for each in objects:
        name = None
        for _ in range(repeats):
            trial = trial_of(each, n_actions, rng)
            patterns = [assumptions.alphabet.index(look) for look in trial.detections]
            name = memory.learn(patterns, list(trial.actions), name)
            memory.learn_shared(name, trial.detections, trial.actions)
    return memory


@pytest.fixture(scope="module")
def ring_memory():
    """Two objects of which all is known, that follow the ring for certain, as nearly as a learner can be."""
    memory = remembered(objects_of(RING, CONTENTS), 14, assumptions=RING_WORLD, repeats=3)
    known = StructureLearner(RING_WORLD)
    known.restore(memory.learner.owners, memory.learner.trials, [RING], RATES)
    memory.learner = known
    memory._gain = -np.inf  # the model in which looks err has no say
    assert known.believed(memory.names)[0].weight > 1 - 1e-6
    return memory


class Reference:
    """p(O | z) by the sum over kinds, contents and poses, and eq. 3 by the sum over next patterns.

    The known objects follow the ring; of what kind a new one is, the learner's shares say.
    """

    def __init__(self, learner):
        self.structure = oracle.Structure(2, RING.sources, 5, Fraction(1, 20), Fraction(1, 50), Fraction(1, 20))
        self.looks, self.actions = [], []
        uncertain = learner.uncertain([])
        share = learner.believed([])[0].share
        sure = LEARNED.transition_concentration, LEARNED.observation_noise
        self.plain = [(uncertain.share, uncertain.noise), (1.0 - share - uncertain.share, sure)]
        self.share = Fraction(share)

    def plain_atg(self, looks, actions, noise):
        """p(looks | a plain ATG of which nothing is known)."""
        trial = Oracle(
            n_objects=1,
            n_aspects=RING_WORLD.n_aspects,
            n_actions=2,
            patterns=self.structure.patterns,
            graphs=[],
            alpha=Fraction(str(noise[0])),
            delta=Fraction(str(noise[1])),
            learn_in_trial=True,
        )
        for time, look in enumerate(looks):
            if time:
                trial.act(actions[time - 1])
            evidence = {z: Fraction(oracle.agrees(look, z)) for z in trial.Z}
            trial.observe(evidence, None if None in look else look)
        return sum(trial.weights.values())

    def joint(self, looks, actions):
        known = [self.structure.probability(each, looks, actions) / 4 for each in CONTENTS]
        plain = [Fraction(share) * self.plain_atg(looks, actions, noise) for share, noise in self.plain]
        return [*known, (self.share * self.structure.fresh(looks, actions) + sum(plain)) / 2]

    def identity(self):
        joint = self.joint(self.looks, self.actions)
        return [float(each / sum(joint)) for each in joint]

    def log_evidence(self):
        return math.log(sum(self.joint(self.looks, self.actions)))

    def expected_entropies(self):
        total = float(sum(self.joint(self.looks, self.actions)))
        result = []
        for action in range(2):
            expected = 0.0
            for pattern in self.structure.patterns:
                joint = np.array(self.joint([*self.looks, pattern], [*self.actions, action]), dtype=float)
                p = joint / joint.sum()
                expected += joint.sum() / total * float(p[-1] * math.log(2) - (p * np.log(p)).sum())
            result.append(expected)
        return result


@pytest.mark.parametrize("seed", range(40))
def test_with_nothing_learned_it_is_the_bayes_filter(seed):
    case = random_case(np.random.default_rng(seed))
    engines = [
        begin_trial("learned-structure", StructuredMemory(case.assumptions, case.memory), replace(p, learn_structure=x))
        for p, x in ((case.parameters, True), (case.parameters, False))
    ]
    engines.append(begin_trial("bayes-filter", case.memory, case.parameters))
    for time, look in enumerate(case.looks):
        try:
            for each in engines:
                each.observe(look.evidence(case.assumptions.alphabet))
        except ImpossibleEvidenceError:
            return
        beliefs = [each.identity() for each in engines]
        for belief, each in zip(beliefs, engines, strict=True):
            # Compiled loops, which only the last of them has, add up in another order.
            np.testing.assert_allclose(belief.objects, beliefs[-1].objects, rtol=0, atol=1e-12)
            assert each.log_evidence == pytest.approx(engines[-1].log_evidence, abs=1e-12)
            np.testing.assert_allclose(each.expected_entropies(), engines[-1].expected_entropies(), rtol=0, atol=1e-12)
        if time < len(case.actions):
            for each in engines:
                each.act(case.actions[time])


@pytest.mark.parametrize(
    ("contents", "missing"),
    [
        pytest.param((0, 1, 2), 0.0, marks=pytest.mark.slow),
        ((0, 3, 1), 0.25),
        pytest.param((4, 2, 3), 0.0, marks=pytest.mark.slow),
    ],
)
def test_it_is_close_to_the_exact_posterior_of_a_small_world(ring_memory, contents, missing):
    trial = trial_of(objects_of(RING, [contents])[0], 3, np.random.default_rng(1), slip=0.05, missing=missing)
    inference, reference = begin_trial("learned-structure", ring_memory, LEARNED), Reference(ring_memory.learner)
    worst = 0.0
    for time, look in enumerate(trial.detections):
        if time:
            inference.act(trial.actions[time - 1])
            reference.actions.append(trial.actions[time - 1])
        inference.observe(Evidence.of_detection(RING_WORLD.alphabet, look))
        reference.looks.append(look)
        belief = inference.identity()
        actual = np.append(belief.objects, belief.unseen)
        worst = max(worst, float(np.abs(actual - reference.identity()).max()))
        assert inference.log_evidence == pytest.approx(reference.log_evidence(), abs=0.02)
        if time < 3:  # the sum over next patterns takes long
            np.testing.assert_allclose(inference.expected_entropies(), reference.expected_entropies(), atol=0.02)
    print(f"worst error of p(O): {worst:.4f}")
    assert worst < 0.01


@pytest.fixture(scope="module")
def cube_memory():
    return remembered(cubes(8), 12)


def played(memory, cube, n_actions, seed=0, **noise):
    inference = begin_trial("learned-structure", memory, LEARNED)
    trial = trial_of(cube, n_actions, np.random.default_rng(seed), **noise)
    for time, look in enumerate(trial.detections):
        if time:
            inference.act(trial.actions[time - 1])
        inference.observe(Evidence.of_detection(ARCUBES.alphabet, look))
    return inference


def test_a_cube_is_known_from_few_looks_and_a_new_one_is_new(cube_memory):
    assert cube_memory.learner.candidates[0] == CUBE
    for number, cube in enumerate(cubes(8)):
        belief = played(cube_memory, cube, 6, seed=number).identity()
        assert belief.objects[number] > 0.95
    assert played(cube_memory, cubes(9)[8], 5).identity().unseen > 0.99


def test_slips_and_wrong_looks_are_borne(cube_memory):
    for number, cube in enumerate(cubes(8)):
        belief = played(cube_memory, cube, 8, seed=number, slip=0.1, wrong=0.02, missing=0.1).identity()
        assert belief.objects[number] > 0.8


def test_probabilities_sum_to_one_and_asking_changes_nothing(cube_memory):
    inference = played(cube_memory, cubes(8)[3], 3, missing=0.3)
    before = inference.identity()
    assert before.objects.sum() + before.unseen == pytest.approx(1, abs=1e-9)
    by_aspects = inference.aspect_belief.sum(axis=1)
    np.testing.assert_allclose(by_aspects, np.append(before.objects, before.unseen), atol=1e-4)
    entropies = inference.expected_entropies()
    assert (entropies <= before.entropy + 1e-3).all()
    for hypothesis in range(9):
        for marginal in inference.smoothed_aspects(hypothesis):
            assert marginal.sum() == pytest.approx(1, abs=1e-9)
    np.testing.assert_array_equal(inference.identity().objects, before.objects)
    np.testing.assert_array_equal(inference.expected_entropies(), entropies)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda inference: pickle.loads(pickle.dumps(inference))])
def test_a_copy_of_what_follows_a_structure_goes_on_by_itself(cube_memory, copied):
    inference, untouched = (played(cube_memory, cubes(8)[3], 3) for _ in range(2))
    other = copied(inference)
    assert other.identity().unseen == untouched.identity().unseen
    other.act(0)
    other.observe(Evidence.of_detection(ARCUBES.alphabet, (0, 1)))
    np.testing.assert_array_equal(inference.identity().objects, untouched.identity().objects)


def test_aspects_are_known_by_their_poses(cube_memory):
    # Smoothed aspects of a cube whose contents are known: the aspect that shows what was seen, where the ATG has it.
    cube = cubes(8)[2]
    inference = played(cube_memory, cube, 6, seed=4)
    for evidence, marginal in zip(inference.history.evidence, inference.smoothed_aspects(2), strict=True):
        state = inference.model.aspect_of[2, evidence.pattern]
        assert marginal[state if state < len(marginal) else 0] > 0.99


def test_where_nothing_is_learned_structure_does_no_harm():
    memory = remembered(random_objects(4, np.random.default_rng(0)), 12)
    plain = RobotMemory(ARCUBES, memory)
    (shown,) = random_objects(1, np.random.default_rng(0))
    trial = trial_of(shown, 8, np.random.default_rng(1))
    engines = begin_trial("learned-structure", memory, LEARNED), begin_trial("bayes-filter", plain, preset("default"))
    for time, look in enumerate(trial.detections):
        for each in engines:
            if time:
                each.act(trial.actions[time - 1])
            each.observe(Evidence.of_detection(ARCUBES.alphabet, look))
        mine, yours = (each.identity() for each in engines)
        np.testing.assert_allclose(mine.objects, yours.objects, atol=0.02)


def test_before_the_first_look_each_kind_is_as_probable_as_the_learner_says_and_asking_changes_nothing(
    cube_memory, monkeypatch
):
    memory, learner = cube_memory.copy(), StructureLearner
    (cube, *_) = memory.learner.believed(memory.names)
    followers, members = np.linspace(0.1, 0.8, 8), np.linspace(0.3, 0.1, 8)
    cube = cube._replace(weight=0.6, followers=followers, share=0.5)
    uncertain = UncertainObjects(PlainNoise(1.0, 1e-3), members, 0.2)
    state = BelievedChain(0.3, np.zeros((3, 1), int), np.array([[0, 1]]), np.full((9, 2, 12), 1 / 12), None, 0.01)
    prior = begin_trial("bayes-filter", RobotMemory(ARCUBES, memory), preset("default")).model.prior
    chains = [state._replace(weight=weight, log_prior=np.log(prior)) for weight in (0.3, 0.7)]
    monkeypatch.setattr(learner, "believed", lambda self, names: [cube])
    monkeypatch.setattr(learner, "uncertain", lambda self, names: uncertain)
    monkeypatch.setattr(type(memory.evidence), "believed", lambda self, names: chains)
    for gain, erring in ((-np.inf, 0.0), (math.log(0.25 / 0.75), 0.25)):
        memory._gain = gain
        asked, other = (begin_trial("learned-structure", memory, LEARNED) for _ in range(2))
        of_cube, of_uncertain = 0.6 * prior @ np.append(followers, 0.5), prior @ np.append(members, 0.2)
        expected = [(1 - erring) * each for each in (of_cube, of_uncertain, 1 - of_cube - of_uncertain)]
        *kinds, plain = asked.kind_belief().values()
        assert [*kinds[:2], plain] == pytest.approx(expected)
        assert sum(kinds[2:]) == pytest.approx(erring)
    for look in ((0, 1), (1, 2)):
        for each in (asked, other):
            if look == (1, 2):
                each.act(0)
            each.kind_belief() if each is asked else None
            each.observe(look)
        assert asked.kind_belief() == other.kind_belief()
    told = asked.kind_explanations(200)
    assert 0.5 < sum(each.probability for each in told) < 1 + 1e-9
    for hypothesis in range(9):
        own = sum(each.probability for each in told if each.hypothesis == hypothesis)
        assert own <= np.append(asked.identity().objects, asked.identity().unseen)[hypothesis] + 1e-9


def test_what_is_felt_counts_alike_for_all_kinds_of_objects():
    felt = replace(RING_WORLD, object_senses=(ObjectSense("weight", 0.5, 0.6, 0.08),))
    memory, rng = StructuredMemory(felt), np.random.default_rng(0)
    for each, reading in zip(objects_of(RING, CONTENTS), (0.3, 0.6), strict=True):
        trial = trial_of(each, 14, rng)
        measured = [(("weight", reading),), *[()] * 14]
        name = memory.learn(
            [felt.alphabet.index(look) for look in trial.detections], list(trial.actions), None, measured=measured
        )
        memory.learn_shared(name, trial.detections, trial.actions, measured=measured)
    learner = StructureLearner(felt)
    learner.restore(memory.learner.owners, memory.learner.trials, [RING], Rates())
    memory.learner, memory._gain = learner, -np.inf
    beliefs = []
    for reading in ((), (("weight", 0.55),)):
        inference = begin_trial("learned-structure", memory, LEARNED)
        likelihood = inference.model.objects.likelihood((("weight", 0.55),))
        inference.observe(replace(Evidence.of_detection(felt.alphabet, (0, None)), measured=reading))
        assert inference.kind_belief()["3 places, 6 poses"] > 0.5
        beliefs.append(np.append(inference.identity().objects, inference.identity().unseen))
    before, after = beliefs
    np.testing.assert_allclose(after, before * likelihood / (before @ likelihood), atol=1e-9)


def test_it_goes_through_a_trial_with_a_world_and_a_policy(cube_memory):
    world = make_world("ideal", cubes=make_arcubes(8, 0))
    inference = begin_trial("learned-structure", cube_memory, LEARNED)
    record = run_trial(world, inference, EntropyPolicy(), 5, np.random.default_rng(0), reset_options={"object": 5})
    assert record.matched == "object-005"


def test_other_engines_refuse_to_learn_structure():
    with pytest.raises(InvalidInputError, match="engine 'gtsam': does not know learn_structure; expected one of: lear"):
        begin_trial("gtsam", RobotMemory(ARCUBES), LEARNED)
    with pytest.raises(InvalidInputError, match="engine 'bayes-filter'"):
        TestPlan(engine="bayes-filter", parameters=LEARNED)


class TestExperiment:
    PLAN = TestPlan(engine="learned-structure", parameters=LEARNED, n_trials=12, n_actions=6)

    def test_it_is_the_same_after_an_interruption_and_in_any_process(self, tmp_path):
        plan = replace(self.PLAN, n_trials=5)
        whole = run_test(plan, 1, tmp_path / "whole")

        def stop(number, record):
            if number == 3:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            run_test(plan, 1, tmp_path / "cut", on_trial=stop)
        assert run_test(plan, 1, tmp_path / "cut", True) == whole
        name = "test-0001.jsonl.gz"
        assert (tmp_path / "cut" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()

    def test_it_beats_learning_each_object_by_itself(self):
        plans = [
            replace(self.PLAN, n_trials=40, n_actions=4, n_objects=20),
            replace(self.PLAN, n_trials=40, n_actions=4, n_objects=20, parameters=preset("default")),
        ]
        learned, default = (result.success[0] for result in run_tests([(plan, 0) for plan in plans]))
        assert learned >= 37
        assert default <= 34

    @pytest.mark.slow
    def test_nearly_all_trials_succeed(self):
        noisy = {"slip": 0.02, "wrong": 0.005}
        for n_actions, noise, least in (
            (10, {}, 99),
            (6, {}, 98),
            (4, {}, 95),
            (10, noisy, 99),
        ):
            plan = replace(self.PLAN, n_trials=100, n_actions=n_actions, world_options=noise)
            results = list(run_tests([(plan, seed) for seed in range(5)], jobs=2))
            assert sum(result.success[0] for result in results) >= 5 * least
