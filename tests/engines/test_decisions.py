"""A decision as the engines make it, from dense tables, and from one eliminated graph for each action and pattern."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import begin_trial
from atg_fg.engines.bayes_filter import BayesFilter
from atg_fg.engines.gtsam_elimination import (
    EdgesInto,
    GtsamElimination,
    HypotheticalFactors,
    RowKinds,
    TransitionFactors,
)
from atg_fg.inference.expected_entropy import NextPatternJoint, next_pattern_joint, pattern_table
from atg_fg.inference.factor_graph import RecognitionGraph
from atg_fg.inference.interface import Inference
from atg_fg.inference.recognition_model import RecognitionModel
from tests.models import Case, cases, gone_through
from tests.small import graph, one_slot, seen, trial

QUICK = (BayesFilter.name, GtsamElimination.name)


def close(actual: object, expected: object) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12)


def looked(engine: str, case: Case) -> Inference:
    """An engine after the last look of a case's trial, or after one more that shows nothing."""
    inference = gone_through(engine, case)
    if inference.history.awaits_evidence:
        inference.observe(case.nothing.evidence(case.assumptions.alphabet))
    return inference


def likelihoods(model: RecognitionModel) -> np.ndarray:
    """p(z | x, i) of every pattern, shape [|𝒵|, H, W]."""
    return np.stack([model.likelihood(Evidence(pattern)) for pattern in np.eye(model.n_patterns)])


def dense_joint(model: RecognitionModel, mass: np.ndarray) -> np.ndarray:
    """p(O, z | a) of every pattern by the full tables, shape [A, H, |𝒵|]."""
    transitions = np.stack([model.transition(action) for action in range(model.n_actions)])
    return np.einsum("hx,ahxy,zhy->ahz", mass, transitions, likelihoods(model))


def dense_expected_entropies(joint: np.ndarray, n_unseen: int) -> list[float]:
    """Eq. 3 as it is written: the entropy after each pattern, weighted by its probability."""
    return [
        sum(
            given_pattern.sum() * IdentityBelief.of(given_pattern / given_pattern.sum(), n_unseen).entropy
            for given_pattern in table.T
            if given_pattern.sum() > 0
        )
        for table in joint
    ]


def every_pattern(model: RecognitionModel, joint: NextPatternJoint) -> np.ndarray:
    return pattern_table(model, joint, np.arange(model.n_hypotheses))


def check_decision(inference: Inference) -> None:
    model, mass = inference.model, inference.aspect_belief
    dense = dense_joint(model, mass)
    close(every_pattern(model, next_pattern_joint(model, mass)), dense)
    close(every_pattern(model, HypotheticalFactors(model).next_patterns(mass)), dense)
    close(inference.expected_entropies(), dense_expected_entropies(dense, model.n_unseen))
    for action in range(model.n_actions):
        predicted = np.einsum("hx,hxy->hy", mass, model.transition(action))
        close(model.predict(mass, action), predicted)
        close(TransitionFactors(model, action).next_aspects(mass), predicted)


@pytest.mark.parametrize("engine", QUICK)
@given(case=cases())
def test_few_values_an_edge_are_the_dense_tables(engine: str, case: Case) -> None:
    check_decision(looked(engine, case))


@pytest.mark.parametrize("engine", QUICK)
@given(case=cases())
@settings(max_examples=min(8, settings.default.max_examples))
def test_few_factors_are_the_graphs_of_all_actions_and_patterns_eliminated(engine: str, case: Case) -> None:
    inference = looked(engine, case)
    model = inference.model
    whole = RecognitionGraph(inference.chain(), n_unseen=model.n_unseen)
    every_look = likelihoods(model)
    eliminated = [
        whole.expected_entropy_by_elimination(model.transition(action), every_look) for action in range(model.n_actions)
    ]
    close(inference.expected_entropies(), eliminated)


NOTHING_REMEMBERED = one_slot(3, 2, 4)
ONE_OF_EACH = one_slot(1, 1, 1)
ALL_KNOWN = one_slot(3, 3, 3, ("push", "pull"))
DEGENERATE = {
    "nothing remembered": RobotMemory(NOTHING_REMEMBERED),
    "one object, one aspect, one pattern": RobotMemory(ONE_OF_EACH, [graph(ONE_OF_EACH, "one", [(0,)], (0, 0, 0, 2))]),
    "an object without aspects": RobotMemory(NOTHING_REMEMBERED, [graph(NOTHING_REMEMBERED, "bare", [])]),
    "aspects without edges": RobotMemory(NOTHING_REMEMBERED, [graph(NOTHING_REMEMBERED, "still", [(0,), (3,)])]),
    "every pattern known, edges that meet": RobotMemory(
        ALL_KNOWN,
        [
            graph(ALL_KNOWN, "meet", [(0,), (1,), (2,)], (0, 0, 2, 1), (1, 0, 2, 5), (2, 0, 2, 2), (2, 0, 0, 1)),
            graph(ALL_KNOWN, "turn", [(2,), (0,), (1,)], (0, 1, 1, 1), (1, 1, 2, 1), (2, 1, 0, 1)),
        ],
    ),
}


@pytest.mark.parametrize("learns", [False, True])
@pytest.mark.parametrize(("alpha", "delta"), [(0.0, 0.0), (0.0, 0.3), (1e-8, 1e-8), (2.0, 0.0)])
@pytest.mark.parametrize("memory", DEGENERATE.values(), ids=DEGENERATE)
@pytest.mark.parametrize("engine", QUICK)
def test_so_they_are_at_the_limits_of_the_model(engine, memory, alpha, delta, learns) -> None:
    inference = trial(engine, memory, ModelParameters(alpha, delta, learns), 0)
    check_decision(inference)
    for _ in range(2):  # from an aspect to itself, which is learned once and then counted again
        inference.act(0)
        inference.observe(seen(memory.assumptions, 0))
        check_decision(inference)


@pytest.mark.parametrize("engine", QUICK)
def test_tables_that_learn_are_used_as_they_are_at_each_step(engine: str) -> None:
    assumptions = Assumptions(4, 3, ("push", "pull"), PatternAlphabet(("front", "top"), 3))
    memory = RobotMemory(assumptions, [graph(assumptions, "known", [(0, 1), (1, 0)], (0, 0, 1, 3), (0, 0, 0, 1))])
    looks = [(0, 1), (1, 0), (0, 1), (1, None), (0, 1), (1, 0)]
    inference = begin_trial(engine, memory, ModelParameters(0.5, 0.1, learn_in_trial=True))
    for number, look in enumerate(looks):
        if number:
            inference.act(number % 2)
        inference.observe(seen(assumptions, *look))
        check_decision(inference)


def test_an_edge_seen_again_is_one_entry_that_counts_more() -> None:
    assumptions = one_slot(5, 3, 4)
    memory = RobotMemory(assumptions, [graph(assumptions, "known", [(0,), (1,)], (0, 0, 1, 3))])
    model = RecognitionModel(memory, ModelParameters(1.0, 0.1, learn_in_trial=True))
    model.learn(None, None, 0)
    for _ in range(2):
        model.learn(0, 0, 1)
    columns = (model.edges.hypothesis, model.edges.source, model.edges.target, model.edges.weight)
    assert [column.tolist() for column in columns] == [[0, 1], [1, 1], [2, 2], [5.0, 2.0]]


def test_aspects_from_which_an_action_was_counted_as_often_are_one_state() -> None:
    prior_weight = np.array([[[1.0, 0.5, 1.0, 0.5], [1.0, 0.25, 0.5, 1.0]]])  # one action, two objects
    rows = RowKinds(prior_weight)
    assert rows.prior_weight.tolist() == [[0.5, 0.25], [1.0, 0.5], [0.0, 1.0]]


def test_a_cell_has_one_state_for_each_of_several_edges_that_lead_to_it() -> None:
    edges = EdgesInto(np.array([2, 0, 2, 3, 3, 3]), 5, np.array([0.5, 0.25, 1.0, 1.0, 1.0, 0.0]))
    assert edges.table(np.arange(1.0, 7.0)).tolist() == [[1.0, 4.0], [3.0, 5.0], [0.0, 6.0]]
    assert edges.arrivals(np.array([0.5, 0.5, 0.25, 0.125, 0.0625, 1.0])).tolist() == [0.125, 0.0, 0.5, 0.1875, 0.0]
