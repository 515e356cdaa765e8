"""Several looks without an action, and actions that are not sure: exact in every exact engine, and in the graph."""

import numpy as np
import pytest

from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.engines import ENGINES, begin_trial
from tests.small import every_exact_engine, graph, one_slot

ASSUMPTIONS = one_slot(3, 3, 4, ("turn", "tip"))
MEMORY = RobotMemory(
    ASSUMPTIONS,
    [
        graph(ASSUMPTIONS, "a", [(0,), (1,), (2,)], (0, 0, 1, 3), (1, 1, 2, 2), (2, 0, 0, 1)),
        graph(ASSUMPTIONS, "b", [(0,), (2,)], (0, 0, 1, 2), (1, 1, 0, 1)),
    ],
)
FIXED = ModelParameters(0.3, 0.1, learn_in_trial=False)


def soft(*weights):
    return Evidence.of_likelihood(ASSUMPTIONS.alphabet, weights)


@every_exact_engine
def test_looks_at_rest_are_independent_evidence_of_one_aspect(engine):
    # Two soft looks at one aspect: p(z, z' | x) = p(z | x) p(z' | x), summed by hand over objects and aspects.
    first, second = np.array([0.7, 0.1, 0.1, 0.1]), np.array([0.2, 0.2, 0.5, 0.1])
    trial = begin_trial(engine, MEMORY, FIXED)
    trial.observe(soft(*first))
    trial.observe(soft(*second))
    delta, joint = 0.1, []
    for known, unknown in (((0, 1, 2), 0), ((0, 2), 1), ((), 3)):
        lacking = [z for z in range(4) if z not in known]
        total = 0.0
        for z in known:
            both = [(1 - delta) * look[z] + delta / 4 * look.sum() for look in (first, second)]
            total += both[0] * both[1] / 3
        both = [(1 - delta) * look[lacking].mean() + delta / 4 * look.sum() for look in (first, second)]
        joint.append(total + unknown / 3 * both[0] * both[1])
    expected = np.array(joint) / sum(joint)
    belief = trial.identity()
    np.testing.assert_allclose([*belief.objects, belief.unseen], expected, atol=1e-12)
    assert trial.log_evidence == pytest.approx(np.log(sum(joint) / 3), abs=1e-12)


@every_exact_engine
@pytest.mark.parametrize("learns", [False, True])
def test_an_uncertain_action_is_the_mixture_of_trials(engine, learns):
    parameters = ModelParameters(0.3, 0.1, learn_in_trial=learns)
    looks = (0, 2)

    def weights(action):
        trial = begin_trial("enumeration", MEMORY, ModelParameters(0.3, 0.1, learn_in_trial=False))
        trial.observe((looks[0],))
        trial.act(action)
        trial.observe((looks[1],))
        belief = trial.identity()
        return np.exp(trial.log_evidence) * np.array([*belief.objects, belief.unseen])

    expected = 0.5 * weights("turn") + 0.3 * weights("tip") + 0.2 * weights(None)
    trial = begin_trial(engine, MEMORY, parameters)
    trial.observe((looks[0],))
    trial.act({"turn": 0.5, "tip": 0.3, None: 0.2})
    trial.observe((looks[1],))
    belief = trial.identity()
    if not learns:
        np.testing.assert_allclose([*belief.objects, belief.unseen], expected / expected.sum(), atol=1e-12)
        assert trial.log_evidence == pytest.approx(np.log(expected.sum()), abs=1e-12)
    assert len(trial.smoothed_aspects(0)) == 2


def test_the_graph_has_them_as_factors():
    trial = begin_trial("gtsam", MEMORY, ModelParameters(0.3, 0.1))
    trial.observe((0,))
    trial.observe({"front": {1: 0.5, 0: 0.5}})
    trial.act({"turn": 0.9, None: 0.1})
    trial.observe((1,))
    belief = trial.identity()
    np.testing.assert_allclose(trial.graph().identity().objects, belief.objects, atol=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_of_dependent_looks_the_strongest_counts_alone(engine):
    alone = begin_trial(engine, MEMORY, FIXED)
    alone.observe((0,))
    for looks in ([None, (0,)], [(0,), None], [soft(0.7, 0.1, 0.1, 0.1), (0,), soft(0.4, 0.2, 0.2, 0.2)]):
        trial = begin_trial(engine, MEMORY, FIXED)
        for look in looks:
            trial.observe(look, independent=False)
        assert trial.identity().objects.tolist() == alone.identity().objects.tolist()
        assert len(trial.history.evidence) == 1


@every_exact_engine
def test_an_impossible_look_at_rest_changes_nothing(engine):
    trial = begin_trial(engine, MEMORY, ModelParameters(0.0, 0.0, learn_in_trial=False))
    trial.observe((0,))
    before = trial.identity().objects.tolist()
    with pytest.raises(ImpossibleEvidenceError):
        trial.observe(Evidence(np.zeros(4)))
    assert trial.identity().objects.tolist() == before
    assert len(trial.history.evidence) == 1
    trial.act("turn")
    trial.observe((1,))


@every_exact_engine
def test_a_look_at_rest_finds_the_node_that_the_first_one_made(engine):
    trial = begin_trial(engine, MEMORY, ModelParameters(0.3, 0.1, learn_in_trial=True))
    trial.observe((3,))
    trial.observe((3,))
    # "a" knows other aspects only: noise twice. "b" and unseen have made a node of the first look, which the second
    # look finds there; the rest of them sees noise again, and C of unseen, which 3 is no longer in, does too.
    noise, found = 0.1 / 4, 0.9 + 0.1 / 4
    a = noise**2
    b = (0.9 / 2 + noise) / 3 * found + 2 / 3 * noise**2
    unseen = 0.9 / 4 * found + noise**2
    belief = trial.identity()
    np.testing.assert_allclose(
        [*belief.objects, belief.unseen], np.array([a, b, unseen]) / (a + b + unseen), atol=1e-12
    )


def test_of_different_looks_at_rest_the_first_whole_one_is_learned_from():
    trial, twin = (
        begin_trial("bayes-filter", MEMORY, ModelParameters(0.3, 0.1, learn_in_trial=True)) for _ in range(2)
    )
    for each, looks in ((trial, [(3,), (0,)]), (twin, [(3,)])):
        for look in looks:
            each.observe(look)
        each.act("turn")
        each.observe((2,))
    for edges, of_twin in zip(trial.model.edges, twin.model.edges, strict=True):
        np.testing.assert_array_equal(edges, of_twin)


def test_an_engine_that_needs_to_be_sure_says_so():
    trial = begin_trial("large-memory", MEMORY, FIXED)
    trial.observe((0,))
    trial.observe((0,))
    with pytest.raises(InvalidInputError, match="an action that is not sure; expected one that is"):
        trial.act({"turn": 0.5, "tip": 0.5})
    trial.act("turn")
    trial.observe((1,))
