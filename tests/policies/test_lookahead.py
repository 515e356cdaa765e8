import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import begin_trial
from atg_fg.inference.expected_entropy import best_actions
from atg_fg.policies import EntropyPolicy, LookaheadPolicy, make_policy
from atg_fg.policies.lookahead import bounds_ahead
from tests.models import gone_through, random_case
from tests.small import every_exact_engine, graph, one_slot, trial

N_CASES = 40


def by_enumeration(oracle, horizon):
    """V_horizon by first action, from the oracle: every pattern of every action, one after the other."""
    belief = {}
    for (i, xs), weight in oracle.weights.items():
        belief[i, xs[-1]] = belief.get((i, xs[-1]), 0) + weight
    total = sum(belief.values())
    belief = {state: float(weight / total) for state, weight in belief.items()}
    states = [(i, x) for i in range(oracle.K + 1) for x in oracle.states(i)]
    shows = {(i, x, z): float(oracle.observation(i, x, z)) for i, x in states for z in oracle.Z}
    leads = {
        (i, x, a): [(y, float(oracle.transition(i, x, a, y))) for y in oracle.states(i)]
        for i, x in states
        for a in range(oracle.n_actions)
    }

    def value(belief, action, horizon):
        predicted = dict.fromkeys(states, 0.0)
        for (i, x), weight in belief.items():
            for y, probability in leads[i, x, action]:
                predicted[i, y] += weight * probability
        expected = 0.0
        for z in oracle.Z:
            joint = {(i, y): weight * shows[i, y, z] for (i, y), weight in predicted.items() if weight > 0}
            p = sum(joint.values())
            if p > 0:
                after = {state: weight / p for state, weight in joint.items() if weight > 0}
                expected += p * (entropy(after) if horizon == 1 else min(values(after, horizon - 1)))
        return expected

    def entropy(belief):
        identity = [0.0] * (oracle.K + 1)
        for (i, _), weight in belief.items():
            identity[i] += weight
        return oracle._entropy_of(identity)

    def values(belief, horizon):
        return [value(belief, action, horizon) for action in range(oracle.n_actions)]

    return values(belief, horizon)


def looked(case):
    """The case up to its first look, in an engine and in the oracle, or ``None`` if that is impossible."""
    inference, oracle = begin_trial("bayes-filter", case.memory, case.parameters), case.oracle
    look = case.looks[0]
    try:
        inference.observe(look.evidence(case.assumptions.alphabet))
    except InvalidInputError:
        return None
    oracle.observe(look.likelihood(case.patterns), look.complete)
    return inference, oracle


def small_cases():
    rng = np.random.default_rng(4)
    found = (looked(case) for case in (random_case(rng) for _ in range(3 * N_CASES)) if len(case.patterns) <= 6)
    return [pair for pair in found if pair is not None]


def random_trials():
    """Engines in the middle of random trials, with the case."""
    rng = np.random.default_rng(5)
    cases = [random_case(rng) for _ in range(N_CASES)]
    return [(case, gone_through("bayes-filter", case)) for case in cases if len(case.looks) > len(case.actions)]


def test_one_action_ahead_is_expected_entropy():
    for case, inference in random_trials():
        np.testing.assert_allclose(
            LookaheadPolicy(1).bounds(inference).high, inference.expected_entropies(), rtol=0, atol=1e-12
        )
        for engine in ("gtsam", "enumeration"):
            other = gone_through(engine, case)
            np.testing.assert_allclose(
                other.belief_tree().expected_entropies(), other.expected_entropies(), rtol=0, atol=1e-12
            )


def test_each_action_s_looks_mean_what_expected_entropy_says():
    for _, inference in random_trials():
        tree = inference.belief_tree()
        for action, expected in enumerate(inference.expected_entropies()):
            looks = tree.after(action)
            assert looks.probabilities.sum() == pytest.approx(1, abs=1e-12)
            assert looks.probabilities @ looks.entropies == pytest.approx(expected, abs=1e-12)


def test_looks_taken_together_are_those_taken_one_by_one():
    for _, inference in random_trials():
        looks = inference.belief_tree().after(0)
        possible = np.flatnonzero(looks.probabilities > 0)
        together = looks.expected_entropies(possible)
        one_by_one = [looks.belief(int(look)).expected_entropies() for look in possible]
        np.testing.assert_allclose(together, one_by_one, rtol=0, atol=1e-10)
        some = possible[::2]
        np.testing.assert_allclose(looks.expected_entropies(some), together[::2], rtol=0, atol=1e-12)


@pytest.mark.parametrize("horizon", [1, 2])
def test_it_is_the_enumeration_of_all_that_can_be_seen_and_done(horizon):
    pairs = small_cases()
    assert len(pairs) > N_CASES / 2
    for inference, oracle in pairs:
        expected = np.array(by_enumeration(oracle, horizon))
        assert exact_value(inference, horizon) == pytest.approx(expected.min(), abs=1e-10)
        low, high = LookaheadPolicy(horizon).bounds(inference)
        assert (low <= expected + 1e-10).all()
        assert (high >= expected - 1e-10).all()
        assert (expected[best_actions(high)] <= expected.min() + 3e-9).all()
        if horizon == 2:
            np.testing.assert_allclose(two_ahead(inference), expected, rtol=0, atol=1e-10)


def test_three_actions_ahead_is_the_enumeration_too():
    pairs = [pair for pair in small_cases() if len(pair[1].Z) <= 5 and pair[1].n_actions <= 2][:12]
    assert len(pairs) >= 8
    for inference, oracle in pairs:
        assert exact_value(inference, 3) == pytest.approx(min(by_enumeration(oracle, 3)), abs=1e-10)


def exact_value(inference, horizon):
    """V_horizon, without stopping once the decision is clear."""
    return bounds_ahead(inference.belief_tree(), horizon, [0.0]).high.min()


def two_ahead(inference):
    """V_2 by first action, where every look is followed."""
    values = []
    for action in range(inference.model.n_actions):
        looks = inference.belief_tree().after(action)
        possible = np.flatnonzero(looks.probabilities > 0)
        values.append(looks.probabilities[possible] @ looks.expected_entropies(possible).min(axis=1))
    return values


def test_looking_further_ahead_never_expects_more():
    for _, inference in random_trials():
        values = [exact_value(inference, horizon) for horizon in (1, 2, 3)]
        assert values[1] <= values[0] + 1e-9
        assert values[2] <= values[1] + 1e-9


def detour():
    """Two objects that look alike; only by turning first, which tells nothing, can pushing tell them apart.

    Both show 0. Turning leads both to 1, from where pushing shows 2 or 3. Pushing at 0 leads both to 0. Spinning tells
    something at once: it leads the first object to 4 three times in four, and else, as always the second, to 0.
    """
    assumptions = one_slot(2, 5, 5, ("push", "turn", "spin"))
    aspects = [(0,), (1,), (2,), (3,), (4,)]
    common = [(0, 0, 0, 1), (0, 1, 1, 1)]
    first = graph(assumptions, "first", aspects, *common, (1, 0, 2, 1), (0, 2, 0, 1), (0, 2, 4, 3))
    second = graph(assumptions, "second", aspects, *common, (1, 0, 3, 1), (0, 2, 0, 1))
    return RobotMemory(assumptions, [first, second])


@every_exact_engine
def test_it_takes_a_detour_that_greed_does_not(engine):
    inference = trial(engine, detour(), ModelParameters(1e-8, 1e-8, learn_in_trial=False), 0)
    greedy = EntropyPolicy().choose(inference, np.random.default_rng(0))
    ahead = make_policy("lookahead-2").choose(inference, np.random.default_rng(0))
    assert (greedy.action, ahead.action) == (2, 1)
    expected = two_ahead(inference)
    assert expected[1] < expected[2] - 0.1


def test_bounds_hold_and_a_decision_they_make_is_the_exact_one():
    decided = 0
    for _, inference in random_trials():
        expected = np.array(two_ahead(inference))
        for least_weight in (1e-3, 0.03, 0.3):
            bounds = LookaheadPolicy(2, least_weight).bounds(inference)
            assert (bounds.low <= expected + 1e-10).all()
            assert (bounds.high >= expected - 1e-10).all()
            if bounds.decide:
                decided += 1
                assert expected[bounds.high.argmin()] <= expected.min() + 3e-9
    assert decided > 20


def test_bounds_of_three_actions_hold_too():
    for _, inference in random_trials()[:20]:
        expected = exact_value(inference, 3)
        for least_weight in (1e-3, 0.03, 0.3):
            bounds = LookaheadPolicy(3, least_weight).bounds(inference)
            assert bounds.low.min() - 1e-10 <= expected <= bounds.high.min() + 1e-10


def test_what_is_exact_always_decides():
    assert all(LookaheadPolicy(2).bounds(inference).decide for _, inference in random_trials())


def test_ties_are_broken_at_random_and_alike_for_the_same_generator():
    assumptions = one_slot(10, 3, 4, ("push", "pull", "turn"))
    inference = trial("bayes-filter", RobotMemory(assumptions), ModelParameters(), 0)
    policy = make_policy("lookahead-2")
    chosen = [policy.choose(inference, np.random.default_rng(seed)).action for seed in range(40)]
    assert set(chosen) == {0, 1, 2}
    assert chosen == [policy.choose(inference, np.random.default_rng(seed)).action for seed in range(40)]


def test_asking_changes_nothing_in_the_trial():
    for case, inference in random_trials()[:10]:
        make_policy("lookahead-3").choose(inference, np.random.default_rng(0))
        untouched = gone_through("bayes-filter", case)
        np.testing.assert_array_equal(inference.aspect_belief, untouched.aspect_belief)
        np.testing.assert_array_equal(inference.expected_entropies(), untouched.expected_entropies())


def test_it_does_not_imagine_before_a_look():
    inference = begin_trial("bayes-filter", detour(), ModelParameters())
    with pytest.raises(InvalidInputError, match="belief tree: asked before the look"):
        inference.belief_tree()


@pytest.mark.parametrize("horizon", [0, -1])
def test_a_horizon_of_nothing_is_refused(horizon):
    with pytest.raises(InvalidInputError, match=f"horizon: {horizon}; expected a whole number of at least 1"):
        LookaheadPolicy(horizon)


@pytest.mark.parametrize("least_weight", [-0.1, float("nan")])
def test_a_weight_below_zero_is_refused(least_weight):
    with pytest.raises(InvalidInputError, match=r"least_weight: .*; expected nats, at least 0"):
        LookaheadPolicy(2, least_weight)
