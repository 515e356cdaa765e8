import itertools
import math
import time
import warnings

import networkx
import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError, TooLargeError
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.inference.elimination.discrete_model import DiscreteModel
from atg_fg.inference.elimination.order import EntryBudget, _FillGraph, best_order
from atg_fg.inference.elimination.queries import log_partition, marginals, most_probable_explanation
from atg_fg.storage.scripted_trial import ScriptedTrial
from atg_fg.storage.uai import read_model, write_model
from atg_fg.storage.uai_export import export_trial
from tests.models import random_case

with warnings.catch_warnings():
    # Its extension modules warn of their own types, and crash where that is an error; some are loaded at first use.
    warnings.filterwarnings("ignore", r"builtin type \w+ has no __module__ attribute", DeprecationWarning)
    import pyagrum

    pyagrum.ShaferShenoyMRFInference(pyagrum.MarkovRandomField())


def random_model(rng, *, tree, least=1, descending=False):
    """A graph of 4 to 7 variables of up to 5 states, a tree or loopy, with some zeros; each set of variables once."""
    n_variables = int(rng.integers(4, 8))
    cardinalities = tuple(map(int, rng.integers(least, 6, n_variables)))
    scopes = {frozenset((int(rng.integers(variable)), variable)) for variable in range(1, n_variables)}
    if not tree:
        for size in (1, 2, 2, 3, 3):
            scopes.add(frozenset(map(int, rng.choice(n_variables, size, replace=False))))
    factors = []
    for scope in sorted(map(sorted, scopes)):
        order = tuple(scope[::-1]) if descending else tuple(map(int, rng.permutation(scope)))
        # Sixty-fourths are the same number in single precision.
        table = rng.integers(1, 65, [cardinalities[variable] for variable in order]) / 64
        # Never zero at the first states, so that something is possible.
        keep = rng.random(table.shape) >= 0.15
        keep[(0,) * table.ndim] = True
        factors.append((order, table * keep))
    return DiscreteModel(cardinalities, tuple(factors))


def weights(model, evidence):
    """The weight of every assignment, as an array with an axis a variable."""
    total = np.ones(model.cardinalities)
    for scope, table in model.factors:
        ascending = sorted(scope)
        shape = [size if variable in scope else 1 for variable, size in enumerate(model.cardinalities)]
        total = total * table.transpose([scope.index(variable) for variable in ascending]).reshape(shape)
    for variable, state in evidence.items():
        total = total * (np.arange(model.cardinalities[variable]) == state).reshape(
            [-1 if axis == variable else 1 for axis in range(total.ndim)]
        )
    return total


def assert_solved(model, evidence):
    """Compare all three tasks with enumeration."""
    total = weights(model, evidence)
    assert log_partition(model, evidence) == pytest.approx(math.log(total.sum()), abs=1e-12)
    for variable, marginal in enumerate(marginals(model, evidence)):
        other = tuple(axis for axis in range(total.ndim) if axis != variable)
        np.testing.assert_allclose(marginal, total.sum(axis=other) / total.sum(), atol=1e-13)
    states, log_weight = most_probable_explanation(model, evidence)
    assert total[states] == pytest.approx(total.max(), rel=1e-12)
    assert log_weight == pytest.approx(math.log(total.max()), abs=1e-12)


def chain(table, length):
    return DiscreteModel((len(table),) * length, tuple(((i, i + 1), np.array(table)) for i in range(length - 1)))


def grid(side, rng):
    number = np.arange(side * side).reshape(side, side)
    pairs = (number[:, :-1], number[:, 1:]), (number[:-1], number[1:])
    edges = [edge for ones, others in pairs for edge in zip(ones.flat, others.flat, strict=True)]
    return DiscreteModel((2,) * side**2, tuple(((int(a), int(b)), rng.random((2, 2))) for a, b in edges))


def test_two_variables_by_hand():
    model = read_model("MARKOV 2 2 2 2 1 0 2 0 1 2 0.25 0.75 4 1 3 5 0")
    # Weights: 0.25, 0.75, 3.75, 0.
    assert log_partition(model) == pytest.approx(math.log(4.75), abs=1e-15)
    first, second = marginals(model)
    np.testing.assert_allclose(first, [1 / 4.75, 3.75 / 4.75], rtol=1e-15)
    np.testing.assert_allclose(second, [4 / 4.75, 0.75 / 4.75], rtol=1e-15)
    assert most_probable_explanation(model) == ((1, 0), pytest.approx(math.log(3.75)))
    assert log_partition(model, {1: 1}) == pytest.approx(math.log(0.75))
    assert marginals(model, {1: 1})[0].tolist() == [1, 0]
    assert marginals(model, {1: 1})[1].tolist() == [0, 1]
    assert most_probable_explanation(model, {1: 1}).states == (0, 1)


def test_a_bayes_net_by_hand():
    rain = read_model("BAYES 2 2 2 2 1 0 2 0 1 2 0.8 0.2 4 0.9 0.1 0.25 0.75")
    assert log_partition(rain) == pytest.approx(0, abs=1e-15)
    assert math.exp(log_partition(rain, {1: 1})) == pytest.approx(0.23)
    np.testing.assert_allclose(marginals(rain, {1: 1})[0], [0.08 / 0.23, 0.15 / 0.23])


@pytest.mark.parametrize("seed", range(30))
def test_random_graphs_agree_with_enumeration(seed):
    rng = np.random.default_rng(seed)
    model = random_model(rng, tree=seed % 3 == 0)
    assert_solved(model, {})
    assert_solved(model, {0: 0, 2: 0})


def test_single_states_isolated_variables_and_empty_scopes():
    model = DiscreteModel((1, 3, 1, 2), (((), np.array(0.5)), ((2, 1), np.array([[1.0, 2.0, 5.0]]))))
    assert log_partition(model) == pytest.approx(math.log(0.5 * 8 * 2))
    np.testing.assert_allclose(np.concatenate(marginals(model)), [1, 1 / 8, 2 / 8, 5 / 8, 1, 0.5, 0.5], rtol=1e-14)
    assert most_probable_explanation(model).states[:3] == (0, 2, 0)
    assert log_partition(DiscreteModel((), ())) == 0
    assert marginals(DiscreteModel((), ())) == []
    assert most_probable_explanation(DiscreteModel((1,), ())) == ((0,), 0.0)


def test_several_factors_on_the_same_variables_multiply():
    model = read_model("MARKOV 2 2 3 3 2 0 1 2 1 0 2 0 1 6 1 2 3 4 5 6 6 6 5 4 3 2 1 6 1 1 1 1 1 2")
    assert_solved(model, {})


def impossible_models():
    yield DiscreteModel((2,), (((0,), np.zeros(2)),)), {}
    yield DiscreteModel((2,), (((), np.array(0.0)),)), {}
    yield DiscreteModel((2,), (((0,), np.array([1.0, 0.0])),)), {0: 1}
    yield DiscreteModel((2,), (((0,), np.array([1.0, 0.0])), ((0,), np.array([0.0, 1.0])))), {}
    yield chain([[1.0, 0.0], [0.0, 1.0]], 4), {0: 0, 3: 1}


@pytest.mark.parametrize("task", [log_partition, marginals, most_probable_explanation])
@pytest.mark.parametrize(("model", "evidence"), list(impossible_models()))
def test_evidence_of_probability_zero_is_said_to_be_impossible(task, model, evidence):
    with pytest.raises(ImpossibleEvidenceError, match="weight zero"):
        task(model, evidence)


@pytest.mark.parametrize("task", [log_partition, marginals, most_probable_explanation])
def test_evidence_and_limits_that_make_no_sense_are_refused(task):
    model = chain([[1.0, 1.0], [1.0, 1.0]], 2)
    with pytest.raises(InvalidInputError, match="evidence: state 2 of variable 0; expected 0 to 1"):
        task(model, {0: 2})
    with pytest.raises(InvalidInputError, match="limit: 0"):
        task(model, {}, 0)


@pytest.mark.parametrize("seed", range(50))
def test_pyagrum_reads_the_same_file_and_agrees(tmp_path, seed):
    """pyAgrum 3.3.1 takes the lowest variable for the fastest in any scope, and reads numbers in single precision.

    It knows neither variables without factors nor ones of a single state, which here have a second, impossible one.
    """
    rng = np.random.default_rng(1000 + seed)
    model = random_model(rng, tree=seed % 2 == 0, least=2 if seed < 35 else 1, descending=True)
    file = tmp_path / "model.uai"
    file.write_text(write_model(model if seed < 35 else widened(model)))
    model = read_model(file.read_text()) if seed < 35 else model
    peer = pyagrum.MarkovRandomField()
    peer.loadUAI(str(file))
    inference = pyagrum.ShaferShenoyMRFInference(peer)
    evidence = {0: 0} if seed % 3 == 0 else {}
    for variable, state in evidence.items():
        inference.addEvidence(variable, state)
    inference.makeInference()
    for variable, marginal in enumerate(marginals(model, evidence)):
        np.testing.assert_allclose(
            marginal, inference.posterior(variable).tolist()[: model.cardinalities[variable]], atol=1e-9, rtol=0
        )
    product = pyagrum.Tensor()
    for factor in peer.factors():
        product = product * peer.factor(factor)
    assert log_partition(model) == pytest.approx(math.log(product.sum()), abs=1e-9)
    best = most_probable_explanation(model)
    assert best.log_weight == pytest.approx(math.log(product.max()), abs=1e-9)
    best_weight = product[{str(variable): state for variable, state in enumerate(best.states)}]
    assert best_weight == pytest.approx(product.max(), rel=1e-12)


def widened(model):
    """The model with a second state of weight zero for every variable of one, and no single-state table left."""
    sizes = tuple(max(size, 2) for size in model.cardinalities)
    factors = [
        (scope, np.pad(table, [(0, sizes[variable] - model.cardinalities[variable]) for variable in scope]))
        for scope, table in model.factors
    ]
    return DiscreteModel(sizes, tuple(factors))


def test_a_partition_function_below_the_least_float_keeps_its_logarithm():
    tiny = chain([[1e-5, 1e-5], [1e-5, 1e-5]], 2001)
    assert log_partition(tiny) == pytest.approx(2001 * math.log(2) - 2000 * 5 * math.log(10), rel=1e-13)
    np.testing.assert_allclose(marginals(tiny)[1000], [0.5, 0.5], rtol=1e-12)
    assert most_probable_explanation(tiny).log_weight == pytest.approx(-2000 * 5 * math.log(10), rel=1e-13)


def test_a_weight_that_would_underflow_on_the_way_comes_back():
    """State 0 falls to 1e-1000 before it rises again; both end up equal but for the factor 3."""
    falls, rises = ((0,), np.array([1e-5, 1.0])), ((0,), np.array([1.0, 1e-5]))
    model = DiscreteModel((2,), (*[falls] * 200, *[rises] * 200, ((0,), np.array([3.0, 1.0]))))
    np.testing.assert_allclose(marginals(model)[0], [0.75, 0.25], rtol=1e-9)
    assert log_partition(model) == pytest.approx(math.log(4) - 1000 * math.log(10), rel=1e-13)
    assert most_probable_explanation(model).states == (0,)


def test_values_at_both_ends_of_the_floats_are_weighed():
    extremes = ((0,), np.array([1e308, 5e-324]))
    model = DiscreteModel((2,), (extremes, ((0,), np.array([5e-324, 1e308])), ((0,), np.array([1.0, 3.0]))))
    np.testing.assert_allclose(marginals(model)[0], [0.25, 0.75], rtol=1e-12)


def test_a_value_that_its_own_table_dwarfs_is_not_forgotten():
    """5e-324 beside 1e308 would be zero after division; four tables, none of them extreme, make it the greater."""
    dwarfed = ((0, 1), np.array([[1e308, 5e-324], [1e308, 5e-324]]))
    same = [((variable, variable + 1), np.eye(2)) for variable in range(1, 4)]
    against = [((variable,), np.array([1e-160, 1.0])) for variable in range(1, 5)]
    for marginal in marginals(DiscreteModel((2,) * 5, (dwarfed, *same, *against)))[1:]:
        np.testing.assert_allclose(marginal, [0.0, 1.0], atol=1e-6)


def test_a_chain_of_500_variables_agrees_with_powers_of_its_matrix():
    table = np.array([[0.9, 0.1, 0.0], [0.2, 0.5, 0.3], [0.0, 0.4, 0.6]])
    model = chain(table, 500)
    powers = [np.linalg.matrix_power(table, length) for length in (0, 250, 499)]
    assert log_partition(model) == pytest.approx(math.log(powers[2].sum()), abs=1e-12)
    expected = powers[1].sum(axis=0) * np.linalg.matrix_power(table, 249).sum(axis=1)
    np.testing.assert_allclose(marginals(model)[250], expected / expected.sum(), rtol=1e-11)
    states = most_probable_explanation(model).states
    assert states == (0,) * 500


def test_a_grid_of_10_by_10_agrees_with_its_transfer_matrices():
    model = grid(10, np.random.default_rng(0))
    tables = dict(model.factors)
    bits = np.array(list(itertools.product(range(2), repeat=10)))
    column = np.ones(1024)
    for row in range(10):
        within = math.prod(tables[10 * row + i, 10 * row + i + 1][bits[:, i], bits[:, i + 1]] for i in range(9))
        column = column * within
        if row < 9:
            between = math.prod(
                tables[10 * row + i, 10 * row + 10 + i][bits[:, None, i], bits[None, :, i]] for i in range(10)
            )
            column = column @ between
    assert log_partition(model) == pytest.approx(math.log(column.sum()), abs=1e-10)
    best = most_probable_explanation(model)
    direct = sum(math.log(table[tuple(best.states[v] for v in scope)]) for scope, table in model.factors)
    assert best.log_weight == pytest.approx(direct, abs=1e-10)


def test_a_grid_of_20_by_20_is_refused_in_no_time_with_its_estimate():
    model = grid(20, np.random.default_rng(0))
    began = time.perf_counter()
    with pytest.raises(TooLargeError, match=r"a table of 2097152 entries \(16777216 bytes\); the limit is 1048576"):
        log_partition(model, {}, 2**20)
    with pytest.raises(TooLargeError, match=r"tables of together 763363318 entries .* the limit is 67108864 entries"):
        marginals(model)
    assert time.perf_counter() - began < 30
    # Along its rows it needs 2^21, which the default allows.
    order = best_order([scope for scope, _ in model.factors], model.cardinalities, EntryBudget(2**26))
    assert max(order.entries) == 2**21


def test_what_is_refused_or_not_is_the_size_of_the_largest_table():
    model = chain(np.ones((5, 5)), 10)
    assert log_partition(model, {}, 25) == pytest.approx(10 * math.log(5))
    with pytest.raises(TooLargeError, match=r"a table of 25 entries \(200 bytes\); the limit is 24 entries"):
        log_partition(model, {}, 24)
    # Kept tables: nine of 25 and the last of 5.
    assert len(marginals(model, {}, 230)) == 10
    with pytest.raises(TooLargeError, match="the limit is 229"):
        most_probable_explanation(model, {}, 229)


def test_a_huge_cardinality_is_refused_rather_than_allocated():
    for evidence in ({}, {0: 3}):
        with pytest.raises(TooLargeError, match=r"entries \("):
            marginals(DiscreteModel((10**30,), ()), evidence)
    assert log_partition(DiscreteModel((10**30,), ()), {0: 3}) == 0


def test_the_order_of_a_tree_needs_no_more_than_its_edges():
    rng = np.random.default_rng(0)
    edges = [(int(rng.integers(variable)), variable) for variable in range(1, 300)]
    order = best_order(edges, [3] * 300, EntryBudget(9))
    assert sorted(order.variables) == list(range(300))
    assert max(order.entries) == 9


@pytest.mark.parametrize("seed", range(10))
def test_the_variable_that_adds_fewest_edges_is_found(seed):
    rng = np.random.default_rng(seed)
    edges = [tuple(map(int, rng.choice(15, 2, replace=False))) for _ in range(30)]
    graph, left = _FillGraph(edges, [2] * 15), networkx.Graph(edges)
    left.add_nodes_from(range(15))
    while left:
        added = {v: sum(not left.has_edge(*pair) for pair in itertools.combinations(left[v], 2)) for v in left}
        variable = graph.cheapest()
        assert added[variable] == min(added.values())
        assert graph.entries(variable) == 2 ** (1 + left.degree(variable))
        left.add_edges_from(itertools.combinations(list(left[variable]), 2))
        left.remove_node(variable)
        graph.eliminate(variable)


def test_a_hub_of_many_neighbours_is_eliminated_last():
    order = best_order([(0, leaf) for leaf in range(1, 2001)], [50] + [2] * 2000, EntryBudget(100))
    assert max(order.entries) == 100


@pytest.mark.parametrize("seed", range(40))
def test_an_exported_trial_has_the_posterior_and_the_evidence_of_the_trial(seed):
    case = random_case(np.random.default_rng(seed))
    memory = case.memory
    looks = [look.evidence(memory.assumptions.alphabet) for look in case.looks]
    steps = [step for pair in itertools.zip_longest(looks, case.actions) for step in pair if step is not None]
    exported = export_trial(ScriptedTrial(memory, case.parameters, tuple(steps), "case"))
    model = read_model(write_model(exported.model))
    try:
        engine = begin_trial("bayes-filter", memory, case.parameters)
        for step in steps:
            engine.observe(step) if isinstance(step, Evidence) else engine.act(step)
    except ImpossibleEvidenceError:
        with pytest.raises(ImpossibleEvidenceError):
            log_partition(model, exported.evidence)
        return
    belief = engine.identity()
    assert len(exported.names) == len(model.cardinalities)
    np.testing.assert_allclose(
        marginals(model, exported.evidence)[0], [*belief.objects, belief.unseen], atol=1e-12, rtol=0
    )
    assert log_partition(model, exported.evidence) == pytest.approx(engine.log_evidence, abs=1e-10)


@pytest.mark.parametrize("task", [log_partition, marginals, most_probable_explanation])
def test_a_model_far_too_large_is_refused_with_more_than_a_round_number(task):
    """Random pairs of 1,000 variables with 10 states: to count all tables would itself take minutes."""
    rng = np.random.default_rng(0)
    pairs = [tuple(map(int, rng.choice(1000, 2, replace=False))) for _ in range(3000)]
    model = DiscreteModel((10,) * 1000, tuple((pair, np.ones((10, 10))) for pair in pairs))
    with pytest.raises(
        TooLargeError, match=r"more than 2\*\*\d+ entries \(more than 2\*\*\d+ bytes\); the limit is 6710"
    ):
        task(model)


def test_tables_made_in_turn_are_limited_by_the_time_that_they_take():
    """Each table is small enough, but there are so many that their sums would take hours."""
    scopes = [(variable, variable + 1, variable + 2) for variable in range(2000)]
    with pytest.raises(
        TooLargeError, match=r"to make tables in turn, of \d+ entries .* the limit is 4294967296 entries"
    ):
        best_order(scopes, [200] * 2002, EntryBudget(2**26))
    assert len(best_order(scopes[:500], [200] * 502, EntryBudget(2**26)).variables) == 502
