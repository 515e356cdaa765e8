"""Register maps against the states that they lead through: a ring of three registers, of which one is seen."""

import itertools

import numpy as np
import pytest

from atg_fg.learning import kernels, map_kernels
from atg_fg.learning.detector_noise import DetectorNoise
from atg_fg.learning.kernels import TrialArrays
from tests.learning.test_kernels import PRIOR, drawn_trials, simulated


def test_evidence_of_register_maps_is_that_of_their_states():
    trials = drawn_trials(np.random.default_rng(7))
    ring = np.array([[1, 2, 0], [1, 0, 2]])  # place 0 is seen; as maps: where each place takes its content from
    total = map_kernels.map_log_evidence(map_kernels.fresh_trials(trials, np.full(4, -np.inf), 1, PRIOR), ring)
    places, number, successors = [(0, 1, 2)], {(0, 1, 2): 0}, []
    for place in places:
        row = []
        for sources in ring:
            turned = tuple(place[source] for source in sources)
            if turned not in number:
                number[turned] = len(places)
                places.append(turned)
            row.append(number[turned])
        successors.append(row)
    registers = np.array(places)[:, :1].copy()
    fresh = kernels.fresh_log_evidence(trials, np.array(successors).T.copy(), registers, 3, PRIOR)
    assert total == pytest.approx(fresh.sum(), abs=1e-12)


@pytest.mark.slow
def test_annealed_maps_find_the_ring():
    rng = np.random.default_rng(8)
    recording, _ = simulated(rng, n_trials=12, n_looks=8, contents=[(0, 1, 2), (2, 1, 0), (1, 0, 2), (0, 0, 1)])
    looks = DetectorNoise.unknown(3).likelihoods(recording.labels, recording.confidences)
    trials = TrialArrays(looks, recording.actions, recording.lengths)
    fresh, sources = map_kernels.fresh_trials(trials, np.full(12, -np.inf), 1, PRIOR), np.array([[0, 1, 2], [0, 1, 2]])
    beta = np.geomspace(0.15, 1.0, 20)
    found = map_kernels.anneal_maps(fresh, map_kernels.no_maps(2), sources, beta, False, 0.0, rng)
    truth = map_kernels.map_log_evidence(fresh, np.array([[1, 2, 0], [1, 0, 2]]))
    assert found >= truth - 1e-9
    assert found == pytest.approx(map_kernels.map_log_evidence(fresh, sources))


@pytest.mark.parametrize("copies", [False, True])
def test_no_move_betters_what_a_cold_chain_ends_in(copies):
    """Six registers, two seen, half of the trials likelier plain; each neighbour's evidence is summed up anew."""
    rng = np.random.default_rng(9)
    labels, n_registers, cost = rng.integers(0, 3, size=(8, 7, 2)), 6, 0.7
    looks = np.where(labels[..., None] == np.arange(3), 0.9, 0.05)
    plain = np.where(np.arange(8) % 2, -12.0, -200.0)
    trials = TrialArrays(looks, rng.integers(0, 2, size=(8, 7)), rng.integers(4, 8, size=8))

    def worth(sources):
        n_losses = sum(len(set(each)) < n_registers for each in sources.tolist())
        fresh = map_kernels.fresh_trials(trials, plain, 2, PRIOR)
        return map_kernels.map_log_evidence(fresh, sources) - cost * n_losses

    sources = np.array([rng.permutation(n_registers) for _ in range(2)])
    fresh, known = map_kernels.fresh_trials(trials, plain, 2, PRIOR), map_kernels.no_maps(2)
    best = map_kernels.anneal_maps(fresh, known, sources, np.array([0.5, *[100.0] * 9]), copies, cost * copies, rng)
    assert best == pytest.approx(worth(sources), abs=1e-9)
    for action, register, other in itertools.product(range(2), range(n_registers), range(n_registers)):
        swapped, copied = sources.copy(), sources.copy()
        swapped[action, [register, other]] = swapped[action, [other, register]]
        copied[action, register] = other
        assert worth(swapped) <= best + 1e-9
        assert not copies or worth(copied) <= best + 1e-9
