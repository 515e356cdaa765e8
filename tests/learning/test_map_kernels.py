"""Register maps against the states that they lead through: a ring of three registers, of which one is seen."""

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
