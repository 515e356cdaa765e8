import numpy as np
import pytest

from atg_fg.learning.detector_noise import DetectorNoise


def recorded(rng, n_looks=4000):
    """Looks of a detector whose confidences are no probabilities: right from 5 to 9, wrong from 3 to 7."""
    truth = rng.integers(4, size=n_looks)
    is_wrong = rng.random(n_looks) < 0.2
    labels = np.where(is_wrong, (truth + rng.integers(1, 4, size=n_looks)) % 4, truth)
    confidences = np.where(is_wrong, rng.uniform(3, 7, size=n_looks), rng.uniform(5, 9, size=n_looks))
    return truth, labels, confidences, is_wrong


def counts(truth, labels):
    table = np.zeros((4, 4))
    np.add.at(table, (truth, labels), 1.0)
    return table


def test_what_is_missing_says_nothing():
    noise = DetectorNoise.unknown(4)
    assert np.array_equal(noise.likelihoods(np.array([-1]), np.array([np.nan])), np.ones((1, 4)))


def test_likelihoods_are_right_and_wrong_labels():
    likelihood = DetectorNoise.unknown(4).likelihoods(np.array([2]), np.array([np.nan]))[0] / 4
    assert likelihood == pytest.approx([0.1 / 3, 0.1 / 3, 0.9, 0.1 / 3])


def test_confidences_are_calibrated_whatever_their_scale():
    rng = np.random.default_rng(1)
    truth, labels, confidences, is_wrong = recorded(rng)
    noise = DetectorNoise.unknown(4).learned(labels, confidences, 1.0 - is_wrong, counts(truth, labels))
    assert noise.wrong == pytest.approx(0.2, abs=0.02)
    sure, doubtful = noise.likelihoods(np.array([1, 1]), np.array([8.5, 3.5]))[:, 1] / 4
    assert sure > 0.99
    assert doubtful == pytest.approx(0.25, abs=0.1)  # never below chance
    assert (np.diff(noise.right) > -0.05).all()


def test_confusions_are_learned_slowly_from_wrong_labels_alone():
    truth, labels = np.zeros(3000, dtype=int), np.zeros(3000, dtype=int)
    labels[:1500] = 3
    noise = DetectorNoise.unknown(4).learned(labels, np.full(3000, np.nan), labels == truth, counts(truth, labels))
    assert noise.confusion[0, 3] > 0.7
    assert noise.confusion[1] == pytest.approx([1 / 3, 0, 1 / 3, 1 / 3])
    assert noise.confusion.sum(axis=1) == pytest.approx(np.ones(4))


def test_no_label_is_ever_certain():
    labels = np.zeros(100_000, dtype=int)
    noise = DetectorNoise.unknown(4).learned(labels, np.full(100_000, np.nan), np.ones(100_000), np.zeros((4, 4)))
    assert noise.likelihoods(labels[:1], np.array([np.nan]))[0, 1] > 0
