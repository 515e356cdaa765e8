"""Compiled loops say what NumPy says, to 1e-12: in any model, at any length of trial, whatever was learned between."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import ImpossibleEvidenceError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import begin_trial
from atg_fg.inference.expected_entropy import next_pattern_joint, pattern_table
from atg_fg.inference.interface import Inference
from atg_fg.inference.kernels import compilation
from tests.models import cases

ASSUMPTIONS = Assumptions(9, 5, ("turn", "tip"), PatternAlphabet(("front", "top"), 4))
MODEL = ModelParameters(transition_concentration=0.1, observation_noise=0.01, learn_in_trial=True)


def begun(memory: RobotMemory, parameters: ModelParameters, compile_loops: bool) -> Inference:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(compilation.SWITCH, "1" if compile_loops else "0")
        return begin_trial("bayes-filter", memory, parameters)


def both(memory: RobotMemory, parameters: ModelParameters = MODEL) -> tuple[Inference, Inference]:
    """The compiled engine and the one in NumPy at the beginning of the same trial."""
    compiled, plain = begun(memory, parameters, True), begun(memory, parameters, False)
    assert (type(compiled.model).__name__, type(plain.model).__name__) == ("TablesOnDemand", "RecognitionModel")
    return compiled, plain


def assert_same(pair: tuple[Inference, Inference]) -> None:
    compiled, plain = pair
    for question in (
        lambda inference: inference.identity().probabilities,
        lambda inference: inference.aspect_belief,
        lambda inference: inference.log_evidence,
    ):
        np.testing.assert_allclose(question(compiled), question(plain), rtol=0, atol=1e-12)
    if not plain.history.awaits_evidence:
        expected = plain.expected_entropies()
        np.testing.assert_allclose(compiled.expected_entropies(), expected, rtol=0, atol=1e-12)
        everyone = np.arange(plain.model.n_hypotheses)[::-1].copy()
        table = pattern_table(plain.model, next_pattern_joint(plain.model, plain.aspect_belief), everyone)
        looks = compiled._compiled.next_patterns(compiled.identity().probabilities, everyone)
        np.testing.assert_allclose(looks, table, rtol=0, atol=1e-12)


def observed(inference: Inference, evidence: Evidence) -> bool:
    """Let it look; return whether that was possible."""
    try:
        inference.observe(evidence)
    except ImpossibleEvidenceError:
        return False
    return True


def follow(pair: tuple[Inference, Inference], patterns: list[int], actions: list[int]) -> None:
    for time, pattern in enumerate(patterns):
        evidence = Evidence.of_detection(ASSUMPTIONS.alphabet, ASSUMPTIONS.alphabet.patterns[pattern])
        for inference in pair:
            if time:
                inference.act(actions[time - 1])
            inference.observe(evidence)
        assert_same(pair)


def trial(rng: np.random.Generator, n_looks: int) -> tuple[list[int], list[int]]:
    return rng.integers(len(ASSUMPTIONS.alphabet), size=n_looks).tolist(), rng.integers(2, size=n_looks - 1).tolist()


def memory_of(n_objects: int, n_looks: int = 6) -> RobotMemory:
    memory, rng = RobotMemory(ASSUMPTIONS), np.random.default_rng(1)
    for _ in range(n_objects):
        memory.learn(*trial(rng, n_looks), matched=None)
    return memory


@given(case=cases())
def test_every_small_model_gives_the_same_after_each_look_and_action(case) -> None:
    pair = both(case.memory, case.parameters)
    assert_same(pair)
    for time, look in enumerate(case.looks):
        if time:
            for inference in pair:
                inference.act(case.actions[time - 1])
            assert_same(pair)
        possible = [observed(inference, look.evidence(case.assumptions.alphabet)) for inference in pair]
        assert possible[0] == possible[1]
        assert_same(pair)
        if not possible[0]:
            return


def test_a_trial_goes_on_after_rows_had_no_more_room() -> None:
    follow(both(memory_of(3)), *trial(np.random.default_rng(2), 60))


@pytest.mark.parametrize("n_objects", [0, 1, 1500])
def test_any_number_of_objects(n_objects: int) -> None:
    follow(both(memory_of(n_objects)), *trial(np.random.default_rng(3), 4))


def turned(memory: RobotMemory, rng: np.random.Generator) -> None:
    memory.learn(*trial(rng, 9), matched=None)


def known_again(memory: RobotMemory, rng: np.random.Generator) -> None:
    memory.learn(*trial(rng, 9), matched=memory.names[int(rng.integers(len(memory)))])


def counted_in_place(memory: RobotMemory, rng: np.random.Generator) -> None:
    memory[memory.names[0]].add_transition(0, int(rng.integers(2)), 0, 3)


def aspect_in_place(memory: RobotMemory, rng: np.random.Generator) -> None:
    graph = AspectTransitionGraph(f"blank {rng.integers(2**60)}", ASSUMPTIONS)
    memory.add(graph)
    begun(memory, MODEL, True)
    graph.add_aspect(ASSUMPTIONS.alphabet.patterns[int(rng.integers(12))])


def merged(memory: RobotMemory, rng: np.random.Generator) -> None:
    if len(memory) > 2:
        memory.merge(memory.names[0], memory.names[1])


CHANGES = (turned, known_again, counted_in_place, aspect_in_place, merged)


@given(changes=st.lists(st.sampled_from(CHANGES), max_size=12), seed=st.integers(0, 2**32 - 1))
def test_tables_that_are_kept_follow_whatever_a_memory_learns(changes, seed: int) -> None:
    memory, rng = memory_of(2), np.random.default_rng(seed)
    for change in changes:
        change(memory, rng)
        follow(both(memory), *trial(rng, 3))


def test_a_trial_is_not_touched_by_what_the_memory_learns_meanwhile() -> None:
    memory, rng = memory_of(3), np.random.default_rng(4)
    patterns, actions = trial(rng, 6)
    compiled, plain = both(memory)
    follow((compiled, plain), patterns[:3], actions)
    memory.learn(*trial(rng, 9), matched=memory.names[0])
    begun(memory, MODEL, True)
    for time in (3, 4, 5):
        evidence = Evidence.of_detection(ASSUMPTIONS.alphabet, ASSUMPTIONS.alphabet.patterns[patterns[time]])
        for inference in (compiled, plain):
            inference.act(actions[time - 1])
            inference.observe(evidence)
        assert_same((compiled, plain))
    np.testing.assert_array_equal(compiled.model.pattern_of, plain.model.pattern_of)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
def test_a_copy_goes_its_own_way(copied) -> None:
    compiled, plain = both(memory_of(3))
    follow((compiled, plain), *trial(np.random.default_rng(5), 3))
    twin, before = copied(compiled), compiled.identity().probabilities
    twin.act(0)
    twin.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, (0, 1)))
    np.testing.assert_array_equal(compiled.identity().probabilities, before)
    plain.act(0)
    plain.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, (0, 1)))
    assert_same((twin, plain))


def test_a_belief_tree_does_not_learn_what_the_trial_learns_later() -> None:
    pair = both(memory_of(3))
    follow(pair, *trial(np.random.default_rng(6), 3))
    trees = [inference.belief_tree() for inference in pair]
    expected = trees[1].expected_entropies()
    for inference in pair:
        inference.act(0)
        inference.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, (0, 1)))
    np.testing.assert_allclose(trees[0].expected_entropies(), expected, rtol=0, atol=1e-12)


def test_trials_at_once_and_one_after_the_other_share_nothing() -> None:
    memory, rng = memory_of(3), np.random.default_rng(7)
    courses = [trial(rng, 5) for _ in range(3)]
    for _ in range(3):  # the arrays of trials that are gone are used again
        pairs = [both(memory) for _ in courses]
        for time in range(5):
            for pair, (patterns, actions) in zip(pairs, courses, strict=True):
                evidence = Evidence.of_detection(ASSUMPTIONS.alphabet, ASSUMPTIONS.alphabet.patterns[patterns[time]])
                for inference in pair:
                    if time:
                        inference.act(actions[time - 1])
                    inference.observe(evidence)
                assert_same(pair)
