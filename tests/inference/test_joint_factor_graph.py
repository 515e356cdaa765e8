"""The factor graph of several objects, against enumeration of actual objects and against the sums over subsets."""

import itertools
from math import log
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError, TooLargeError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import FloatArray
from atg_fg.engines import begin_trial
from atg_fg.inference.all_different import different_identities, identity_given_others, log_probability_all_different
from atg_fg.inference.chain import Chain
from atg_fg.inference.gtsam_factors import MAX_NUMBER, aspect_key, key_name, object_key
from atg_fg.inference.interface import Inference
from atg_fg.inference.joint_factor_graph import JointRecognitionGraph
from tests.models import Case, cases
from tests.small import graph, one_slot, seen, trial

WORLD = one_slot(4, 2, 4)
NOISY = ModelParameters(0.1, 0.1)


def two_objects(n_objects: int = 4) -> RobotMemory:
    """Push swaps the two aspects of either object: A shows 0 and 1, B shows 1 and 2."""
    world, swaps = one_slot(n_objects, 2, 4), ((0, 0, 1, 1), (1, 0, 0, 1))
    return RobotMemory(world, [graph(world, "A", [(0,), (1,)], *swaps), graph(world, "B", [(1,), (2,)], *swaps)])


def joint(*trials: Inference) -> JointRecognitionGraph:
    return JointRecognitionGraph([t.chain() for t in trials], trials[0].model.n_unseen)


def three_trials(memory: RobotMemory, parameters: ModelParameters = NOISY) -> list[Inference]:
    return [trial("bayes-filter", memory, parameters, *steps) for steps in ((0, 0, 1), (1,), (1, 0, 2, 0, 1))]


def trials_of(case: Case, n: int) -> list[Inference]:
    """Each of ``n`` objects gets some of the looks of a case, all from the first on."""
    trials = []
    for which in range(n):
        inference = begin_trial("bayes-filter", case.memory, case.parameters)
        for time, look in enumerate(case.looks[which:]):
            try:
                inference.observe(look.evidence(case.assumptions.alphabet))
            except ImpossibleEvidenceError:
                inference.observe(case.nothing.evidence(case.assumptions.alphabet))
            if time < len(case.actions):
                inference.act(case.actions[time])
        trials.append(inference)
    return [inference for inference in trials if inference.history.evidence]


def explanations(chain: Chain) -> dict[tuple[int, ...], float]:
    """p(O, X_0:t, z_0:t) of every explanation (o, x_0, …, x_t)."""
    weights = chain.prior[:, None] * chain.initial
    for time in range(len(chain.widths)):
        if time:
            past = (1,) * (weights.ndim - 2)
            table = chain.transitions[time - 1]
            weights = weights[..., None] * table.reshape(len(table), *past, *table.shape[1:])
        if time < len(chain.likelihoods):
            past = (1,) * (weights.ndim - 2)
            weights = weights * chain.likelihoods[time].reshape(len(weights), *past, -1)
    return {index: float(weight) for index, weight in np.ndenumerate(weights) if weight}


def by_enumeration(
    chains: list[Chain], n_unseen: int, which: int, time: int
) -> tuple[list[list[float]], FloatArray, float]:
    """Identities, p(O_which, X_time) and log evidence from all different actual objects and all explanations."""
    n_objects = len(chains[0].prior) - 1
    of_each = [explanations(chain) for chain in chains]
    identities = np.zeros((len(chains), n_objects + 1))
    aspects = np.zeros((n_objects + 1, chains[which].widths[time]))
    prior = 0.0
    for actual in itertools.permutations(range(n_objects + n_unseen), len(chains)):
        states = [min(i, n_objects) for i in actual]
        shares = [1.0 if i < n_objects else 1 / n_unseen for i in actual]
        prior += np.prod([chain.prior[o] * share for chain, o, share in zip(chains, states, shares, strict=True)])
        ways = [
            [(path, weight * share) for path, weight in table.items() if path[0] == o]
            for table, o, share in zip(of_each, states, shares, strict=True)
        ]
        sums = [sum(weight for _, weight in way) for way in ways]
        for k, o in enumerate(states):
            identities[k, o] += np.prod(sums)
        others = np.prod([s for k, s in enumerate(sums) if k != which])
        for path, weight in ways[which]:
            aspects[path[0], path[1 + time]] += weight * others
    total = aspects.sum()
    return (identities / total).tolist(), aspects / total, float(np.log(total / prior))


def close(actual: object, expected: object) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12)


def probabilities(beliefs: list[IdentityBelief]) -> list[list[float]]:
    return [belief.probabilities.tolist() for belief in beliefs]


def test_two_looks_by_hand() -> None:
    # One remembered object, U = 2, one aspect each: p(z | A) is 3/4 for the first and 1/2 for the second object, and
    # p(z | unseen) is 1/4 and 1/2. With priors 1/3 and 2/3: A-u 1/4 · 1/3, u-A 1/6 · 1/6, u-u 1/6 · 1/3 · 1/2.
    prior = np.array([1 / 3, 2 / 3])
    chains = [Chain(prior, np.ones((2, 1)), (), (np.array([[p], [q]]),)) for p, q in ((3 / 4, 1 / 4), (1 / 2, 1 / 2))]
    recognition = JointRecognitionGraph(chains, 2)
    a_u, u_a, u_u = 1 / 12, 1 / 36, 1 / 36
    close(probabilities(recognition.identities()), [[3 / 5, 2 / 5], [1 / 5, 4 / 5]])
    # The priors leave 1/3 · 2/3 twice, and 2/3 · 2/3 / 2: together 2/3.
    assert recognition.log_evidence() == pytest.approx(log((a_u + u_a + u_u) / (2 / 3)), abs=1e-14)
    close(recognition.aspect_marginal(0, 0), [[3 / 5], [2 / 5]])


@pytest.mark.parametrize("learn", [False, True])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_three_objects_are_as_by_enumeration_of_actual_objects(learn: bool, which: int) -> None:
    trials = three_trials(two_objects(), ModelParameters(0.1, 0.1, learn))
    recognition, chains = joint(*trials), [t.chain() for t in trials]
    for time in range(len(chains[which].widths)):
        identities, aspects, log_evidence = by_enumeration(chains, 2, which, time)
        close(probabilities(recognition.identities()), identities)
        close(recognition.aspect_marginal(which, time), aspects)
        assert recognition.log_evidence() == pytest.approx(log_evidence, abs=1e-12)


@given(cases(), st.integers(1, 3))
def test_the_graph_is_the_sum_over_subsets(case: Case, n: int) -> None:
    trials = trials_of(case, n)
    recognition, alone = joint(*trials), [t.identity() for t in trials]
    if len(trials) > len(case.graphs) + case.memory.n_unseen or log_probability_all_different(alone) == -np.inf:
        for question in (recognition.identities, recognition.log_evidence):
            with pytest.raises(ImpossibleEvidenceError):
                question()
        return
    close(probabilities(recognition.identities()), probabilities(different_identities(alone)))
    prior = IdentityBelief.of(trials[0].model.prior, case.memory.n_unseen)
    expected = sum(t.log_evidence for t in trials) + log_probability_all_different(alone)
    expected -= log_probability_all_different([prior] * len(trials))
    assert recognition.log_evidence() == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_marginals_of_gtsam_itself_are_those_of_the_graph() -> None:
    recognition = joint(*three_trials(two_objects()))
    marginals = recognition.marginals()
    for which, belief in enumerate(recognition.identities()):
        part = recognition.trials[which]
        close(marginals.marginalProbabilities(part.variable(part.object_key)), belief.probabilities)
        for time in range(part.last + 1):
            expected = recognition.aspect_marginal(which, time).sum(axis=0)
            by_gtsam = marginals.marginalProbabilities(part.variable(part.aspect_key(time)))
            close(by_gtsam[: len(expected)], expected)


def test_one_object_alone_is_as_in_its_trial() -> None:
    inference = trial("bayes-filter", two_objects(), NOISY, 0, 0, 1)
    recognition = joint(inference)
    close(recognition.identities()[0].probabilities, inference.identity().probabilities)
    close(recognition.aspect_marginal(0, 1), inference.aspect_belief)
    assert recognition.log_evidence() == pytest.approx(inference.log_evidence, abs=1e-14)


def test_recognising_one_object_informs_the_others() -> None:
    # The second cube shows 1, as A and B both do. Once the first is recognised as A, it is B, or new.
    memory = two_objects()
    second = trial("bayes-filter", memory, NOISY, 1)
    vague, clear = (trial("bayes-filter", memory, NOISY, *steps) for steps in ((None,), (0, 0, 1, 0, 0, 0, 1)))
    by_vague, by_clear = (joint(first, second).identities()[1] for first in (vague, clear))
    assert by_vague.objects[0] == pytest.approx(by_vague.objects[1])
    assert by_clear.objects[0] < 0.1 < 0.3 < by_vague.objects[0]
    assert by_clear.objects[1] > by_vague.objects[1]
    assert by_clear.entropy < second.identity().entropy


def test_a_trial_that_starts_from_what_the_others_leave_ends_as_the_joint_graph() -> None:
    memory = two_objects()
    first = trial("bayes-filter", memory, NOISY, 0, 0, 1)
    prior = begin_trial("bayes-filter", memory, NOISY).identity()
    second = begin_trial("gtsam", memory, NOISY, identity_given_others(prior, [first.identity()]))
    second.observe(seen(WORLD, 1))
    alone = trial("bayes-filter", memory, NOISY, 1)
    close(second.identity().probabilities, joint(first, alone).identities()[1].probabilities)


def test_an_empty_memory_leaves_all_unseen() -> None:
    inference = trial("bayes-filter", RobotMemory(WORLD), NOISY, 0, 0, 1)
    recognition = joint(inference, inference)
    assert probabilities(recognition.identities()) == [[1], [1]]
    close(recognition.aspect_marginal(1, 1), inference.aspect_belief)


@pytest.mark.parametrize("n_looks", [3, 240])
def test_three_objects_that_all_look_like_a_are_told_apart(n_looks: int) -> None:
    # Three objects exist, so one of them is B, which after 240 looks no float tells from impossible.
    memory = two_objects(n_objects=3)
    steps = [step for time in range(n_looks) for step in (time % 2, 0)][:-1]
    trials = [trial("bayes-filter", memory, ModelParameters(1e-3, 1e-3), *steps) for _ in range(3)]
    recognition = joint(*trials)
    told = probabilities(recognition.identities())
    close(told, np.full((3, 3), 1 / 3))
    assert np.isfinite(recognition.log_evidence())
    close(recognition.aspect_marginal(2, 0).sum(axis=1), told[2])
    assert (trials[0].identity().objects[1] == 0) == (n_looks == 240)


def test_more_objects_than_exist_are_impossible() -> None:
    recognition = joint(*[trial("bayes-filter", two_objects(), NOISY, 1)] * 5)
    for question in (recognition.identities, recognition.log_evidence, lambda: recognition.aspect_marginal(0, 0)):
        with pytest.raises(ImpossibleEvidenceError):
            question()


def test_a_graph_too_large_for_the_factor_is_refused() -> None:
    prior = np.full(200, 1 / 200)
    chain = Chain(prior, np.ones((200, 1)), (), (np.ones((200, 1)),))
    with pytest.raises(TooLargeError, match="different_identities"):
        JointRecognitionGraph([chain] * 3, 10)


def test_no_chain_and_chains_of_different_memories_are_refused() -> None:
    one, other = (Chain(np.ones(n) / n, np.ones((n, 1)), (), (np.ones((n, 1)),)) for n in (2, 3))
    for chains, n_unseen in (([], 1), ([one, other], 1), ([one, one], 0)):
        with pytest.raises(InvalidInputError, match="factor graph"):
            JointRecognitionGraph(chains, n_unseen)


@pytest.mark.parametrize(("which", "time"), [(-1, 0), (3, 0), (0, -1), (0, 2), (1, 1)])
def test_an_object_or_time_that_is_not_there_is_refused(which: int, time: int) -> None:
    with pytest.raises(InvalidInputError, match="expected 0 to"):
        joint(*three_trials(two_objects())).aspect_marginal(which, time)


def test_keys_of_several_objects_have_names_and_objects_are_highest() -> None:
    variables = {
        object_key(): "O",
        object_key(1): "O1",
        object_key(MAX_NUMBER): f"O{MAX_NUMBER}",
        aspect_key(0): "X0",
        aspect_key(7): "X7",
        aspect_key(0, 1): "X1,0",
        aspect_key(12, 3): "X3,12",
        aspect_key(999_999, MAX_NUMBER): f"X{MAX_NUMBER},999999",
    }
    assert {key: key_name(key) for key in variables} == variables
    assert sorted(variables, reverse=True) == list(variables)
    for bad in (-1, MAX_NUMBER + 1):
        with pytest.raises(InvalidInputError, match="object"):
            object_key(bad)
        with pytest.raises(InvalidInputError, match="object"):
            aspect_key(0, bad)


def test_the_drawings_name_every_variable_and_show_every_factor() -> None:
    recognition = joint(*three_trials(two_objects()))
    names = ["O1", "O2", "O3", "X1,0", "X1,1", "X2,0", "X3,0", "X3,1", "X3,2"]
    dot, html = recognition.dot(), recognition._repr_html_()
    for name in names:
        assert f'label="{name}"' in dot
        assert html.count(f">{name}</text>") == 1
    assert html.count("<circle") == len(names)
    assert html.count("<rect") == recognition.graph.size() == 3 * 2 + 3 + 6 + 1
    assert "factor on O1, O2, O3" in html
    places = [(e.get("x"), e.get("y")) for e in ElementTree.fromstring(html).iter() if e.tag.endswith("rect")]
    assert len(set(places)) == len(places)
    assert repr(recognition) == "JointRecognitionGraph(O1, O2, O3; 6 aspects; 16 factors)"
