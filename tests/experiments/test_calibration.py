import math
from dataclasses import replace

import numpy as np
import pytest

from atg_fg.core.parameters import ModelParameters
from atg_fg.experiments.calibration import (
    PLAN,
    CalibrationRun,
    chi_square,
    chi_square_tail,
    draw_trial,
    run_calibration,
    summarise,
)

QUICK = replace(PLAN, n_trials=400)


@pytest.mark.parametrize("learn_in_trial", [True, False])
def test_an_exact_engine_is_calibrated(learn_in_trial):
    plan = replace(QUICK, parameters=replace(PLAN.parameters, learn_in_trial=learn_in_trial))
    summary = summarise(run_calibration("bayes-filter", plan))
    assert summary["chi_square"]["p"] > 0.001
    assert summary["reliability_error"] < 0.04
    assert summary["trials"] == 400


def test_posteriors_of_other_noise_than_the_truth_are_not_calibrated(monkeypatch):
    # Evidence is drawn with δ = 0.3 and judged as if there were next to none.
    drawn = draw_trial

    def noisy(memory, parameters, n_actions, rng):
        return drawn(memory, ModelParameters(0.1, 0.3), n_actions, rng)

    monkeypatch.setattr("atg_fg.experiments.calibration.draw_trial", noisy)
    plan = replace(QUICK, parameters=ModelParameters(1e-3, 1e-3))
    summary = summarise(run_calibration("bayes-filter", plan))
    assert summary["chi_square"]["p"] < 0.001
    assert summary["reliability_error"] > 0.03


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["bayes-filter", "gtsam"])
def test_five_thousand_trials_are_calibrated_to_two_hundredths(engine):
    summary = summarise(run_calibration(engine))
    assert summary["chi_square"]["p"] > 0.001
    assert summary["reliability_error"] <= 0.02


def test_drawn_trials_follow_the_prior_and_the_model():
    memory = PLAN.learned_memory(np.random.default_rng(0))
    rng = np.random.default_rng(1)
    drawn = [draw_trial(memory, ModelParameters(1e-8, 1e-8), 4, rng) for _ in range(300)]
    shares = np.bincount([hypothesis for hypothesis, _, _ in drawn], minlength=6) / 300
    assert shares[-1] == pytest.approx(3 / 8, abs=0.1)
    for hypothesis, patterns, actions in drawn:
        assert (len(patterns), len(actions)) == (5, 4)
        if hypothesis < len(memory):
            graph = list(memory)[hypothesis]
            known = list(graph.pattern_indices)
            for before, action, after in zip(patterns, actions, patterns[1:], strict=False):
                targets = [
                    y for (x, a, y) in graph.counts if a == action and before in known and x == known.index(before)
                ]
                # With no noise, a counted edge is followed.
                assert not targets or after in [known[target] for target in targets]


def test_chi_square_by_hand():
    # Two states: the averaged posterior 0.5, the prior 0.4; variance 0.25 · 4/3 over 4 trials.
    posteriors = np.array([[0.0, 1.0], [1.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    run = CalibrationRun(posteriors, np.zeros(4, dtype=np.int64), np.array([0.4, 0.6]))
    statistic, freedom = chi_square(run)
    assert freedom == 1
    assert statistic == pytest.approx(0.1**2 / (1 / 3 / 4))


@pytest.mark.parametrize(
    ("statistic", "freedom", "p"),
    [(3.841458821, 1, 0.05), (5.991464547, 2, 0.05), (11.07049769, 5, 0.05), (18.30703805, 10, 0.05), (0.0, 3, 1.0)],
)
def test_tails_of_chi_square_are_those_of_the_tables(statistic, freedom, p):
    assert chi_square_tail(statistic, freedom) == pytest.approx(p, rel=1e-8)


def test_a_far_tail_is_small_and_never_above_one():
    assert chi_square_tail(1000.0, 4) < 1e-200
    assert chi_square_tail(1e-12, 6) <= 1.0
    assert math.isclose(chi_square_tail(2.0, 2), math.exp(-1))


def test_reliability_by_hand():
    posteriors = np.array([[0.25, 0.75], [0.25, 0.75], [0.95, 0.05], [0.95, 0.05]])
    run = CalibrationRun(posteriors, np.array([0, 1, 0, 0]), np.array([0.5, 0.5]))
    bins = {each["from"]: each for each in summarise(run)["reliability"]}
    assert {tenth: each["count"] for tenth, each in bins.items()} == {0.0: 2, 0.2: 2, 0.7: 2, 0.9: 2}
    assert (bins[0.2]["predicted"], bins[0.2]["found"]) == (0.25, 0.5)
    assert (bins[0.9]["predicted"], bins[0.9]["found"]) == (pytest.approx(0.95), 1.0)
    # (0.05 + 0.25 + 0.25 + 0.05) · 2 / 8
    assert summarise(run)["reliability_error"] == pytest.approx(0.15)
