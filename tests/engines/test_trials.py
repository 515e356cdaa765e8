"""What every engine promises of a trial: the order of its steps, what it refuses, and that it may be long."""

import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError, TooLargeError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.engines import ENGINES, begin_trial
from atg_fg.inference.interface import Inference
from tests.small import EXACT_ENGINES, each_of, every_exact_engine, graph, one_slot, seen, trial

WORLD = one_slot(3, 2, 4)
every_engine = pytest.mark.parametrize("engine", ENGINES)
long_engines = pytest.mark.parametrize("engine", ["bayes-filter", "gtsam"])


def two_objects() -> RobotMemory:
    """Push swaps the two aspects of either object: A shows 0 and 1, B shows 2 and 3."""
    swaps = (0, 0, 1, 1), (1, 0, 0, 1)
    return RobotMemory(WORLD, [graph(WORLD, "A", [(0,), (1,)], *swaps), graph(WORLD, "B", [(2,), (3,)], *swaps)])


def answers(inference: Inference) -> list[object]:
    belief = inference.identity()
    return [belief.objects.tolist(), belief.unseen, belief.entropy, inference.log_evidence]


@pytest.mark.parametrize("name", ["", "GTSAM", "kalman"])
def test_an_unknown_engine_is_refused_with_the_names_there_are(name: str) -> None:
    with pytest.raises(UnknownNameError, match="bayes-filter, enumeration, gibbs, gtsam"):
        begin_trial(name, two_objects(), ModelParameters())


def test_engines_are_registered_by_their_own_names() -> None:
    assert {name: engine.name for name, engine in ENGINES.items()} == {name: name for name in ENGINES}
    assert {"bayes-filter", "enumeration", "gtsam"} < set(EXACT_ENGINES) < set(ENGINES)


@every_engine
def test_before_the_first_look_the_belief_is_the_prior(engine: str) -> None:
    inference = begin_trial(engine, two_objects(), ModelParameters())
    np.testing.assert_allclose(inference.identity().objects, [1 / 3, 1 / 3], rtol=1e-15)
    assert inference.log_evidence == pytest.approx(0, abs=1e-15)


@every_engine
def test_an_action_and_what_is_to_be_done_next_need_a_look_before(engine: str) -> None:
    inference = begin_trial(engine, two_objects(), ModelParameters())
    with pytest.raises(InvalidInputError, match="without an observation"):
        inference.act(0)
    with pytest.raises(InvalidInputError, match="before the look"):
        inference.expected_entropies()
    inference.observe(seen(WORLD, 0))
    inference.act(0)
    with pytest.raises(InvalidInputError, match="without an observation"):
        inference.act(0)
    with pytest.raises(InvalidInputError, match="before the look"):
        inference.expected_entropies()


@every_engine
@pytest.mark.parametrize("action", [-1, 1, True, float("nan"), 0.5])
def test_an_action_that_is_not_there_is_refused(engine: str, action: object) -> None:
    inference = trial(engine, two_objects(), ModelParameters(), 0)
    before = answers(inference)
    with pytest.raises(InvalidInputError, match="action"):
        inference.act(action)
    assert answers(inference) == before
    inference.act(np.int64(0))


@every_engine
def test_evidence_over_another_alphabet_is_refused(engine: str) -> None:
    inference = begin_trial(engine, two_objects(), ModelParameters())
    with pytest.raises(InvalidInputError, match="evidence"):
        inference.observe(Evidence(np.ones(5)))
    inference.observe(seen(WORLD, 0))


@every_engine
@pytest.mark.parametrize(
    ("alpha", "delta", "learn", "steps", "impossible", "possible"),
    [
        # Full after two aspects, and no noise: a third pattern cannot be.
        (1.0, 0.0, True, (0, 0, 1, 0), 2, 0),
        # Push led from 0 to 1 once, and with α = 0 it always does.
        (0.0, 0.0, True, (0, 0, 1, 0, 0, 0), 0, 1),
        # No likelihood at all.
        (1.0, 0.1, False, (0, 0), None, 3),
    ],
)
def test_the_impossible_is_refused_changes_nothing_and_the_trial_goes_on(
    engine: str, alpha: float, delta: float, learn: bool, steps: tuple[int, ...], impossible: int | None, possible: int
) -> None:
    memory = RobotMemory(WORLD, [graph(WORLD, "A", [(0,), (1,)], (0, 0, 1, 1))])
    inference, untroubled = (trial(engine, memory, ModelParameters(alpha, delta, learn), *steps) for _ in range(2))
    evidence = Evidence(np.zeros(4)) if impossible is None else seen(WORLD, impossible)
    for _ in range(2):
        with pytest.raises(ImpossibleEvidenceError):
            inference.observe(evidence)
        assert answers(inference) == answers(untroubled)
    for either in (inference, untroubled):
        either.observe(seen(WORLD, possible))
    assert answers(inference) == answers(untroubled)
    np.testing.assert_array_equal(inference.expected_entropies(), untroubled.expected_entropies())


# The floor of mean-field's logarithms keeps every object above zero.
@pytest.mark.parametrize("engine", sorted(set(ENGINES) - {"mean-field"}))
def test_aspects_of_an_object_that_is_ruled_out_are_refused(engine: str) -> None:
    # Without noise pattern 2 cannot be A, so p(X | O = A, z) is not defined.
    inference = trial(engine, two_objects(), ModelParameters(0.0, 0.0, learn_in_trial=False), 2)
    assert inference.identity().objects[0] == 0
    with pytest.raises(ImpossibleEvidenceError):
        inference.smoothed_aspects(0)


@every_exact_engine
@pytest.mark.parametrize("scale", [1e-200, 1e200])
def test_evidence_on_any_scale_is_possible(engine: str, scale: float) -> None:
    inference, plain = (begin_trial(engine, two_objects(), ModelParameters(0.1, 0.1)) for _ in range(2))
    for time in range(4):
        if time:
            inference.act(0)
            plain.act(0)
        weights = np.array([1.0, 0.5, 0.25, 0.0])
        inference.observe(Evidence.of_likelihood(WORLD.alphabet, weights * scale))
        plain.observe(Evidence.of_likelihood(WORLD.alphabet, weights))
    np.testing.assert_allclose(inference.identity().objects, plain.identity().objects, atol=1e-12)
    assert inference.log_evidence == pytest.approx(plain.log_evidence + 4 * np.log(scale), abs=1e-9)


@long_engines
def test_an_object_ruled_out_for_long_comes_back(engine: str) -> None:
    # 600 looks at A, then 1400 at B. With δ = 0.3 a look that agrees weighs 0.775 and one that does not 0.075; for
    # unseen all patterns weigh 1/4. So first A leads unseen by 600 · ln(0.775 / 0.25) > 600 nats, and B by
    # 600 · ln(0.775 / 0.075) > 1400, far below the least float. In the end B leads A by 800 · ln(0.775 / 0.075) > 1800,
    # and unseen by 1400 · ln(0.775 / 0.25) - 600 · ln(0.25 / 0.075) > 800.
    inference = begin_trial(engine, two_objects(), ModelParameters(1e-8, 0.3, learn_in_trial=False))
    sequence = [0, 1] * 300 + [2, 3] * 700
    for time, symbol in enumerate(sequence):
        if time:
            inference.act(0)
        inference.observe(seen(WORLD, symbol))
        belief = inference.identity()
        assert np.isfinite([*answers(inference)[1:], *inference.expected_entropies()]).all()
        assert belief.objects.sum() + belief.unseen == pytest.approx(1, abs=1e-9)
        if time == 599:
            assert belief.objects[0] > 0.999999
            assert belief.objects[1] < 1e-300
    assert inference.identity().most_probable_object == 1
    assert inference.identity().objects[1] > 0.999999
    # B: 600 looks of 0.075, 1400 of 0.775 (α = 1e-8 and what comes by way of it are below 1e-4 of the sum).
    expected = np.log(1 / 3) + 600 * np.log(0.075) + 1400 * np.log(0.775)
    assert inference.log_evidence == pytest.approx(expected, abs=2)


@long_engines
def test_a_long_trial_that_learns_stays_normalised(engine: str) -> None:
    inference = begin_trial(engine, two_objects(), ModelParameters(1e-8, 1e-8, learn_in_trial=True))
    rng = np.random.default_rng(0)
    for time in range(300):
        if time:
            inference.act(0)
        inference.observe(seen(WORLD, int(rng.integers(4))))
        belief = inference.identity()
        assert belief.objects.sum() + belief.unseen == pytest.approx(1, abs=1e-9)
        assert np.isfinite(inference.expected_entropies()).all()
    assert np.isfinite(inference.log_evidence)


def test_aspects_of_a_long_trial_are_smoothed_alike_by_graph_and_filter() -> None:
    # p(z) is about 1e-9 a look, so an unscaled product would have vanished long before.
    steps = [2, *[0, 0, 0, 3, 0, 1] * 20]
    by_filter, by_graph = (
        trial(engine, two_objects(), ModelParameters(1e-8, 1e-8, learn_in_trial=False), *steps)
        for engine in ("bayes-filter", "gtsam")
    )
    assert by_filter.log_evidence < -80
    for i in range(3):
        for actual, expected in zip(by_graph.smoothed_aspects(i), by_filter.smoothed_aspects(i), strict=True):
            assert expected.sum() == pytest.approx(1)
            np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("memory", [two_objects(), RobotMemory(WORLD)], ids=["two objects", "nothing remembered"])
def test_enumeration_refuses_a_trial_that_is_too_long_for_it(memory: RobotMemory) -> None:
    inference = begin_trial("enumeration", memory, ModelParameters(0.1, 0.1, learn_in_trial=False))
    inference.observe(seen(WORLD, 0))
    with pytest.raises(TooLargeError, match="use another engine"):  # noqa: PT012
        for _ in range(100):
            inference.act(0)
            inference.observe(seen(WORLD, 0))


@pytest.mark.parametrize("learn", [False, True])
@pytest.mark.parametrize(("alpha", "delta"), [(1e-100, 1e-100), (1e-8, 1e-100), (0.0, 1e-60), (1.0, 1e-100)])
@each_of(name for name in EXACT_ENGINES if name != "enumeration")
def test_noise_next_to_none_is_reckoned_with_in_long_trials(
    engine: str, alpha: float, delta: float, learn: bool
) -> None:
    """Looks that no object explains multiply to less than the least float, and yet some object explains them best."""
    parameters = ModelParameters(alpha, delta, learn_in_trial=learn)
    steps = [step for look in (0, 1, 2, 2, 3, 0, 2, 1, 1, 3, 0, 2) for step in (look, 0)][:-1]
    inference, other = (trial(name, two_objects(), parameters, *steps) for name in (engine, "bayes-filter"))
    for ours, theirs in zip(answers(inference), answers(other), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12)
    assert np.isfinite(inference.log_evidence)


@pytest.mark.parametrize("delta", [0.0, 1e-8, 0.1])
@pytest.mark.parametrize(
    "weights", [(5e-324, 5e-324, 0, 0), (5e-324, 1, 1, 0), (1e308, 5e-324, 0, 0), (0, 1e-310, 0, 1e300), (1e308,) * 4]
)
@every_exact_engine
def test_weights_of_any_size_are_judged_alike_by_all_engines(
    engine: str, weights: tuple[float, ...], delta: float
) -> None:
    found = []
    for name in (engine, "bayes-filter"):
        inference = trial(name, two_objects(), ModelParameters(0.1, delta), 0, 0)
        try:
            inference.observe(Evidence(np.array(weights)))
            found.append([np.ravel(each) for each in answers(inference)])
        except (ImpossibleEvidenceError, InvalidInputError) as error:
            found.append([np.array([str(error)])])
    for ours, theirs in zip(*found, strict=True):
        if ours.dtype.kind == "U":
            assert ours == theirs
        else:
            np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12)
