from math import isinf, log

import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.inference.chain import Chain
from atg_fg.inference.factor_graph import RecognitionGraph
from atg_fg.inference.gtsam_factors import aspect_key, object_key
from atg_fg.inference.interface import Inference
from tests.models import Case, random_case
from tests.oracle import ImpossibleError, Oracle
from tests.small import graph, one_slot, trial

SEEDS = range(1000, 1040)


def played(seed: int) -> tuple[Case, Oracle, Inference] | None:
    """A random trial, by the oracle and by an engine; ``None`` if it cannot be."""
    case = random_case(np.random.default_rng(seed))
    oracle = case.oracle
    inference = begin_trial("bayes-filter", case.memory, case.parameters)
    try:
        for time, look in enumerate(case.looks):
            oracle.observe(look.likelihood(case.patterns), look.complete)
            inference.observe(look.evidence(case.assumptions.alphabet))
            if time < len(case.actions):
                oracle.act(case.actions[time])
                inference.act(case.actions[time])
    except ImpossibleError:
        return None
    return case, oracle, inference


def whole_graph(inference: Inference) -> RecognitionGraph:
    return RecognitionGraph(inference.chain(), inference.model.n_unseen)


def close(actual: object, expected: object) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12)


def three_looks() -> RecognitionGraph:
    assumptions = one_slot(3, 2, 3)
    memory = RobotMemory(assumptions, [graph(assumptions, "A", [(0,)])])
    return whole_graph(trial("bayes-filter", memory, ModelParameters(0.5, 0.1), 0, 0, 1, 0, 0))


def test_most_random_trials_are_possible() -> None:
    assert sum(played(seed) is not None for seed in SEEDS) >= 30


@pytest.mark.parametrize("seed", SEEDS)
def test_the_whole_graph_gives_the_exact_posterior(seed: int) -> None:
    played_trial = played(seed)
    if played_trial is None:
        return
    _, oracle, inference = played_trial
    recognition = whole_graph(inference)
    expected = [float(p) for p in oracle.identity()]
    close(recognition.identity().objects, expected[:-1])
    close(recognition.novelty(), expected[-1])
    close(recognition.identity().entropy, oracle.entropy())
    close(recognition.log_evidence(), oracle.log_evidence())
    for time in range(recognition.last + 1):
        marginal = recognition.aspect_marginal(time)
        joint = np.zeros_like(marginal)
        for i in range(oracle.K + 1):
            for x, probability in (oracle.smoothed(i) or [{}] * (time + 1))[time].items():
                joint[i, oracle.state_number(i, x)] = expected[i] * float(probability)
        close(marginal, joint)


@pytest.mark.parametrize("seed", SEEDS)
def test_marginals_of_gtsam_itself_are_those_of_the_graph(seed: int) -> None:
    played_trial = played(seed)
    if played_trial is None:
        return
    _, oracle, inference = played_trial
    recognition = whole_graph(inference)
    marginals = recognition.marginals()
    by_gtsam = marginals.marginalProbabilities(recognition.variable(object_key()))
    close(by_gtsam[: oracle.K + 1], [float(p) for p in oracle.identity()])
    for time in range(recognition.last + 1):
        expected = recognition.aspect_marginal(time).sum(axis=0)
        by_gtsam = marginals.marginalProbabilities(recognition.variable(aspect_key(time)))
        close(by_gtsam[: len(expected)], expected)
        close(by_gtsam[len(expected) :], 0)


@pytest.mark.parametrize("seed", SEEDS[:20])
def test_elimination_for_every_pattern_gives_the_expected_entropies_of_the_engines(seed: int) -> None:
    played_trial = played(seed)
    if played_trial is None:
        return
    case, _, inference = played_trial
    if inference.history.awaits_evidence:
        inference.observe(case.nothing.evidence(case.assumptions.alphabet))
    model = inference.model
    every_pattern = np.stack([model.likelihood(Evidence(pattern)) for pattern in np.eye(model.n_patterns)])
    recognition = whole_graph(inference)
    by_elimination = [
        recognition.expected_entropy_by_elimination(model.transition(action), every_pattern)
        for action in range(model.n_actions)
    ]
    close(by_elimination, inference.expected_entropies())


def test_hypothetical_factors_leave_the_graph_as_it_was() -> None:
    recognition = three_looks()
    n_factors, before = recognition.graph.size(), recognition.novelty()
    twin = recognition.copy()
    twin.act(np.full((2, 3, 3), 1 / 3))
    twin.observe(np.array([[0.1, 0.2, 0.3], [0.3, 0.2, 0.1]]))
    assert (recognition.last, twin.last) == (2, 3)
    assert recognition.graph.size() == n_factors
    assert twin.graph.size() == n_factors + 2
    assert recognition.novelty() == before


def test_variables_with_one_state_are_right() -> None:
    # One hypothesis with one state at each time: the evidence is the product of all factors, here 2^-7.
    half = np.full((1, 1, 1), 0.5)
    chain = Chain(np.array([0.5]), half[0], (half, half), (half[0], half[0], half[0]))
    for _ in range(20):
        recognition = RecognitionGraph(chain, n_unseen=7)
        assert recognition.log_evidence() == pytest.approx(-7 * log(2), abs=1e-14)
        assert recognition.identity().objects.tolist() == []
        assert recognition.novelty() == 1
        assert recognition.identity().entropy == pytest.approx(log(7), abs=1e-14)
        assert [recognition.aspect_marginal(time).tolist() for time in range(3)] == [[[1.0]]] * 3
        assert recognition.marginals().marginalProbabilities(recognition.variable(aspect_key(1))).tolist() == [1, 0]


def test_one_state_among_many_is_right() -> None:
    # X_0 has one state, X_1 has three: p(O) ∝ (0.5 · (0.1 + 0.2 + 0), 0.5 · (0 + 0 + 0.9)) = 1 : 3.
    chain = Chain(
        np.array([0.5, 0.5]),
        np.ones((2, 1)),
        (np.array([[[0.2, 0.4, 0.4]], [[0.0, 0.1, 0.9]]]),),
        (np.ones((2, 1)), np.array([[0.5, 0.5, 0.0], [1.0, 0.0, 1.0]])),
    )
    recognition = RecognitionGraph(chain, n_unseen=1)
    assert recognition.identity().objects.tolist() == [pytest.approx(0.25, abs=1e-14)]
    assert recognition.log_evidence() == pytest.approx(log(0.6), abs=1e-14)
    close(recognition.aspect_marginal(0), [[0.25], [0.75]])
    close(recognition.aspect_marginal(1), [[0.1 / 1.2, 0.2 / 1.2, 0], [0, 0, 0.75]])


def impossible() -> RecognitionGraph:
    chain = Chain(np.array([0.5, 0.5]), np.ones((2, 1)), (np.ones((2, 1, 1)),), (np.ones((2, 1)), np.zeros((2, 1))))
    return RecognitionGraph(chain, n_unseen=1)


@pytest.mark.parametrize(
    "question",
    [
        lambda recognition: recognition.identity(),
        lambda recognition: recognition.novelty(),
        lambda recognition: recognition.log_evidence(),
        lambda recognition: recognition.aspect_marginal(0),
        lambda recognition: recognition.aspect_marginal(1),
    ],
    ids=["identity", "novelty", "log_evidence", "aspect_marginal(0)", "aspect_marginal(1)"],
)
def test_a_graph_of_impossible_evidence_says_so(question) -> None:
    with pytest.raises(ImpossibleEvidenceError):
        question(impossible())


@pytest.mark.parametrize("time", [-1, 3])
def test_a_time_outside_the_trial_is_refused(time: int) -> None:
    with pytest.raises(InvalidInputError, match="expected 0 to 2"):
        three_looks().aspect_marginal(time)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -0.1])
def test_a_bad_table_is_refused_before_gtsam_has_it(bad: float) -> None:
    recognition = three_looks()
    with pytest.raises(InvalidInputError):
        recognition.observe(np.array([[bad, 0.2, 0.3], [0.3, 0.2, 0.1]]))
    assert np.isfinite(recognition.log_evidence())


def test_dot_names_the_variables_as_the_paper_does() -> None:
    dot = three_looks().dot()
    assert all(f'label="{name}"' in dot for name in ("O", "X0", "X1", "X2"))
    assert 'label="X3"' not in dot
    assert f'label="{object_key()}"' not in dot


def test_the_picture_shows_every_variable_and_factor_and_no_raw_key() -> None:
    recognition = three_looks()
    html = recognition._repr_html_()
    assert [html.count(f">{name}</text>") for name in ("O", "X0", "X1", "X2", "X3")] == [1, 1, 1, 1, 0]
    assert html.count("<circle") == 4
    assert html.count("<rect") == recognition.graph.size() == 7
    assert "factor on O, X1, X2" in html
    for key in (object_key(), *map(aspect_key, range(3))):
        assert str(key) not in html


def test_a_factor_names_its_variables_and_the_graph_its_extent() -> None:
    recognition = three_looks()
    names = [recognition.names_of(index) for index in range(recognition.graph.size())]
    assert names[:3] == [("O",), ("O", "X0"), ("O", "X0", "X1")]
    assert names[-1] == ("O", "X2")
    assert repr(recognition) == "RecognitionGraph(O, X0 … X2; 7 factors)"


def test_a_long_trial_does_not_underflow_the_graph() -> None:
    # 300 looks that every hypothesis finds next to impossible: p(z) is far below the least float.
    assumptions = one_slot(4, 2, 4)
    memory = RobotMemory(assumptions, [graph(assumptions, name, [(0,)], (0, 0, 0, 1)) for name in ("A", "B")])
    steps = [0, *[0, 1] * 299]
    inference = trial("bayes-filter", memory, ModelParameters(1e-8, 1e-8, learn_in_trial=True), *steps)
    soft = Evidence.of_likelihood(assumptions.alphabet, [1e-9, 2e-9, 3e-9, 4e-9])
    for _ in range(60):
        inference.act(0)
        inference.observe(soft)
    recognition = whole_graph(inference)
    assert inference.log_evidence < -1000
    assert not isinf(recognition.log_evidence())
    assert recognition.log_evidence() == pytest.approx(inference.log_evidence, rel=1e-12)
    close(recognition.identity().objects, inference.identity().objects)


def test_an_object_ruled_out_for_long_comes_back_in_the_graph_as_in_the_filter() -> None:
    # 100 looks at A, after which B is 100 · ln(4 · 0.999 / 0.001) > 800 behind, below the least float. Then 600 at B.
    assumptions = one_slot(3, 2, 4)
    swaps = (0, 0, 1, 1), (1, 0, 0, 1)
    memory = RobotMemory(
        assumptions, [graph(assumptions, "A", [(0,), (1,)], *swaps), graph(assumptions, "B", [(2,), (3,)], *swaps)]
    )
    steps = [step for symbol in [0, 1] * 50 + [2, 3] * 300 for step in (symbol, 0)][:-1]
    inference = trial("bayes-filter", memory, ModelParameters(1e-8, 1e-3, learn_in_trial=False), *steps)
    assert inference.identity().objects[1] == pytest.approx(1)
    recognition = whole_graph(inference)
    close(recognition.identity().objects, inference.identity().objects)
    assert recognition.log_evidence() == pytest.approx(inference.log_evidence, rel=1e-12)
