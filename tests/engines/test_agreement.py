"""Every exact engine against the exact fractions of the oracle, on 520 random models with a trial each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError
from atg_fg.engines import begin_trial
from atg_fg.inference.interface import Inference
from tests.models import Case, random_case
from tests.oracle import ImpossibleError, Oracle
from tests.small import EXACT_ENGINES, ROUTES

CHUNKS, CHUNK_SIZE = 20, 26
#: Routes make the whole graph anew at each question, which takes long; they get fewer of the models.
ROUTE_CHUNKS = 4
#: The rest is slow.
QUICK_CHUNKS, QUICK_ROUTE_CHUNKS = 2, 1
TOLERANCE = 1e-12


@dataclass(frozen=True)
class Truth:
    """All that can be asked at one point of a trial; smoothed aspects after looks and at its end (they take long)."""

    identity: list[float]
    entropy: float
    expected_entropies: list[float] | None
    log_evidence: float
    smoothed: list[list[dict[int, float]] | None]

    @classmethod
    def of(cls, oracle: Oracle, *, looked: bool, last: bool = False) -> Truth:
        smoothed = [
            times and [{oracle.state_number(i, x): float(p) for x, p in time.items()} for time in times]
            for i, times in ((i, oracle.smoothed(i)) for i in range(oracle.K + 1))
            if looked or last
        ]
        return cls(
            identity=[float(p) for p in oracle.identity()],
            entropy=oracle.entropy(),
            expected_entropies=[oracle.expected_entropy(a) for a in range(oracle.n_actions)] if looked else None,
            log_evidence=oracle.log_evidence(),
            smoothed=smoothed,
        )


@cache
def trial_of(seed: int) -> tuple[Case, list[tuple[bool, Truth]]]:
    """A case and, for each look and then each action of it, whether the look was impossible and the truth after it.

    Instead of an impossible look, nothing is seen.
    """
    case = random_case(np.random.default_rng(seed))
    oracle = case.oracle
    course = []
    for time, look in enumerate(case.looks):
        impossible = False
        try:
            oracle.observe(look.likelihood(case.patterns), look.complete)
        except ImpossibleError:
            impossible = True
            oracle.observe(case.nothing.likelihood(case.patterns), None)
        course.append((impossible, Truth.of(oracle, looked=True)))
        if time < len(case.actions):
            oracle.act(case.actions[time])
            course.append((False, Truth.of(oracle, looked=False, last=time == len(case.looks) - 1)))
    return case, course


def assert_agrees(inference: Inference, truth: Truth, place: str) -> None:
    def same(actual: object, expected: object, what: str) -> None:
        np.testing.assert_allclose(actual, expected, rtol=0, atol=TOLERANCE, err_msg=f"{place}: {what}")

    belief = inference.identity()
    same(belief.objects, truth.identity[:-1], "objects")
    same(belief.unseen, truth.identity[-1], "unseen")
    same(belief.entropy, truth.entropy, "entropy")
    same(inference.log_evidence, truth.log_evidence, "log evidence")
    if truth.expected_entropies is not None:
        same(inference.expected_entropies(), truth.expected_entropies, "expected entropies")
    for i, expected_times in enumerate(truth.smoothed):
        if expected_times is None:
            continue  # p(X | O = i) is not defined for an object that is ruled out
        actual_times = inference.smoothed_aspects(i)
        assert len(actual_times) == len(expected_times), place
        for time, (actual, expected) in enumerate(zip(actual_times, expected_times, strict=True)):
            padded = [expected.get(state, 0.0) for state in range(len(actual))]
            assert sum(padded) == pytest.approx(1), f"{place}: X{time} given O={i} lacks a state"
            same(actual, padded, f"X{time} given O={i}")


def everything(inference: Inference) -> list[object]:
    belief = inference.identity()
    possible = np.flatnonzero(np.append(belief.objects, belief.unseen))
    smoothed = [times.tolist() for i in possible for times in inference.smoothed_aspects(int(i))]
    return [belief.objects.tolist(), belief.unseen, belief.entropy, inference.log_evidence, smoothed]


def chunks():
    """Yield each engine with each chunk of models; but for the first few, they are slow."""
    for engine in EXACT_ENGINES:
        n, n_quick = (ROUTE_CHUNKS, QUICK_ROUTE_CHUNKS) if engine in ROUTES else (CHUNKS, QUICK_CHUNKS)
        for chunk in range(n):
            yield pytest.param(engine, chunk, marks=[pytest.mark.slow] if chunk >= n_quick else [])


@pytest.mark.parametrize(("engine", "chunk"), list(chunks()))
def test_every_exact_engine_gives_the_exact_posterior_at_every_step(engine: str, chunk: int) -> None:
    for seed in range(chunk * CHUNK_SIZE, (chunk + 1) * CHUNK_SIZE):
        case, course = trial_of(seed)
        inference = begin_trial(engine, case.memory, case.parameters)
        alphabet = case.assumptions.alphabet
        steps = iter(course)
        for time, look in enumerate(case.looks):
            impossible, truth = next(steps)
            if impossible:
                before = everything(inference)
                with pytest.raises(ImpossibleEvidenceError):
                    inference.observe(look.evidence(alphabet))
                assert everything(inference) == before, f"model {seed}, look {time}: changed by what cannot be"
            inference.observe((case.nothing if impossible else look).evidence(alphabet))
            assert_agrees(inference, truth, f"model {seed}, look {time}")
            if time < len(case.actions):
                inference.act(case.actions[time])
                assert_agrees(inference, next(steps)[1], f"model {seed}, action {time}")


@pytest.mark.slow
def test_the_random_models_cover_what_they_should() -> None:
    trials = [trial_of(seed) for seed in range(CHUNKS * CHUNK_SIZE)]
    every_case = [case for case, _ in trials]
    assert sum(impossible for _, course in trials for impossible, _ in course) >= 10
    assert {len(case.graphs) for case in every_case} == {0, 1, 2, 3, 4}
    assert {case.n_slots for case in every_case} == {1, 2, 3}
    for noise in ("alpha", "delta"):
        for learns in (False, True):
            seen = {getattr(case, noise) for case in every_case if case.learn_in_trial == learns}
            assert {0.0, 1e-8} < seen, f"{noise} with learn_in_trial={learns}"
    sizes = [(len(atg.known), case.n_aspects) for case in every_case for atg in case.graphs]
    assert min(sum(n == 0 for n, _ in sizes), sum(n == full for n, full in sizes)) >= 50
    assert sum(look.weights is not None for case in every_case for look in case.looks) >= 50
