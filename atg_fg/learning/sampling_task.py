"""What chains of samples are given."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.learning.detector_noise import MOST_CERTAIN, DetectorNoise
from atg_fg.learning.number_of_objects import log_new_weights, log_partition
from atg_fg.learning.raw_trials import Recording


class Structure(NamedTuple):
    """The one form that all structures compile to.

    Attributes:
        successors: The state that each action leads to, shape [A, S].
        registers: The register in each slot in each state, shape [S, J].
        n_registers: R.
    """

    successors: IntArray
    registers: IntArray
    n_registers: int


class Task(NamedTuple):
    """What the moves of all chains have in common while one trial is taken in.

    Attributes:
        recording: All raw trials, the new one last.
        looks: Their likelihoods, shape [N, T, J, V].
        log_new: ln of the weight of a new object beside each known one, by how many are known.
        log_partition: ln of the prior of a partition, by the number of objects.
        log_own: ln p(trial | a fresh object with an automaton of its own), shape [N]; empty where none may have one.
        right_looks: The likelihoods of looks that are not wrong as a whole, shape [N, T, J, V].
        alone: Probability that a label is wrong though not all of its look is.
    """

    recording: Recording
    looks: FloatArray
    log_new: FloatArray
    log_partition: FloatArray
    log_own: FloatArray
    right_looks: FloatArray = np.zeros((0, 0, 0, 0))
    alone: float = 0.0

    @classmethod
    def of(cls, recording: Recording, noise: DetectorNoise, n_objects: int) -> Task:
        """Return the task of sampling with this noise, where there are at most ``n_objects``."""
        # A likelihood is taken at its word, but for what no look is ever certain of.
        soft = MOST_CERTAIN * recording.likelihoods + (1.0 - MOST_CERTAIN)
        seen = recording.labels, recording.confidences
        n_trials = len(recording.lengths)
        return cls(
            recording,
            noise.likelihoods(*seen) * soft,
            log_new_weights(n_objects, n_trials, n_trials + 3),
            log_partition(n_objects, n_trials, n_trials + 3),
            np.zeros(0),
            noise.likelihoods(*seen, of_right_looks=True) * soft,
            noise.alone,
        )
