import itertools

import gtsam
import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError, TooLargeError
from atg_fg.engines import begin_trial
from atg_fg.inference.chain import Chain
from atg_fg.inference.explanations import best_explanations, sample_explanations, surprise
from atg_fg.inference.factor_graph import RecognitionGraph
from atg_fg.inference.gtsam_factors import aspect_key, object_key
from tests.models import gone_through, random_case

SEEDS = range(60)


def after_a_trial(seed, engine="enumeration"):
    return gone_through(engine, random_case(np.random.default_rng(seed)))


def by_hand():
    """Two objects, two aspects, two looks: eight explanations whose weights are products of what stands here."""
    transition = np.array([[[0.9, 0.1], [0.2, 0.8]], [[0.5, 0.5], [0.5, 0.5]]])
    likelihoods = (np.array([[1.0, 0.5], [0.4, 0.4]]), np.array([[0.1, 1.0], [0.4, 0.4]]))
    return Chain(np.array([0.6, 0.4]), np.array([[0.5, 0.5], [1.0, 0.0]]), (transition,), likelihoods)


def weight(chain, hypothesis, states):
    product = chain.prior[hypothesis] * chain.initial[hypothesis, states[0]]
    for time, (before, after) in enumerate(itertools.pairwise(states)):
        product *= chain.transitions[time][hypothesis, before, after]
    for time, likelihood in enumerate(chain.likelihoods):
        product *= likelihood[hypothesis, states[time]]
    return product


def test_the_best_explanations_by_hand():
    chain = by_hand()
    joint = {(h, x, y): weight(chain, h, (x, y)) for h in range(2) for x in range(2) for y in range(2)}
    total = sum(joint.values())
    order = sorted(joint, key=lambda key: -joint[key])
    found = best_explanations(chain, 8)
    assert len(found) == sum(value > 0 for value in joint.values())
    assert (found[0].hypothesis, *found[0].states) == order[0] == (0, 1, 1)
    assert [each.probability for each in found] == pytest.approx([joint[key] / total for key in order[: len(found)]])
    # 0.6 · 0.5 · 0.5 · 0.8 · 1
    assert found[0].probability == pytest.approx(0.12 / total)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_best_explanations_are_those_of_enumeration(seed):
    inference = after_a_trial(seed)
    everything = np.sort(inference.weights[inference.weights > 0])[::-1] / inference.weights.sum()
    for k in (1, 3, 8):
        found = best_explanations(inference.chain(), k)
        assert [each.probability for each in found] == pytest.approx(everything[:k], rel=1e-9)
        assert len({(each.hypothesis, each.states) for each in found}) == len(found)
        for each in found:
            assert inference.weights[(each.hypothesis, *each.states)] == pytest.approx(each.probability, rel=1e-9)


@pytest.mark.parametrize("seed", SEEDS[:20])
def test_gtsams_own_search_finds_the_same(seed):
    inference = after_a_trial(seed, "gtsam")
    chain = inference.chain()
    graph = RecognitionGraph(chain, inference.model.n_unseen)
    solutions = gtsam.DiscreteSearch(graph.eliminate()).run(3)
    found = best_explanations(chain, 3)
    assert [np.exp(-solution.error) for solution in solutions][: len(found)] == pytest.approx(
        [each.probability for each in found], rel=1e-8, abs=1e-12
    )
    best, keys = solutions[0].assignment, [object_key(), *(aspect_key(time) for time in range(len(chain.widths)))]
    ours = (found[0].hypothesis, *found[0].states)
    assert weight(chain, best[keys[0]], [best[key] for key in keys[1:]]) == pytest.approx(
        weight(chain, ours[0], ours[1:])
    )


def test_samples_come_as_often_as_they_are_probable():
    chain, n = by_hand(), 20_000
    drawn = sample_explanations(chain, n, np.random.default_rng(0))
    for explanation in best_explanations(chain, 8):
        share = (
            sum((each.hypothesis, each.states) == (explanation.hypothesis, explanation.states) for each in drawn) / n
        )
        p = explanation.probability
        assert abs(share - p) < 4 * np.sqrt(p * (1 - p) / n)
    known = {(each.hypothesis, each.states): each.probability for each in best_explanations(chain, 8)}
    assert all(each.probability == pytest.approx(known[each.hypothesis, each.states]) for each in drawn[:50])


def test_the_same_generator_draws_the_same_samples():
    first, second, other = (sample_explanations(by_hand(), 30, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first == second != other


@pytest.mark.parametrize("seed", SEEDS)
def test_surprise_adds_up_to_the_log_evidence(seed):
    inference = after_a_trial(seed, "bayes-filter")
    surprises = surprise(inference.chain())
    assert len(surprises) == len(inference.history.evidence)
    assert surprises.sum() == pytest.approx(-inference.log_evidence, abs=1e-9)


def test_surprise_is_the_fall_of_the_log_evidence_at_each_look():
    case = random_case(np.random.default_rng(3))
    inference = begin_trial("bayes-filter", case.memory, case.parameters)
    falls, before = [], 0.0
    for time, look in enumerate(case.looks):
        inference.observe(look.evidence(case.assumptions.alphabet))
        falls.append(before - inference.log_evidence)
        before = inference.log_evidence
        if time < len(case.actions):
            inference.act(case.actions[time])
    assert surprise(inference.chain()) == pytest.approx(falls, abs=1e-9)


def test_long_trials_do_not_underflow():
    transition = np.array([[[0.5, 0.5], [0.5, 0.5]]])
    likelihood = np.array([[1e-5, 2e-5]])
    n = 400
    chain = Chain(np.ones(1), np.array([[0.5, 0.5]]), (transition,) * (n - 1), (likelihood,) * n)
    (best,) = best_explanations(chain)
    assert set(best.states) == {1}
    assert best.log_probability == pytest.approx(n * np.log(2 / 3))
    assert surprise(chain) == pytest.approx(np.full(n, -np.log(1.5e-5)))
    (drawn,) = sample_explanations(chain, 1, np.random.default_rng(0))
    assert drawn.log_probability < best.log_probability


def test_impossible_evidence_and_bad_numbers_are_refused():
    chain = by_hand()
    impossible = Chain(chain.prior, chain.initial, chain.transitions, (chain.likelihoods[0], np.zeros((2, 2))))
    for ask in (best_explanations, surprise):
        with pytest.raises(ImpossibleEvidenceError, match="observation 1"):
            ask(impossible)
    with pytest.raises(InvalidInputError, match="k: 0"):
        best_explanations(chain, 0)
    with pytest.raises(InvalidInputError, match="number of samples: 0"):
        sample_explanations(chain, 0, np.random.default_rng(0))


def test_more_explanations_than_memory_holds_are_refused_before_it_is_taken():
    chain = by_hand()
    with pytest.raises(InvalidInputError, match="number of samples: 2147483647; expected a whole number from 1 to"):
        sample_explanations(chain, 2**31 - 1, np.random.default_rng(0))
    wide = np.full((4, 64, 64), 1 / 64)
    many = Chain(np.full(4, 1 / 4), np.full((4, 64), 1 / 64), (wide,) * 9, (np.ones((4, 64)),) * 10)
    assert len(best_explanations(many, 3)) == 3
    with pytest.raises(TooLargeError, match=r"k: 100000000: would compare 4294967296 ways to a look at once"):
        best_explanations(many, 10**8)
