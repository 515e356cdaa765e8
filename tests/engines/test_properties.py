"""What holds for every model, whatever its numbers."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from atg_fg.core.errors import ImpossibleEvidenceError
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.inference.interface import Inference
from tests.models import Case, Look, cases
from tests.small import EXACT_ENGINES, ROUTES

#: The routes make the whole graph anew at each question: each example plays one of them.
A_ROUTE = "a route of gtsam"

every_exact_engine = pytest.mark.parametrize(
    "engine", [*(each for each in EXACT_ENGINES if each not in ROUTES), A_ROUTE]
)


def played(engine: str, case: Case) -> Inference:
    """The case's trial up to its last look."""
    if engine == A_ROUTE:
        sizes = len(case.looks), len(case.graphs), case.n_symbols, case.n_actions, case.n_aspects
        engine = ROUTES[sum(sizes) % len(ROUTES)]
    inference = begin_trial(engine, case.memory, case.parameters)
    try:
        for time, look in enumerate(case.looks):
            if time:
                inference.act(case.actions[time - 1])
            inference.observe(look.evidence(case.assumptions.alphabet))
    except ImpossibleEvidenceError:
        assume(False)
    return inference


def close(actual: object, expected: object) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12)


def same_answers(actual: Inference, expected: Inference) -> None:
    close(actual.identity().objects, expected.identity().objects)
    close(actual.identity().unseen, expected.identity().unseen)
    close(actual.identity().entropy, expected.identity().entropy)
    close(actual.log_evidence, expected.log_evidence)
    close(actual.expected_entropies(), expected.expected_entropies())


@every_exact_engine
@given(case=cases())
def test_probabilities_sum_to_one(engine: str, case: Case) -> None:
    inference = played(engine, case)
    belief = inference.identity()
    assert (belief.objects >= 0).all()
    assert belief.unseen >= 0
    assert belief.objects.sum() + belief.unseen == pytest.approx(1, abs=1e-12)
    for i in range(len(belief.objects) + 1):
        if np.append(belief.objects, belief.unseen)[i] > 0:
            for distribution in inference.smoothed_aspects(i):
                assert (distribution >= 0).all()
                assert distribution.sum() == pytest.approx(1, abs=1e-12)


@every_exact_engine
@given(case=cases())
def test_an_action_is_never_expected_to_raise_the_entropy(engine: str, case: Case) -> None:
    inference = played(engine, case)
    entropies = inference.expected_entropies()
    assert entropies.shape == (case.n_actions,)
    assert (entropies >= 0).all()
    assert (entropies <= inference.identity().entropy + 1e-12).all()


@every_exact_engine
@given(case=cases())
def test_asking_changes_nothing(engine: str, case: Case) -> None:
    inference, asked = played(engine, case), played(engine, case)
    for _ in range(2):
        asked.expected_entropies()
        asked.identity()
        asked.chain()
        asked.smoothed_aspects(len(case.graphs)) if asked.identity().unseen > 0 else None
    same_answers(asked, inference)


@every_exact_engine
@given(case=cases(), data=st.data())
def test_reordering_the_memory_reorders_the_posterior_and_nothing_else(
    engine: str, case: Case, data: st.DataObject
) -> None:
    order = data.draw(st.permutations(range(len(case.graphs))))
    inference = played(engine, case)
    reordered = played(engine, replace(case, graphs=tuple(case.graphs[i] for i in order)))
    close(reordered.identity().objects, inference.identity().objects[list(order)])
    close(reordered.identity().unseen, inference.identity().unseen)
    close(reordered.log_evidence, inference.log_evidence)
    close(reordered.expected_entropies(), inference.expected_entropies())


@every_exact_engine
@given(case=cases(), data=st.data())
def test_other_names_for_the_symbols_change_nothing(engine: str, case: Case, data: st.DataObject) -> None:
    new = data.draw(st.permutations(range(case.n_symbols)))
    same_answers(played(engine, case.with_symbols(new)), played(engine, case))


@every_exact_engine
@given(case=cases(), data=st.data())
def test_other_names_for_the_actions_reorder_the_expected_entropies_and_nothing_else(
    engine: str, case: Case, data: st.DataObject
) -> None:
    new = data.draw(st.permutations(range(case.n_actions)))
    inference, renamed = played(engine, case), played(engine, case.with_actions(new))
    close(renamed.identity().objects, inference.identity().objects)
    close(renamed.log_evidence, inference.log_evidence)
    close(renamed.expected_entropies()[list(new)], inference.expected_entropies())


@every_exact_engine
@given(case=cases(), data=st.data())
def test_acting_and_seeing_nothing_tell_nothing_of_the_object(engine: str, case: Case, data: st.DataObject) -> None:
    inference = played(engine, case)
    before, log_evidence = inference.identity(), inference.log_evidence
    inference.act(data.draw(st.integers(0, case.n_actions - 1)))
    after_action = inference.identity()
    close(np.append(after_action.objects, after_action.unseen), np.append(before.objects, before.unseen))
    ones = Evidence.of_likelihood(case.assumptions.alphabet, np.ones(len(case.patterns)))
    inference.observe(data.draw(st.sampled_from((ones, case.nothing.evidence(case.assumptions.alphabet)))))
    after_look = inference.identity()
    close(np.append(after_look.objects, after_look.unseen), np.append(before.objects, before.unseen))
    close(inference.log_evidence, log_evidence)


@every_exact_engine
@given(case=cases(), exponent=st.floats(-30, 30), data=st.data())
def test_evidence_scaled_by_c_adds_ln_c_to_the_log_evidence_and_nothing_else(
    engine: str, case: Case, exponent: float, data: st.DataObject
) -> None:
    weights = [data.draw(st.sampled_from((0.0, 0.25, 1.0, 2.5))) for _ in case.patterns]
    assume(any(weights))
    plain = replace(case, looks=(*case.looks[:-1], Look(weights=tuple(weights))))
    scaled = Look(weights=tuple(weight * 10**exponent for weight in weights))
    expected, actual = played(engine, plain), played(engine, replace(plain, looks=(*plain.looks[:-1], scaled)))
    close(actual.identity().objects, expected.identity().objects)
    close(actual.expected_entropies(), expected.expected_entropies())
    close(actual.log_evidence, expected.log_evidence + exponent * log(10))


@every_exact_engine
@given(case=cases())
def test_a_remembered_twin_shares_its_probability_alike(engine: str, case: Case) -> None:
    assume(case.graphs)
    twins = replace(case, graphs=(*case.graphs, case.graphs[0]))
    objects = played(engine, twins).identity().objects
    close(objects[-1], objects[0])


@every_exact_engine
@given(case=cases())
def test_the_memory_is_not_changed_by_a_trial(engine: str, case: Case) -> None:
    assert played(engine, case).memory == case.memory
