"""GTSAM's other ways to marginals: every ordering gives the same answers at another cost, and a trial may be long."""

from __future__ import annotations

import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError, TooLargeError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import begin_trial, gtsam_routes
from atg_fg.engines.gtsam_routes import ORDERINGS, GtsamRoute
from tests.models import random_case
from tests.small import ROUTES, each_of, graph, one_slot, seen, trial

WORLD = one_slot(3, 2, 4)
every_route = each_of(ROUTES)


def two_objects() -> RobotMemory:
    """Push swaps the two aspects of either object: A shows 0 and 1, B shows 2 and 3."""
    swaps = (0, 0, 1, 1), (1, 0, 0, 1)
    return RobotMemory(WORLD, [graph(WORLD, "A", [(0,), (1,)], *swaps), graph(WORLD, "B", [(2,), (3,)], *swaps)])


@pytest.mark.parametrize("ordering", ORDERINGS)
@pytest.mark.parametrize("engine", ["gtsam-sequential", "gtsam-multifrontal"])
def test_every_ordering_gives_the_exact_posterior(engine: str, ordering: str) -> None:
    for seed in range(20):
        case = random_case(np.random.default_rng(seed))
        inference = begin_trial(engine, case.memory, case.parameters, ordering=ordering)
        exact = begin_trial("bayes-filter", case.memory, case.parameters)
        for time, look in enumerate(case.looks):
            for either in (inference, exact):
                try:
                    either.observe(look.evidence(case.assumptions.alphabet))
                except ImpossibleEvidenceError:
                    either.observe(case.nothing.evidence(case.assumptions.alphabet))
            np.testing.assert_allclose(inference.identity().objects, exact.identity().objects, rtol=0, atol=1e-12)
            np.testing.assert_allclose(inference.expected_entropies(), exact.expected_entropies(), rtol=0, atol=1e-12)
            assert inference.log_evidence == pytest.approx(exact.log_evidence, abs=1e-12)
            if time < len(case.looks) - 1:
                inference.act(case.actions[time])
                exact.act(case.actions[time])


def test_eliminating_the_object_first_costs_a_table_over_all_aspects_and_last_does_not() -> None:
    # 3 hypotheses with 3 states each: O first couples O and all 5 aspects, 3^6; O last at most O and 2 aspects, 3^3.
    costs = {}
    for ordering in ORDERINGS:
        inference = begin_trial(
            "gtsam-multifrontal", two_objects(), ModelParameters(0.1, 0.1, learn_in_trial=False), ordering=ordering
        )
        assert isinstance(inference, GtsamRoute)
        for time, symbol in enumerate([0, 1, 0, 1, 0]):
            if time:
                inference.act(0)
            inference.observe(seen(WORLD, symbol))
        costs[ordering] = inference.elimination_cost
    assert costs["chronological"] == 3**6
    assert costs["objects-last"] == costs["colamd"] == 3**3
    assert costs["objects-last"] <= costs["metis"] <= 3**4


def test_an_ordering_that_would_take_too_much_memory_is_refused_before_it_does(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(gtsam_routes, "MAX_TABLE", 1000)
    inference = begin_trial(
        "gtsam-multifrontal", two_objects(), ModelParameters(0.1, 0.1, learn_in_trial=False), ordering="chronological"
    )
    with pytest.raises(TooLargeError, match="use another ordering"):  # noqa: PT012
        for time in range(20):
            if time:
                inference.act(0)
            inference.observe(seen(WORLD, 0))
            inference.identity()


@every_route
def test_an_object_ruled_out_for_long_comes_back(engine: str) -> None:
    # 330 looks at A, then 380 at B; on the way B weighs (0.075 / 0.775)^330 of A, below the least float.
    inference, exact = (
        begin_trial(name, two_objects(), ModelParameters(1e-8, 0.3, learn_in_trial=False))
        for name in (engine, "bayes-filter")
    )
    for time, symbol in enumerate([0, 1] * 165 + [2, 3] * 190):
        for either in (inference, exact):
            if time:
                either.act(0)
            either.observe(seen(WORLD, symbol))
    assert inference.identity().objects[1] > 0.999999
    assert inference.log_evidence == pytest.approx(exact.log_evidence, abs=1e-8)
    np.testing.assert_allclose(inference.expected_entropies(), exact.expected_entropies(), rtol=0, atol=1e-9)


@every_route
def test_aspects_of_a_trial_are_smoothed_as_by_forward_backward(engine: str) -> None:
    steps = [2, *[0, 0, 0, 3, 0, 1] * 5]
    parameters = ModelParameters(1e-8, 1e-8, learn_in_trial=False)
    route, exact = (trial(name, two_objects(), parameters, *steps) for name in (engine, "bayes-filter"))
    for hypothesis in range(3):
        expected_times = exact.smoothed_aspects(hypothesis)
        for actual, expected in zip(route.smoothed_aspects(hypothesis), expected_times, strict=True):
            np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12)


def test_discrete_marginals_take_no_ordering() -> None:
    with pytest.raises(InvalidInputError, match="no options"):
        begin_trial("gtsam-marginals", two_objects(), ModelParameters(), ordering="colamd")
