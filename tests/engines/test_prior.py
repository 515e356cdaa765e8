"""A prior p(O) of one's own, zeros included, and p(O, X_t) as every engine tells it."""

from fractions import Fraction

import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import ENGINES, begin_trial
from atg_fg.inference.interface import Inference
from tests.models import Case, random_case
from tests.oracle import ImpossibleError, Oracle
from tests.small import every_exact_engine, graph, one_slot, seen

WORLD = one_slot(4, 2, 4)
NOISY = ModelParameters(0.1, 0.1)
every_engine = pytest.mark.parametrize("engine", ENGINES)


def two_objects() -> RobotMemory:
    """Push swaps the two aspects of either object: A shows 0 and 1, B shows 1 and 2."""
    swaps = (0, 0, 1, 1), (1, 0, 0, 1)
    return RobotMemory(WORLD, [graph(WORLD, "A", [(0,), (1,)], *swaps), graph(WORLD, "B", [(1,), (2,)], *swaps)])


def belief(*probabilities: float, n_unseen: int = 2) -> IdentityBelief:
    return IdentityBelief.of(np.array(probabilities), n_unseen)


class OracleWithPrior(Oracle):
    """The oracle of a case, with a prior of one's own."""

    weights: tuple[int, ...] = ()

    def prior(self, i: int) -> Fraction:
        return Fraction(self.weights[i], sum(self.weights))


def oracle_of(case: Case, weights: tuple[int, ...]) -> Oracle:
    kind = type("GivenOracle", (OracleWithPrior,), {"weights": weights})
    plain = case.oracle
    oracle: Oracle = kind(
        n_objects=case.n_objects,
        n_aspects=case.n_aspects,
        n_actions=case.n_actions,
        patterns=case.patterns,
        graphs=case.graphs,
        alpha=plain.alpha,
        delta=plain.delta,
        learn_in_trial=case.learn_in_trial,
    )
    return oracle


def cases_with_prior(n_cases: int) -> list[tuple[Case, tuple[int, ...]]]:
    """Random models, each with weights of a prior of which about a third are zero."""
    result = []
    for seed in range(n_cases):
        rng = np.random.default_rng([17, seed])
        case = random_case(rng)
        weights = rng.choice([0, 1, 3], len(case.graphs) + 1)
        weights[rng.integers(len(weights))] = 2
        result.append((case, tuple(int(weight) for weight in weights)))
    return result


def assert_agrees(inference: Inference, oracle: Oracle) -> None:
    identity = [float(p) for p in oracle.identity()]
    np.testing.assert_allclose(inference.identity().probabilities, identity, rtol=0, atol=1e-12)
    assert inference.log_evidence == pytest.approx(oracle.log_evidence(), rel=0, abs=1e-12)
    expected = np.zeros(inference.aspect_belief.shape)
    for i in np.flatnonzero(identity):
        for x, p in oracle.smoothed(i)[-1].items():
            expected[i, oracle.state_number(i, x)] = identity[i] * float(p)
    np.testing.assert_allclose(inference.aspect_belief, expected, rtol=0, atol=1e-12)


@every_exact_engine
def test_exact_engines_start_from_a_given_prior(engine: str) -> None:
    n_zeros = 0
    for case, weights in cases_with_prior(40):
        oracle = oracle_of(case, weights)
        memory = case.memory
        prior = belief(*(np.array(weights) / sum(weights)), n_unseen=memory.n_unseen)
        inference = begin_trial(engine, memory, case.parameters, prior)
        n_zeros += weights.count(0)
        for time, look in enumerate(case.looks):
            evidence = look.evidence(case.assumptions.alphabet)
            try:
                oracle.observe(look.likelihood(case.patterns), look.complete)
            except ImpossibleError:
                with pytest.raises(ImpossibleEvidenceError):
                    inference.observe(evidence)
                break
            inference.observe(evidence)
            assert_agrees(inference, oracle)
            entropies = [oracle.expected_entropy(action) for action in range(case.n_actions)]
            np.testing.assert_allclose(inference.expected_entropies(), entropies, rtol=0, atol=1e-12)
            if time < len(case.actions):
                oracle.act(case.actions[time])
                inference.act(case.actions[time])
                assert_agrees(inference, oracle)
    assert n_zeros >= 20


@every_engine
def test_before_the_first_look_the_belief_is_the_given_prior(engine: str) -> None:
    inference = begin_trial(engine, two_objects(), NOISY, belief(0.0, 0.25, 0.75))
    np.testing.assert_array_equal(inference.identity().probabilities, [0.0, 0.25, 0.75])
    np.testing.assert_allclose(inference.aspect_belief.sum(axis=1), [0.0, 0.25, 0.75], rtol=0, atol=1e-15)


# Mean field puts a floor under the logarithm of every joint probability.
@pytest.mark.parametrize("engine", sorted(set(ENGINES) - {"mean-field"}))
@pytest.mark.parametrize("learn", [False, True])
def test_an_object_that_is_ruled_out_stays_so(engine: str, learn: bool) -> None:
    inference = begin_trial(engine, two_objects(), ModelParameters(0.1, 0.1, learn), belief(0.0, 0.5, 0.5))
    for symbol in (0, 1, 0):
        inference.observe(seen(WORLD, symbol))
        assert inference.identity().objects[0] == 0
        assert not inference.aspect_belief[0].any()
        assert np.isfinite(inference.expected_entropies()).all()
        inference.act(0)
    with pytest.raises(ImpossibleEvidenceError, match="prior probability zero"):
        inference.smoothed_aspects(0)


@every_engine
def test_evidence_that_only_a_ruled_out_object_gives_is_impossible(engine: str) -> None:
    # Without noise, B cannot show 0.
    inference = begin_trial(engine, two_objects(), ModelParameters(1.0, 0.0), belief(0.5, 0.5, 0.0))
    ruled_out = begin_trial(engine, two_objects(), ModelParameters(1.0, 0.0), belief(0.0, 1.0, 0.0))
    inference.observe(seen(WORLD, 0))
    with pytest.raises(ImpossibleEvidenceError):
        ruled_out.observe(seen(WORLD, 0))


@every_engine
def test_the_prior_of_the_memory_given_is_the_same_as_none(engine: str) -> None:
    given, plain = (begin_trial(engine, two_objects(), NOISY, prior) for prior in (belief(0.25, 0.25, 0.5), None))
    for inference in (given, plain):
        inference.observe(seen(WORLD, 1))
        inference.act(0)
        inference.observe(seen(WORLD, 0))
    np.testing.assert_array_equal(given.identity().probabilities, plain.identity().probabilities)


@every_engine
@pytest.mark.parametrize("learn", [False, True])
def test_aspect_and_identity_belief_agree(engine: str, learn: bool) -> None:
    inference = begin_trial(engine, two_objects(), ModelParameters(0.1, 0.1, learn), belief(0.5, 0.2, 0.3))
    for symbol in (1, 2, 1, 3):
        inference.observe(seen(WORLD, symbol))
        for _ in range(2):
            joint = inference.aspect_belief
            assert joint.shape == (3, inference.model.n_states)
            assert joint.sum() == pytest.approx(1, rel=0, abs=1e-12)
            np.testing.assert_allclose(joint.sum(axis=1), inference.identity().probabilities, rtol=0, atol=1e-12)
            if not inference.history.awaits_evidence:
                inference.act(0)


@every_engine
@pytest.mark.parametrize(
    "prior",
    [
        belief(0.5, 0.5),
        belief(0.25, 0.25, 0.25, 0.25),
        belief(0.25, 0.25, 0.5, n_unseen=3),
        belief(-0.5, 0.5, 1.0),
        belief(0.5, 0.5, 1e-8),
        belief(0.0, 0.0, 0.0),
        belief(float("nan"), 0.5, 0.5),
        belief(float("inf"), 0.5, 0.5),
        IdentityBelief(np.ones((2, 1)) / 4, 0.5, 2),
    ],
)
def test_a_prior_that_is_no_distribution_over_these_objects_is_refused(engine: str, prior: IdentityBelief) -> None:
    with pytest.raises(InvalidInputError, match="belief"):
        begin_trial(engine, two_objects(), NOISY, prior)


@every_engine
def test_a_prior_may_be_off_by_rounding(engine: str) -> None:
    inference = begin_trial(engine, two_objects(), NOISY, belief(0.25, 0.25, 0.5 + 1e-10))
    assert inference.identity().probabilities.sum() == pytest.approx(1, rel=0, abs=1e-15)


@every_engine
def test_an_empty_memory_has_a_prior_too(engine: str) -> None:
    memory = RobotMemory(WORLD, list[AspectTransitionGraph]())
    inference = begin_trial(engine, memory, NOISY, belief(1.0, n_unseen=4))
    inference.observe(seen(WORLD, 0))
    assert inference.identity().unseen == pytest.approx(1)
    assert inference.aspect_belief.sum() == pytest.approx(1)
