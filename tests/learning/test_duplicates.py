import math
from dataclasses import replace

import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.experiments.scores import summarise
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.inference.chain import build_chain, forward_pass
from atg_fg.inference.history import History
from atg_fg.learning.duplicates import find_duplicates, log_evidence_of_counts, merge_duplicates, passages
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.memory_files import load_memory
from atg_fg.storage.presets import preset
from tests.learning.test_structured_memory import add
from tests.learning.worlds import ARCUBES, cubes, trial_of

SMALL = Assumptions(6, 4, ("push", "pull"), PatternAlphabet(("front",), 7))


def walk(length, seed):
    rng = np.random.default_rng(seed)
    return rng.integers(6, size=length + 1).tolist(), rng.integers(2, size=length).tolist()


def split(order):
    """The cubes with these numbers, each seen in ten random actions, as ATGs of their own."""
    rng = np.random.default_rng(3)
    memory = StructuredMemory(ARCUBES)
    for number in order:
        add(memory, trial_of(cubes(6)[number], 12, rng))
    return memory


@pytest.mark.parametrize("overlap", [0, 1, 2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_the_evidence_of_counts_is_that_of_the_filter_for_a_walk_that_repeats_nothing(seed, overlap):
    # Without contradictions: then what was seen as an error of look or action is of the order of the noise.
    parameters = ModelParameters(1e-7, 1e-7, learn_in_trial=True)
    rng = np.random.default_rng(seed)
    patterns, actions = rng.permutation(7)[:6].tolist(), rng.integers(2, size=5).tolist()
    memory = RobotMemory(replace(SMALL, n_aspects=6))
    memory.learn(patterns[: 1 + overlap], actions[:overlap], None)
    graph = AspectTransitionGraph("walk", memory.assumptions)
    graph.learn(patterns[1:], actions[1:])
    evidence = [Evidence.of_detection(SMALL.alphabet, SMALL.alphabet.patterns[pattern]) for pattern in patterns[1:]]
    joint = forward_pass(build_chain(memory, parameters, History(evidence, actions[1:]))).log_joint
    expected = joint - np.log([1 / 6, 5 / 6])
    known = [memory["object-000"], AspectTransitionGraph("new", memory.assumptions)]
    found = [log_evidence_of_counts(graph, start, parameters) for start in known]
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_repeats_are_those_of_the_dirichlet_posterior_mean():
    parameters = ModelParameters(0.0, 0.0)
    graph, known = (AspectTransitionGraph(name, SMALL) for name in ("many", "known"))
    for each, count in ((graph, 3), (known, 2)):
        each.add_aspect((0,))
        each.add_aspect((1,))
        each.add_transition(0, 0, 1, count)
    known.add_transition(0, 0, 0, 1)
    assert log_evidence_of_counts(graph, known, parameters) == pytest.approx(
        math.log(1 / 4) + math.log(2 / 3) + math.log(3 / 4) + math.log(4 / 5)
    )


def test_a_count_as_large_as_a_file_may_hold_takes_no_time():
    graph = AspectTransitionGraph("often", SMALL)
    graph.add_aspect((0,))
    graph.add_transition(0, 0, 0, 2**53)
    assert math.isfinite(log_evidence_of_counts(graph, graph, ModelParameters()))


@pytest.mark.parametrize("seed", range(4))
def test_passages_are_all_transitions_and_each_aspect_is_reached_once(seed):
    graph = AspectTransitionGraph("walk", SMALL)
    graph.learn(*walk(6, seed))
    graph.learn(*walk(3, seed + 10))
    seen, patterns = set(), graph.pattern_indices
    counts = {}
    for passage in passages(graph):
        if passage.source is None:
            assert passage.target not in seen
        else:
            assert passage.source in seen
            counts[passage.source, passage.action, passage.target] = passage.times
        seen.add(passage.target)
    assert counts == {(patterns[x], a, patterns[y]): count for (x, a, y), count in graph.counts.items()}
    assert seen == set(patterns)


def test_two_atgs_of_one_cube_are_found_by_the_structure_and_no_others():
    memory = split([0, 1, 2, 0, 3, 1, 4])
    found = find_duplicates(memory, preset("learned"))
    assert {(each.keep, each.drop) for each in found} == {("object-000", "object-003"), ("object-001", "object-005")}
    assert found == find_duplicates(memory.copy(), preset("learned"))
    of = find_duplicates(memory, preset("learned"), of=["object-003"])
    assert [(each.keep, each.drop) for each in of] == [("object-000", "object-003")]
    assert len(find_duplicates(memory, preset("learned"), -1e9)) == 21


def test_the_odds_hardly_depend_on_which_of_the_two_is_asked_about():
    memory = split([0, 1, 0])
    for parameters in (preset("learned"), preset("default")):
        asked = [find_duplicates(memory, parameters, -1e9, [name]) for name in ("object-000", "object-002")]
        odds = [next(each.log_odds for each in found if each.drop == "object-002") for found in asked]
        assert odds[0] == pytest.approx(odds[1], abs=1.0)


def test_plain_atgs_that_agree_are_found_and_those_that_do_not_are_not():
    memory = RobotMemory(ARCUBES)
    rng = np.random.default_rng(0)
    for number in (0, 0, 1):
        trial = trial_of(cubes(2)[number], 60, rng)
        patterns = [Evidence.of_detection(ARCUBES.alphabet, look).pattern for look in trial.detections]
        memory.learn(patterns, list(trial.actions), None)
    (found,) = find_duplicates(memory, preset("default"))
    assert (found.keep, found.drop) == ("object-000", "object-001")
    assert merge_duplicates(memory, preset("default"), "object-001") == [found]
    assert memory.names == ("object-000", "object-002")
    assert merge_duplicates(memory, preset("default"), "object-000") == []


def test_the_prior_is_that_of_the_objects_without_an_atg():
    few, many = (RobotMemory(replace(SMALL, n_objects=n)) for n in (2, 1000))
    for memory in (few, many):
        for _ in range(2):
            memory.learn([0, 1], [0], None)
    odds = [find_duplicates(memory, preset("default"), -1e9)[0].log_odds for memory in (few, many)]
    assert odds[0] - odds[1] == pytest.approx(math.log(999))


def test_what_is_no_threshold_or_no_atg_is_refused():
    memory = split([0])
    with pytest.raises(InvalidInputError, match="threshold: nan"):
        find_duplicates(memory, preset("learned"), math.nan)
    with pytest.raises(UnknownNameError, match="cup"):
        find_duplicates(memory, preset("learned"), of=["cup"])


def test_a_test_counts_merges_and_false_ones_and_goes_on_where_it_stopped(tmp_path):
    noise = {"slip": 0.02, "wrong": 0.005}
    plan = TestPlan(world_options=noise, engine="bayes-filter", parameters=preset("robot"), merge_duplicates=True)
    whole = run_test(plan, 0, tmp_path / "records", memories=tmp_path / "memories")
    assert whole.merges == (0, 1)
    summary = summarise([whole])
    assert (summary["merges"], summary["false_merges"], summary["tests"][0]["merges"]) == (1, 0, 1)
    assert len(load_memory(tmp_path / "memories" / "memory-0000.json").merges) == 1
    (log,) = (tmp_path / "records").iterdir()
    log.write_bytes(log.read_bytes()[:-300])  # as if it had been stopped
    assert run_test(plan, 0, tmp_path / "records", resume=True) == whole


def test_without_the_option_nothing_is_said_of_merges():
    result = run_test(TestPlan(engine="bayes-filter", n_trials=3), 0)
    assert result.merges is None
    assert "merges" not in summarise([result])
    assert "merges" not in summarise([result])["tests"][0]
