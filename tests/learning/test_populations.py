"""Populations of chains: which structures are believed in."""

from dataclasses import replace

import numpy as np
import pytest

from atg_fg.learning.detector_noise import DetectorNoise
from atg_fg.learning.populations import RegisterPopulation
from atg_fg.learning.raw_trials import Recording
from atg_fg.learning.sampling_task import Task
from atg_fg.learning.saved_chain import SavedChain
from atg_fg.learning.shared_structure import SharedStructure
from tests.learning.worlds import CUBE, cubes, trial_of

#: Content goes round other than on a cube.
OTHER = SharedStructure(2, ((1, 2, 3, 4, 0), (1, 0, 2, 3, 4), (0, 2, 1, 3, 4)))


def believed_in(n_known, n_trials, alone):
    """Maps believed in after so many noisy trials, where only ``OTHER`` was after the first of them."""
    rng = np.random.default_rng(0)
    trials = [trial_of(each, 10, rng, wrong=0.1, missing=0.1) for each in cubes(n_trials)]
    noise = replace(DetectorNoise.unknown(12), wrong=0.2, alone=alone)
    chain = SavedChain(OTHER, (), (), tuple(range(n_known)), (0,) * n_known, (), 0.01, 0.0)
    population = RegisterPopulation(2, 3, 12)
    population.restore([chain], Task.of(Recording.of(trials[:n_known], 12), noise, 100))
    names = np.array([*range(n_trials - 1), -1])
    population.advance(Task.of(Recording.of(trials, 12), noise, 100), names, rng)
    return population.maps


@pytest.mark.parametrize(("n_known", "n_trials"), [(9, 10), (27, 28), (13, 16)])
def test_maps_that_leave_single_labels_wrong_are_searched_for_again_at_the_next_milestone(n_known, n_trials):
    assert believed_in(n_known, n_trials, 0.1) == [CUBE]


def test_maps_under_which_looks_err_as_the_detectors_do_are_settled():
    assert believed_in(9, 10, 0.01) == [OTHER]
