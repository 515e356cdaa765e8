import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.engines import ENGINES
from atg_fg.experiments.engine_comparison import REFERENCE, ComparisonPlan, compare, summarise

SMALL = ComparisonPlan(n_trials=3, n_actions=3, n_objects=6, n_remembered=3, n_learning_actions=4)


def test_the_reference_is_itself():
    record = compare(SMALL, [REFERENCE])[REFERENCE]
    assert record.total_variation == [0.0] * 12
    assert record.same_decision == [True] * 12
    assert len(record.time_ratios) == 12
    assert ENGINES[REFERENCE].exact


@pytest.mark.parametrize("engine", [name for name, engine in ENGINES.items() if engine.exact])
def test_exact_engines_are_at_no_distance_and_decide_alike(engine):
    plan = ComparisonPlan(n_trials=2, n_actions=2, n_objects=4, n_remembered=2, n_learning_actions=2)
    summary = summarise(compare(plan, [engine]))[engine]
    assert summary["exact"]
    if summary["refused"] is None:
        assert summary["total_variation"]["worst"] < 1e-12
        assert summary["same_decision"]["rate"] == 1


def test_an_engine_too_small_for_the_trials_says_so_and_the_others_go_on():
    plan = ComparisonPlan(n_trials=1, n_actions=6, n_remembered=5)
    summary = summarise(compare(plan, ["enumeration", REFERENCE]))
    assert "explanations" in summary["enumeration"]["refused"]
    assert "total_variation" not in summary["enumeration"]
    assert summary[REFERENCE]["looks"] == 7


def test_the_same_seed_compares_the_same_trials():
    def errors(seed):
        records = compare(ComparisonPlan(n_trials=2, n_actions=2, n_remembered=2), ["gtsam"], seed)
        return records["gtsam"].total_variation

    assert errors(0) == errors(0)


def test_the_memory_holds_the_plans_objects():
    memory = SMALL.learned_memory(np.random.default_rng(0))
    assert len(memory) == 3
    assert all(1 < graph.n_known <= 5 for graph in memory)


@pytest.mark.parametrize(
    "sizes", [{"n_trials": 0}, {"n_actions": 0}, {"n_remembered": 101}, {"n_remembered": -1}, {"n_objects": 0}]
)
def test_bad_sizes_are_refused(sizes):
    with pytest.raises(InvalidInputError, match=next(iter(sizes))):
        ComparisonPlan(**sizes)
