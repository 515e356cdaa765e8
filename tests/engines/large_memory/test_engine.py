"""The engine for large memories: never further from exact than it says, and never another decision."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError, TooLargeError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import begin_trial
from atg_fg.engines.large_memory import engine as large_memory_engine
from atg_fg.engines.large_memory.aspect_filter import AspectFilter
from atg_fg.engines.large_memory.engine import LargeMemory
from atg_fg.engines.large_memory.matched_rows import MatchedRows
from atg_fg.experiments.engine_comparison import total_variation
from atg_fg.inference.expected_entropy import best_actions
from tests.models import Case, Look, cases, random_case
from tests.oracle import Atg
from tests.small import graph, one_slot, seen

WORLD = one_slot(30, 4, 12, ("push", "pull"))


def begun(case: Case, **options: Any) -> LargeMemory:
    inference = begin_trial("large-memory", case.memory, case.parameters, **options)
    assert isinstance(inference, LargeMemory)
    return inference


def many_objects(seed: int) -> Case:
    """Twelve objects over 20 patterns, of which a trial shows few: most objects never match."""
    rng = np.random.default_rng([5, seed])
    n_aspects = int(rng.integers(2, 7))
    graphs = []
    for _ in range(12):
        known = [(int(z),) for z in rng.permutation(20)[: rng.integers(n_aspects + 1)]]
        edges = {
            (known[rng.integers(len(known))], int(rng.integers(2)), known[rng.integers(len(known))]): 1
            for _ in range(2 * len(known))
        }
        graphs.append(Atg(known, edges))
    n_looks = int(rng.integers(2, 8))
    shown = rng.choice(rng.permutation(20)[:4], n_looks)
    return Case(
        n_slots=1,
        n_symbols=20,
        n_objects=int(rng.choice([12, 40])),
        n_aspects=n_aspects,
        n_actions=2,
        graphs=tuple(graphs),
        alpha=float(rng.choice([0.0, 1e-8, 0.1, 1.0])),
        delta=float(rng.choice([0.0, 1e-8, 1e-3, 0.1, 0.5])),
        learn_in_trial=bool(rng.integers(2)),
        looks=tuple(Look((int(z),)) for z in shown),
        actions=tuple(int(a) for a in rng.integers(2, size=n_looks - 1)),
    )


def follow_both(case: Case, **options: Any) -> list[tuple[LargeMemory, Any]]:
    """Go through a case with both engines; return them after checking each look and action against the bounds."""
    tried, exact = begun(case, **options), begin_trial("bayes-filter", case.memory, case.parameters)
    alphabet = case.assumptions.alphabet
    for time, look in enumerate(case.looks):
        evidence = look.evidence(alphabet)
        try:
            exact.observe(evidence)
        except ImpossibleEvidenceError:
            with pytest.raises(ImpossibleEvidenceError):
                tried.observe(evidence)
            exact.observe(case.nothing.evidence(alphabet))
            evidence = case.nothing.evidence(alphabet)
        if len(tried.history.evidence) == time:
            tried.observe(evidence)
        assert total_variation(tried, exact) <= tried.total_variation_bound + 1e-12
        expected, reference = tried.expected_entropies(), exact.expected_entropies()
        np.testing.assert_allclose(expected, reference, rtol=0, atol=tried._decide().bound + 1e-12)
        assert best_actions(expected) == best_actions(reference)
        if time < len(case.actions):
            tried.act(case.actions[time])
            exact.act(case.actions[time])
            assert total_variation(tried, exact) <= tried.total_variation_bound + 1e-12
    return [(tried, exact)]


@settings(max_examples=3 * settings.default.max_examples)
@given(case=cases(), n_exact=st.sampled_from((0, 100)))
def test_no_random_model_is_further_off_than_the_bound_and_all_decisions_are_the_same(case: Case, n_exact: int) -> None:
    follow_both(case, n_exact=n_exact)


@pytest.mark.parametrize("chunk", range(4))
def test_memories_in_which_most_objects_never_match_keep_the_bound(chunk: int) -> None:
    bounds, some_fell_back, some_did_not = [], False, False
    for seed in range(chunk * 40, (chunk + 1) * 40):
        ((tried, _),) = follow_both(many_objects(seed), n_exact=0)
        bounds.append(tried.total_variation_bound)
        if len(tried._objects) < 12 and not tried.history.awaits_evidence and tried.total_variation_bound > 0:
            some_fell_back |= tried.fell_back
            some_did_not |= not tried.fell_back
    assert max(bounds) > 1e-3  # the bound is put to the test …
    assert sum(0 < bound < 1e-6 for bound in bounds) >= 3  # … and is small where noise is
    assert some_fell_back
    assert some_did_not


def test_the_first_interval_is_right_by_hand() -> None:
    # One object with n = 2 of G = 4 aspects, not matched by looks at 5 and 6 among 12 patterns; δ = 0.12, so d = 0.01.
    # r = 0.88 / 10. After the first look C holds (r + d) / 2 = 0.049 and the others 2/4 · d = 0.005.
    # Their edges either bring them to the base (upper: besides, they keep all) or keep them (lower: half).
    known = graph(WORLD, "A", [(0,), (1,)], (0, 0, 1, 1), (1, 0, 0, 1))
    parameters = ModelParameters(0.0, 0.12, learn_in_trial=False)
    inference = begin_trial("large-memory", RobotMemory(WORLD, [known]), parameters, n_exact=0)
    inference.observe(seen(WORLD, 5))
    assert inference.total_variation_bound == 0
    inference.act(0)
    inference.observe(seen(WORLD, 6))
    d, r = 0.01, 0.088
    upper = 0.054 * ((r + d) / 2 + d / 2) + d * 0.005
    lower = 0.049 * ((r + d) / 2 + d / 2) + d * 0.0025
    weight, other = (upper + lower) / 2 / 30, 29 / 30 / 144
    assert inference.identity().objects[0] == pytest.approx(weight / (weight + other), rel=1e-12)
    expected = (upper - lower) / 2 / 30 / (weight + other)
    assert inference.total_variation_bound == pytest.approx(expected, rel=1e-12)


def test_an_object_that_matches_late_is_exact_from_there_on() -> None:
    for seed in range(30):
        case = many_objects(seed)
        every = replace(case, looks=(*case.looks[:-1], case.nothing))
        ((tried, exact),) = follow_both(every, n_exact=0)
        # A look at nothing tells aspects known before the trial from none, so all objects have to be told apart.
        assert len(tried._objects) == 12
        assert tried.total_variation_bound == 0
        np.testing.assert_allclose(tried.aspect_belief, exact.aspect_belief, rtol=0, atol=1e-12)
        assert tried.log_evidence == pytest.approx(exact.log_evidence, abs=1e-12)


def test_few_objects_are_all_exact() -> None:
    for seed in range(60):
        case = random_case(np.random.default_rng([6, seed]))
        ((tried, exact),) = follow_both(case)
        np.testing.assert_allclose(tried.aspect_belief, exact.aspect_belief, rtol=0, atol=1e-12)


def test_without_noise_there_is_nothing_to_bound() -> None:
    for seed in range(60):
        case = replace(many_objects(seed), alpha=0.0, delta=0.0)
        ((tried, exact),) = follow_both(case, n_exact=0)
        assert tried.total_variation_bound <= 1e-15
        assert total_variation(tried, exact) <= 1e-12


def test_only_what_matches_is_followed_one_by_one() -> None:
    memory = RobotMemory(WORLD, [graph(WORLD, f"object-{i}", [(i % 6,)]) for i in range(24)])
    inference = begin_trial("large-memory", memory, ModelParameters(), n_exact=0)
    assert isinstance(inference, LargeMemory)
    for symbol, matched in ((0, 4), (9, 4), (0, 4), (3, 8)):
        inference.observe(seen(WORLD, symbol))
        assert len(inference._objects) == matched
        inference.act(0)


def test_asking_changes_nothing_even_where_all_objects_have_to_be_computed() -> None:
    n_fell_back = 0
    for seed in range(40):
        case = replace(many_objects(seed), delta=0.3)
        asked, unasked = begun(case, n_exact=0), begun(case, n_exact=0)
        for time, look in enumerate(case.looks):
            for each in (asked, unasked):
                each.observe(look.evidence(case.assumptions.alphabet))
            asked.expected_entropies()
            n_fell_back += asked.fell_back
            if time < len(case.actions):
                asked.act(case.actions[time])
                unasked.act(case.actions[time])
        np.testing.assert_array_equal(asked.identity().probabilities, unasked.identity().probabilities)
        if not asked.history.awaits_evidence:
            np.testing.assert_array_equal(asked.expected_entropies(), unasked.expected_entropies())
    assert n_fell_back >= 20


def test_a_prior_that_tells_objects_apart_is_followed_exactly() -> None:
    case = many_objects(3)
    weights = np.arange(1.0, 14.0)
    prior = IdentityBelief.of(weights / weights.sum(), case.memory.n_unseen)
    tried, exact = (
        begin_trial(engine, case.memory, case.parameters, prior, **options)
        for engine, options in (("large-memory", {"n_exact": 0}), ("bayes-filter", {}))
    )
    for each in (tried, exact):
        each.observe(case.looks[0].evidence(case.assumptions.alphabet))
    np.testing.assert_allclose(tried.identity().probabilities, exact.identity().probabilities, rtol=0, atol=1e-12)


def test_smoothed_aspects_are_exact_of_objects_that_never_matched_too() -> None:
    case = replace(many_objects(1), delta=0.1, alpha=0.1)
    tried, exact = begun(case, n_exact=0), begin_trial("bayes-filter", case.memory, case.parameters)
    for time, look in enumerate(case.looks):
        for each in (tried, exact):
            each.observe(look.evidence(case.assumptions.alphabet))
            if time < len(case.actions):
                each.act(case.actions[time])
    for hypothesis in range(13):
        for ours, theirs in zip(tried.smoothed_aspects(hypothesis), exact.smoothed_aspects(hypothesis), strict=True):
            padded = np.pad(ours, (0, len(theirs) - len(ours)))
            np.testing.assert_allclose(padded, theirs, rtol=0, atol=1e-12)


def test_tables_that_would_be_too_large_are_refused_and_the_rest_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(large_memory_engine, "MAX_CELLS", 100)
    case = many_objects(2)
    inference = begun(case, n_exact=0)
    inference.observe(case.looks[0].evidence(case.assumptions.alphabet))
    for asked in (inference.belief_components, inference.belief_tree, inference.shown_patterns):
        with pytest.raises(TooLargeError, match="12 objects and 20 patterns"):
            asked()
    assert inference.expected_entropies().shape == (2,)
    assert len(inference.smoothed_aspects(0)) == 1


@pytest.mark.parametrize("n_exact", [-1, 0.5, True, "few"])
def test_an_option_with_a_bad_value_is_refused(n_exact: object) -> None:
    with pytest.raises(InvalidInputError, match="n_exact"):
        begin_trial("large-memory", RobotMemory(WORLD), ModelParameters(), n_exact=n_exact)


@pytest.mark.parametrize("n_exact", [0, 100])
def test_a_look_costs_as_much_late_in_a_trial_as_early(n_exact: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only objects that match for the first time are taken through the trial again, and here all match at once."""
    graphs = [graph(WORLD, str(i), [(i,), (11,)], (0, 0, 1, 2), (1, 1, 0, 1)) for i in range(5)]
    inference = begin_trial("large-memory", RobotMemory(WORLD, graphs), ModelParameters(0.1, 0.1), n_exact=n_exact)
    steps = [0]
    for filter_ in (AspectFilter, MatchedRows):

        def counted(self: Any, action: int, predict: Any = filter_.predict) -> None:
            steps[-1] += 1
            predict(self, action)

        monkeypatch.setattr(filter_, "predict", counted)
    for look in range(200):
        inference.observe(seen(WORLD, 11 if look % 2 else 0))
        inference.expected_entropies()
        steps.append(0)
        inference.act(look % 2)
    assert max(steps[3:]) == len(inference._filters())
