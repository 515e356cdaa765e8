"""What the approximate engines promise: where they are exact, how they err, and that they answer at all."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import log
from typing import Any

import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import begin_trial
from atg_fg.engines.gibbs_sampling import GibbsSampling
from atg_fg.engines.loopy_belief_propagation import SCHEDULES, LoopyBeliefPropagation
from atg_fg.engines.mean_field import MeanField, factorised
from atg_fg.engines.options import options_of
from atg_fg.engines.particle_filter import ParticleFilter
from atg_fg.engines.sampling import drawn, split_r_hat
from atg_fg.experiments.engine_comparison import total_variation
from atg_fg.inference.interface import Inference
from tests.models import Case, random_case
from tests.small import APPROXIMATE_ENGINES, graph, one_slot, seen, trial

WORLD = one_slot(3, 2, 4)
NOISY = ModelParameters(1.0, 0.3, learn_in_trial=False)
every_approximate_engine = pytest.mark.parametrize("engine", APPROXIMATE_ENGINES)


def two_objects() -> RobotMemory:
    """Push swaps the two aspects of A, which shows 0 and 1, and keeps those of B, which shows 0 and 2."""
    swaps, keeps = ((0, 0, 1, 3), (1, 0, 0, 3)), ((0, 0, 0, 3), (1, 0, 1, 3))
    return RobotMemory(WORLD, [graph(WORLD, "A", [(0,), (1,)], *swaps), graph(WORLD, "B", [(0,), (2,)], *keeps)])


def objects_of(inference: Inference) -> Any:
    belief = inference.identity()
    return np.append(belief.objects, belief.unseen)


def played(engine: str, case: Case, **options: Any) -> Inference:
    """The case's trial up to its last look, with nothing seen where a look is impossible."""
    inference = begin_trial(engine, case.memory, case.parameters, **options)
    for time, look in enumerate(case.looks):
        try:
            inference.observe(look.evidence(case.assumptions.alphabet))
        except ImpossibleEvidenceError:
            inference.observe(case.nothing.evidence(case.assumptions.alphabet))
        if time < len(case.looks) - 1:
            inference.act(case.actions[time])
    return inference


def answers(inference: Inference) -> list[object]:
    entropies = [] if inference.history.awaits_evidence else inference.expected_entropies().tolist()
    return [objects_of(inference).tolist(), inference.log_evidence, entropies]


def assert_same(actual: Inference, expected: Inference, tolerance: float = 1e-12) -> None:
    np.testing.assert_allclose(objects_of(actual), objects_of(expected), rtol=0, atol=tolerance)
    assert actual.log_evidence == pytest.approx(expected.log_evidence, rel=0, abs=tolerance)
    entropies = expected.expected_entropies()
    np.testing.assert_allclose(actual.expected_entropies(), entropies, rtol=0, atol=tolerance)
    for hypothesis in np.flatnonzero(objects_of(expected)):
        expected_times = expected.smoothed_aspects(int(hypothesis))
        for ours, theirs in zip(actual.smoothed_aspects(int(hypothesis)), expected_times, strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=tolerance)


# What holds for all of them


@every_approximate_engine
def test_answers_are_distributions_and_entropies_are_within_their_bounds(engine: str) -> None:
    # The random models have partial and soft evidence, empty memories, no noise, and learning within the trial.
    for seed in range(60):
        case = random_case(np.random.default_rng(seed))
        inference = played(engine, case)
        belief = inference.identity()
        probabilities = objects_of(inference)
        assert (probabilities >= 0).all()
        assert probabilities.sum() == pytest.approx(1, abs=1e-12)
        greatest = log(len(belief.objects) + belief.n_unseen)
        assert 0 <= belief.entropy <= greatest + 1e-9
        entropies = inference.expected_entropies()
        assert entropies.shape == (case.n_actions,)
        assert ((entropies >= 0) & (entropies <= belief.entropy + 1e-9)).all()
        assert np.isfinite(inference.log_evidence)
        possible = objects_of(played("bayes-filter", case)) > 0
        hypothesis = int(np.where(possible, probabilities, 0.0).argmax())
        for distribution in inference.smoothed_aspects(hypothesis):
            assert (distribution >= 0).all()
            assert distribution.sum() == pytest.approx(1, abs=1e-9)


@every_approximate_engine
def test_the_same_seed_gives_the_same_answers_whatever_was_asked(engine: str) -> None:
    for seed in range(10):
        case = random_case(np.random.default_rng(seed))
        assert answers(played(engine, case)) == answers(played(engine, case))
    asked, unasked = (begin_trial(engine, two_objects(), NOISY) for _ in range(2))
    for time, symbol in enumerate([0, 1, 0]):
        for inference in (asked, unasked):
            if time:
                inference.act(0)
            inference.observe(seen(WORLD, symbol))
        answers(asked)
        asked.smoothed_aspects(0)
    assert answers(asked) == answers(unasked)


@pytest.mark.parametrize("engine", ["particle", "gibbs"])
def test_another_seed_gives_other_answers(engine: str) -> None:
    one, other = (trial(engine, two_objects(), NOISY, 0, 0, 1, options={"seed": seed}) for seed in range(2))
    assert answers(one) != answers(other)


@every_approximate_engine
def test_without_any_memory_there_is_one_hypothesis_and_the_evidence_is_near(engine: str) -> None:
    parameters = ModelParameters(0.1, 0.1, learn_in_trial=True)
    steps = (0, 0, 1, 0, 0, 0, 1)
    inference, exact = (trial(name, RobotMemory(WORLD), parameters, *steps) for name in (engine, "bayes-filter"))
    assert inference.identity().unseen == pytest.approx(1, abs=1e-12)
    assert inference.log_evidence == pytest.approx(exact.log_evidence, abs=0.1)


@every_approximate_engine
@pytest.mark.parametrize("scale", [1e-200, 1e200])
def test_evidence_on_another_scale_adds_its_logarithm(engine: str, scale: float) -> None:
    case = replace(random_case(np.random.default_rng(3)), delta=0.1, alpha=0.1)
    weights = np.arange(1.0, 1 + len(case.patterns))
    inference, plain = (begin_trial(engine, case.memory, case.parameters) for _ in range(2))
    for time in range(4):
        for trial_of, factor in ((inference, scale), (plain, 1.0)):
            if time:
                trial_of.act(0)
            evidence = replace(case.nothing.evidence(case.assumptions.alphabet), likelihood=weights * factor)
            trial_of.observe(evidence)
    np.testing.assert_allclose(objects_of(inference), objects_of(plain), atol=1e-9)
    assert inference.log_evidence == pytest.approx(plain.log_evidence + 4 * log(scale), abs=1e-8)


@every_approximate_engine
@pytest.mark.parametrize("learn", [False, True])
def test_a_long_trial_stays_finite(engine: str, learn: bool) -> None:
    inference = begin_trial(engine, two_objects(), ModelParameters(1e-8, 1e-8, learn_in_trial=learn))
    rng = np.random.default_rng(0)
    for time in range(100):
        if time:
            inference.act(0)
        inference.observe(seen(WORLD, int(rng.integers(4))))
    assert objects_of(inference).sum() == pytest.approx(1, abs=1e-9)
    assert np.isfinite([inference.log_evidence, *inference.expected_entropies()]).all()


@every_approximate_engine
@pytest.mark.parametrize("prefix", ["unknown", "n_particle"])
def test_an_unknown_option_is_refused_with_the_options_there_are(engine: str, prefix: str) -> None:
    known = ", ".join(options_of(type(begin_trial(engine, two_objects(), NOISY))))
    with pytest.raises(InvalidInputError, match=rf"{engine}.*'{prefix}'.*{known}"):
        begin_trial(engine, two_objects(), NOISY, **{prefix: 1})


def test_an_engine_without_options_says_so() -> None:
    with pytest.raises(InvalidInputError, match="no options"):
        begin_trial("bayes-filter", two_objects(), NOISY, seed=1)


@pytest.mark.parametrize(
    ("engine", "options"),
    [
        ("particle", {"n_particles": 0}),
        ("particle", {"seed": -1}),
        ("particle", {"seed": 0.5}),
        ("gibbs", {"n_chains": 1}),
        ("gibbs", {"n_sweeps": True}),
        ("loopy-bp", {"damping": 1.0}),
        ("loopy-bp", {"damping": float("nan")}),
        ("loopy-bp", {"schedule": "random"}),
        ("loopy-bp", {"tolerance": "small"}),
        ("mean-field", {"floor": 0.0}),
        ("gtsam-sequential", {"ordering": "alphabetical"}),
    ],
)
def test_an_option_with_a_bad_value_is_refused_by_name(engine: str, options: dict[str, Any]) -> None:
    with pytest.raises(InvalidInputError, match=next(iter(options))):
        begin_trial(engine, two_objects(), NOISY, **options)


# Loopy belief propagation


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_belief_propagation_is_exact_on_a_tree(schedule: str) -> None:
    # A tree: one look, with any memory; or nothing remembered, with any number of looks.
    for seed in range(120):
        case = random_case(np.random.default_rng(seed))
        for tree in (replace(case, looks=case.looks[:1]), replace(case, graphs=())):
            inference = played("loopy-bp", tree, schedule=schedule)
            assert isinstance(inference, LoopyBeliefPropagation)
            assert_same(inference, played("bayes-filter", tree))
            assert inference.report.converged


def test_belief_propagation_errs_where_the_graph_has_loops_and_says_that_it_converged() -> None:
    inference, exact = (trial(name, two_objects(), NOISY, 0, 0, 1, 0, 0) for name in ("loopy-bp", "bayes-filter"))
    assert isinstance(inference, LoopyBeliefPropagation)
    assert inference.report.converged
    assert inference.report.iterations > 2
    assert inference.report.largest_change <= inference.tolerance
    assert 1e-6 < total_variation(inference, exact) < 0.2


def test_belief_propagation_that_is_stopped_early_says_that_it_did_not_converge() -> None:
    inference = trial("loopy-bp", two_objects(), NOISY, 0, 0, 1, 0, 0, options={"max_iterations": 1})
    assert isinstance(inference, LoopyBeliefPropagation)
    assert inference.report.iterations == 1
    assert not inference.report.converged
    assert inference.report.largest_change > inference.tolerance


def test_schedule_and_damping_change_the_way_and_not_the_fixed_point() -> None:
    ways = [{"schedule": schedule, "damping": damping} for schedule in SCHEDULES for damping in (0.2, 0.7)]
    inferences = [trial("loopy-bp", two_objects(), NOISY, 0, 0, 1, 0, 0, options=way) for way in ways]
    for inference in inferences[1:]:
        np.testing.assert_allclose(objects_of(inference), objects_of(inferences[0]), atol=1e-8)
        assert inference.log_evidence == pytest.approx(inferences[0].log_evidence, abs=1e-8)


# Particle filter


def test_the_particle_filters_error_falls_with_the_root_of_the_number_of_particles() -> None:
    # Slope of ln(mean total variation) over ln(n); the mean is over 60 seeds, so it is sure to about 0.1.
    steps = (0, 0, 1, 0, 0, 0, 3, 0, 0)
    exact = trial("bayes-filter", two_objects(), NOISY, *steps)
    numbers = (250, 1000, 4000)
    errors = [
        np.mean(
            [
                total_variation(
                    trial("particle", two_objects(), NOISY, *steps, options={"n_particles": n, "seed": seed}), exact
                )
                for seed in range(60)
            ]
        )
        for n in numbers
    ]
    slope = np.polyfit(np.log(numbers), np.log(errors), 1)[0]
    assert -0.65 < slope < -0.35
    assert errors[-1] < 0.02


def test_the_particle_filters_evidence_is_right_on_average() -> None:
    steps = (0, 0, 1, 0, 0, 0, 3)
    exact = trial("bayes-filter", two_objects(), NOISY, *steps).log_evidence
    ratios = [
        np.exp(trial("particle", two_objects(), NOISY, *steps, options={"n_particles": 100, "seed": s}).log_evidence)
        / np.exp(exact)
        for s in range(200)
    ]
    assert abs(np.mean(ratios) - 1) < 4 * np.std(ratios) / np.sqrt(len(ratios))


def test_particles_are_resampled_before_half_of_them_count_for_nothing() -> None:
    inference = begin_trial("particle", two_objects(), ModelParameters(0.01, 0.1, learn_in_trial=False))
    assert isinstance(inference, ParticleFilter)
    assert inference.effective_sample_size == 2000
    resampled = False
    for time, symbol in enumerate([0, 1, 0, 1, 0, 1]):
        if time:
            inference.act(0)
        inference.observe(seen(WORLD, symbol))
        assert 1000 <= inference.effective_sample_size <= 2000 * (1 + 1e-12)
        resampled |= time > 0 and bool((inference.weights == 1 / 2000).all())
    assert resampled


def test_particles_at_a_collection_node_are_divided_in_the_ratio_given() -> None:
    # |𝒵| = 2, G = 2, δ = 1/2: the collection node shows a pattern by itself or by noise, half and half.
    assumptions = one_slot(1, 2, 2)
    inference = trial("particle", RobotMemory(assumptions), ModelParameters(0.0, 0.5, learn_in_trial=True), 0)
    assert isinstance(inference, ParticleFilter)
    assert set(inference.aspects.tolist()) == {0, 1}
    # Four standard deviations of a share of 2,000 draws.
    assert inference.aspects.mean() == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(2000))


def test_when_no_particle_is_left_all_are_drawn_anew_from_the_exact_filter() -> None:
    # A and unseen after look 0; one particle is A, and then pattern 3 is possible for unseen alone.
    parameters = ModelParameters(0.0, 0.0, learn_in_trial=False)
    memory = RobotMemory(WORLD, [graph(WORLD, "A", [(0,), (1,)], (0, 0, 1, 1))])
    rejuvenated = 0
    for seed in range(20):
        options = {"n_particles": 1, "seed": seed}
        inference = trial("particle", memory, parameters, 0, 0, 3, options=options)
        assert isinstance(inference, ParticleFilter)
        assert inference.identity().unseen == 1
        assert np.isfinite(inference.log_evidence)
        rejuvenated += inference.rejuvenations
        with pytest.raises(ImpossibleEvidenceError):
            trial("particle", memory, ModelParameters(0.0, 0.0, learn_in_trial=True), 0, 0, 1, 0, 2, options=options)
    assert 0 < rejuvenated < 20


# Gibbs sampling


def test_gibbs_sampling_is_near_the_posterior_of_random_models_and_has_mixed() -> None:
    for seed in range(100, 160):
        case = random_case(np.random.default_rng(seed))
        inference, exact = played("gibbs", case), played("bayes-filter", case)
        assert isinstance(inference, GibbsSampling)
        assert total_variation(inference, exact) < 0.05
        assert 0.99 < inference.report.r_hat < 1.02
        assert 0 < inference.report.acceptance <= 1
        assert inference.log_evidence == pytest.approx(exact.log_evidence, abs=0.1)


def test_gibbs_sampling_changes_the_object_where_transitions_are_all_but_certain() -> None:
    # Look 0 fits A and B; what push does then tells them apart.
    parameters = ModelParameters(1e-8, 1e-8, learn_in_trial=False)
    for symbol, expected in ((1, 0), (0, 1)):
        inference = trial("gibbs", two_objects(), parameters, 0, 0, symbol)
        assert inference.identity().most_probable_object == expected
        # The other object has lost all but a millionth; unseen shows one of four patterns twice, these one of two once.
        assert inference.identity().objects[expected] == pytest.approx(8 / 9, abs=0.02)
        assert inference.identity().objects[1 - expected] < 1e-3


def test_paths_sampled_given_the_object_are_near_the_smoothed_ones() -> None:
    inference, exact = (trial(name, two_objects(), NOISY, 0, 0, 1, 0, 0) for name in ("gibbs", "bayes-filter"))
    for hypothesis in range(3):
        expected_times = exact.smoothed_aspects(hypothesis)
        for actual, expected in zip(inference.smoothed_aspects(hypothesis), expected_times, strict=True):
            np.testing.assert_allclose(actual, expected, atol=0.03)


def test_r_hat_is_one_for_mixed_chains_and_large_for_chains_that_disagree() -> None:
    rng = np.random.default_rng(0)
    mixed = rng.normal(size=(4, 1000))
    assert split_r_hat(mixed) == pytest.approx(1, abs=0.01)
    assert split_r_hat(mixed + 3 * np.arange(4)[:, None]) > 2
    assert split_r_hat(mixed + np.linspace(0, 9, 1000)) > 1.5
    assert split_r_hat(np.ones((4, 10))) == 1
    assert split_r_hat(np.repeat([[0.0], [1.0]], 10, axis=1)) == np.inf


def test_draws_follow_the_weights_and_never_choose_a_weight_of_zero() -> None:
    rows = np.tile([0.0, 1.0, 0.0, 3.0, 0.0], (20_000, 1))
    shares = np.bincount(drawn(rows, np.random.default_rng(0)), minlength=5) / len(rows)
    np.testing.assert_allclose(shares, [0, 0.25, 0, 0.75, 0], atol=4 * np.sqrt(0.25 * 0.75 / len(rows)))
    assert shares[[0, 2, 4]].tolist() == [0, 0, 0]


# Mean field


def test_the_free_energy_never_rises_and_never_falls_below_the_surprise() -> None:
    for seed in range(120):
        case = random_case(np.random.default_rng(seed))
        inference = begin_trial("mean-field", case.memory, case.parameters)
        exact = begin_trial("bayes-filter", case.memory, case.parameters)
        assert isinstance(inference, MeanField)
        assert inference.report is None
        for time, look in enumerate(case.looks):
            try:
                inference.observe(look.evidence(case.assumptions.alphabet))
            except ImpossibleEvidenceError:
                break
            assert inference.report is not None
            assert all(after <= before + 1e-12 for before, after in pairwise(inference.report.free_energies))
            assert inference.report.free_energy >= inference.report.surprise - 1e-12
            assert inference.report.converged
            if time == 0:
                exact.observe(look.evidence(case.assumptions.alphabet))
                assert inference.log_evidence <= exact.log_evidence + 1e-12
            if time < len(case.looks) - 1:
                inference.act(case.actions[time])


def test_mean_field_is_exact_where_object_and_aspect_are_independent() -> None:
    weights = np.outer([0.2, 0.3, 0.5], [0.1, 0.9]) * 0.01
    objects, aspects, report = factorised(weights, 1e-16, max_iterations=10, tolerance=1e-12)
    np.testing.assert_allclose(objects, [0.2, 0.3, 0.5], atol=1e-12)
    np.testing.assert_allclose(aspects, [0.1, 0.9], atol=1e-12)
    assert report.free_energy == pytest.approx(-log(0.01), abs=1e-12)


def test_the_bias_of_mean_field_is_visible() -> None:
    errors = []
    for seed in range(60):
        case = random_case(np.random.default_rng(seed))
        errors.append(total_variation(played("mean-field", case), played("bayes-filter", case)))
    assert np.mean(errors) > 0.05
