"""Libraries that one would pick instead say the same as this one, where they can."""

import warnings

import numpy as np
import pytest

from atg_fg.core.errors import MissingDependencyError
from atg_fg.core.log_math import x_log_x
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import begin_trial
from benchmarks import peers
from benchmarks.contestants import TOLERANCE
from benchmarks.dense_tables import dense_model, table_bytes
from benchmarks.memories import course_for, remembered

PARAMETERS = [ModelParameters(1e-8, 1e-8, learn_in_trial=False), ModelParameters(0.3, 0.05, learn_in_trial=False)]


@pytest.fixture(scope="module")
def memory():
    return remembered(8)


@pytest.fixture
def quiet():
    """What other libraries warn of is theirs."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def peer_or_skip(name, model):
    try:
        return peers.make_peer(name, model)
    except MissingDependencyError as error:
        pytest.skip(f"{name} is {error}")


def looks_of(memory, parameters, peer):
    """Follow a trial with a peer and the Bayes filter; yield the latter after each look."""
    course = course_for(memory, 4)
    for _ in range(2):  # a second trial knows nothing of the first
        inference = begin_trial("bayes-filter", memory, parameters)
        peer.begin()
        for time, evidence in enumerate(course.evidence):
            if time:
                inference.act(course.actions[time - 1])
                peer.act(course.actions[time - 1])
            inference.observe(evidence)
            peer.look(evidence)
            yield inference


@pytest.mark.parametrize("parameters", PARAMETERS)
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == "pyAgrum" else pytest.mark.peers) for name in peers.PEERS]
)
def test_a_peer_gives_the_same_identity_and_expected_entropies(name, parameters, memory, quiet):
    peer = peer_or_skip(name, dense_model(memory, parameters))
    for inference in looks_of(memory, parameters, peer):
        identity, expected = peer.identity(), peer.decide()
        assert identity.dtype == np.float64
        np.testing.assert_allclose(identity, inference.identity().probabilities, atol=TOLERANCE, rtol=0)
        if name == "pymdp":
            assert expected is None
        else:
            np.testing.assert_allclose(expected, inference.expected_entropies(), atol=TOLERANCE, rtol=0)


@pytest.mark.peers
@pytest.mark.parametrize("parameters", PARAMETERS)
def test_pymdp_scores_actions_by_information_on_object_and_aspect(parameters, memory, quiet):
    model = dense_model(memory, parameters)
    peer = peer_or_skip("pymdp", model)
    for inference in looks_of(memory, parameters, peer):
        peer.decide()
        predicted = np.einsum("hx,ahxy->ahy", inference.aspect_belief, model.transition)
        patterns = np.einsum("ahy,hyz->az", predicted, model.observation)
        noise = np.einsum("ahy,hyz->a", predicted, x_log_x(model.observation))
        information = noise - x_log_x(patterns).sum(axis=1)
        np.testing.assert_allclose(peer.information_gains(), information, atol=TOLERANCE, rtol=0)


def test_the_dense_tables_are_distributions_and_those_of_the_model(memory):
    model = dense_model(memory, PARAMETERS[1])
    np.testing.assert_allclose(model.prior.sum(), 1, atol=1e-14)
    np.testing.assert_allclose(model.initial.sum(axis=-1), 1, atol=1e-14)
    np.testing.assert_allclose(model.transition.sum(axis=-1), 1, atol=1e-14)
    np.testing.assert_allclose(model.observation.sum(axis=-1), 1, atol=1e-14)
    assert model.n_actions == 3
    assert model.initial[~model.there].sum() == 0
    assert model.transition.transpose(1, 3, 0, 2)[~model.there].sum() == 0  # nothing leads to padding
    assert table_bytes(memory) == model.transition.nbytes + model.observation.nbytes


def test_a_library_that_is_not_installed_is_named(memory, monkeypatch):
    monkeypatch.setitem(peers.PEERS, "JAX", ("jax_filter", "JaxFilter", "no_such_library"))
    with pytest.raises(MissingDependencyError, match=r"not installed: pip install 'atg-fg\[bench\]' brings JAX"):
        peers.make_peer("JAX", dense_model(memory, PARAMETERS[0]))
