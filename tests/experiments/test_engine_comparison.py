import numpy as np
import pytest

from atg_fg import AspectTransitionGraph, ModelParameters, TrialRecord, begin_trial, compare_engines
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.core.recordings import RecordedLook, RecordedTrial
from atg_fg.engines import ENGINES
from atg_fg.engines.bayes_filter import BayesFilter
from atg_fg.experiments.engine_comparison import REFERENCE, ComparisonPlan, Course, compare, summarise, total_variation
from atg_fg.inference.expected_entropy import best_actions

SMALL = ComparisonPlan(n_trials=3, n_actions=3, n_objects=6, n_remembered=3, n_learning_actions=4)


def test_the_reference_is_itself():
    record = compare(SMALL, [REFERENCE])[REFERENCE]
    assert record.total_variation.tolist() == [0.0] * 12
    assert record.same_decision.tolist() == [True] * 12
    assert record.seconds.shape == record.reference_seconds.shape == record.time_ratios.shape == (12,)
    assert (record.seconds > 0).all()
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
        return records["gtsam"].total_variation.tolist()

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


class Hasty(BayesFilter):
    """An engine of a user's own, which does not look at the second action."""

    name = "hasty"
    exact = False

    def compute_expected_entropies(self):
        return np.array([0.0, *super().compute_expected_entropies()[1:]])


@pytest.fixture
def mug():
    """A memory with a mug in it, and trials as a recording and as records have them: (memory, recorded, run)."""
    alphabet = PatternAlphabet.named(("view",), ("logo", "handle", "plain"))
    memory = RobotMemory(Assumptions(3, 3, ("rotate", "tip"), alphabet))
    graph = AspectTransitionGraph("mug", memory.assumptions)
    logo, handle = (graph.add_aspect(pattern) for pattern in (("logo",), ("handle",)))
    graph.add_transition(logo, 0, handle)
    memory.add(graph)
    looks = [("logo",), ("handle",), (None,)]
    recorded = RecordedTrial("1", tuple(map(RecordedLook, looks)), ("rotate", "tip"))
    evidence = [Evidence.of_detection(alphabet, look) for look in looks]
    return memory, recorded, TrialRecord.from_looks(memory.assumptions, evidence, ["rotate", "tip"])


def test_engines_follow_trials_of_ones_own(mug):
    memory, recorded, run = mug
    parameters = ModelParameters(0.1, 0.1)
    courses = [Course.of(each, memory.assumptions) for each in (recorded, run)]
    assert [look.detection for look in courses[0].looks] == [look.detection for look in courses[1].looks]
    records = compare_engines(["mean-field", Hasty], memory, [recorded, run, courses[0]], parameters)
    assert records["mean-field"].total_variation.shape == (9,)
    assert records["mean-field"].total_variation[:3].tolist() == records["mean-field"].total_variation[3:6].tolist()
    # By hand: what is compared is the belief after each look.
    one, other = (begin_trial(engine, memory, parameters) for engine in ("mean-field", REFERENCE))
    for look, evidence in enumerate(courses[0].looks):
        one.observe(evidence)
        other.observe(evidence)
        assert records["mean-field"].total_variation[look] == total_variation(one, other)
        right = 0 in best_actions(other.expected_entropies())
        assert records["hasty"].same_decision[look] == right
        for inference in (one, other) if look < 2 else ():
            inference.act(courses[0].actions[look])


def test_an_engine_is_compared_with_options(mug):
    memory, recorded, _ = mug
    few, many = "particle(n_particles=2)", "particle(n_particles=20000, seed=1)"
    records = compare_engines([few, many], memory, [recorded] * 5, ModelParameters(0.5, 0.2))
    assert list(records) == [few, many]
    assert records[few].total_variation.mean() > 3 * records[many].total_variation.mean() > 0


@pytest.mark.parametrize(
    ("engine", "error", "message"),
    [
        ("magic", UnknownNameError, "magic"),
        ("gtsam(particles=3)", InvalidInputError, "unknown option 'particles'; expected none"),
        ("particle(particles=3)", InvalidInputError, "unknown option 'particles'; expected one of: n_particles, seed"),
        ("particle(3)", InvalidInputError, r"'particle\(3\)'.*expected name\(option=value\)"),
        ("particle(seed=open('x'))", InvalidInputError, "expected name"),
        ("particle(seed=1", InvalidInputError, "expected name"),
        ("particle(seed=1)(2)", InvalidInputError, "expected name"),
    ],
)
def test_engines_and_options_that_are_none_are_refused_before_the_first_trial(mug, engine, error, message):
    memory, recorded, _ = mug
    with pytest.raises(error, match=message):
        compare_engines([REFERENCE, engine], memory, [recorded], on_trial=pytest.fail)


def test_no_trials_are_refused(mug):
    with pytest.raises(InvalidInputError, match="trials: none"):
        compare_engines([REFERENCE], mug[0], [])
