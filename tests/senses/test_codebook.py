"""The mixture of appearance classes: against enumeration of all partitions, and what holds of any looks."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.errors import InvalidInputError
from atg_fg.senses.codebook import Codebook

ONE_DIMENSION = np.array([4.0])


def partitions(n):
    """Yield every way to put n looks into classes, as labels that are numbered in the order of their first look."""
    for labels in itertools.product(range(n), repeat=n):
        if all(label <= max(labels[:index], default=-1) + 1 for index, label in enumerate(labels)):
            yield np.array(labels)


def gaussian(points, between, within):
    """Return ln p of points of one class, all together, from their covariance: every pair shares the class's mean."""
    n = len(points)
    covariance = within * np.eye(n) + between * np.ones((n, n))
    _, determinant = np.linalg.slogdet(covariance)
    return -0.5 * (n * math.log(2 * math.pi) + determinant + points @ np.linalg.solve(covariance, points))


def enumerated(points, labels, between, within, concentration):
    """Return ln p(points, which fall together): seated one by one, each class from its full covariance."""
    seating, sizes = 0.0, {}
    for index, label in enumerate(labels):
        weight = sizes.get(label, concentration)
        seating += math.log(weight / (index + concentration))
        sizes[label] = sizes.get(label, 0) + 1
    return seating + sum(gaussian(points[labels == label], between, within) for label in sizes)


def test_the_evidence_of_a_partition_is_that_of_its_covariances():
    points = np.array([0.3, -1.7, 0.9, 2.2])
    book = Codebook(ONE_DIMENSION, 4, within=0.5, concentration=0.7)
    for labels in partitions(4):
        expected = enumerated(points, labels, 4.0, 0.5, 0.7)
        assert book.log_evidence(points[:, None], labels) == pytest.approx(expected, abs=1e-12)


def test_the_posterior_of_the_next_look_is_a_ratio_of_evidence():
    points, labels = np.array([[0.3], [0.9], [-1.7]]), np.array([0, 0, 1])
    book = Codebook(ONE_DIMENSION, 5, within=0.5, concentration=0.7)
    for point, label in zip(points, labels, strict=True):
        book.add(point, int(label))
    look = np.array([0.1])
    joint = [
        book.log_evidence(np.vstack((points, look)), np.append(labels, label)) - book.log_evidence(points, labels)
        for label in range(3)
    ]
    expected = np.exp(np.array(joint) - np.logaddexp.reduce(joint))
    belief = book.posterior(look)
    assert belief.classes[:2] == pytest.approx(expected[:2], abs=1e-12)
    assert belief.new == pytest.approx(expected[2], abs=1e-12)
    assert not belief.classes[2:].any()


def test_refitting_finds_the_best_of_all_partitions():
    points = np.array([[-3.0], [-2.6], [3.1], [2.9], [0.1]])
    book = Codebook(ONE_DIMENSION, 5, within=0.1)
    best = max(partitions(5), key=lambda labels: book.log_evidence(points, labels))
    for given_labels in ([0, 0, 0, 0, 0], [0, 1, 2, 3, 4], [0, 1, 0, 1, 0], [-1, -1, -1, -1, -1]):
        found = book.refit(points, given_labels)
        assert book.log_evidence(points, found) == pytest.approx(book.log_evidence(points, best), abs=1e-12)


def test_a_class_keeps_the_number_that_most_of_its_looks_had():
    points = np.array([[-3.0], [-2.9], [-3.1], [3.0], [3.1]])
    book = Codebook(ONE_DIMENSION, 9, within=0.1)
    assert book.refit(points, [7, 7, 4, 4, 4]).tolist() == [7, 7, 7, 4, 4]
    assert (book.counts[7], book.counts[4], book.n_classes) == (3, 2, 2)


def test_all_that_new_classes_may_be_called_stands_at_the_next_number():
    book = Codebook(ONE_DIMENSION, 6, within=0.5)
    book.add(np.array([1.0]), 0)
    look = np.array([3.0])
    known, new = book.log_densities(look)
    weights = book.likelihood(look)
    assert weights[1] / weights[0] == pytest.approx(5 * math.exp(new - known[0]), rel=1e-12)
    assert not weights[2:].any()


def test_once_all_numbers_are_given_no_class_is_new():
    book = Codebook(ONE_DIMENSION, 2)
    for number in range(2):
        book.add(np.array([float(number)]), number)
    assert book.next_number is None
    assert book.posterior(np.array([50.0])).new == 0
    assert book.posterior(np.array([50.0])).classes.sum() == pytest.approx(1)


@given(st.data())
def test_refitting_never_explains_the_looks_worse_and_adds_up(data):
    n = data.draw(st.integers(2, 14))
    seed = data.draw(st.integers(0, 10_000))
    rng = np.random.default_rng(seed)
    points = np.round(rng.normal(size=(n, 2)) * data.draw(st.sampled_from((0.2, 1.0, 4.0))), 4)
    labels = rng.integers(0, 3, n)
    book = Codebook([4.0, 1.0], 16, within=0.3)
    before = book.log_evidence(points, labels)
    found = book.refit(points, labels)
    after = book.log_evidence(points, found)
    assert after >= before - 1e-9
    assert book.counts.sum() == n
    for number in np.flatnonzero(book.counts):
        assert book.sums[number] == pytest.approx(points[found == number].sum(axis=0), abs=1e-9)


@given(st.lists(st.tuples(st.integers(0, 3), st.floats(-9, 9)), min_size=1, max_size=12), st.floats(-9, 9))
def test_beliefs_are_distributions_and_a_look_taken_out_leaves_no_trace(looks, look):
    book = Codebook(ONE_DIMENSION, 4, within=0.5)
    for number, value in looks:
        book.add(np.array([value]), number)
    before = book.copy()
    belief = book.posterior(np.array([look]))
    assert belief.classes.sum() + belief.new == pytest.approx(1)
    book.add(np.array([look]), 2)
    book.add(np.array([look]), 2, -1)
    assert book.counts.tolist() == before.counts.tolist()
    assert book.sums == pytest.approx(before.sums, abs=1e-9)


@pytest.mark.parametrize(
    ("between", "options", "message"),
    [
        ([], {}, "expected variances above 0"),
        ([1.0, 0.0], {}, "expected variances above 0"),
        ([np.inf], {}, "expected variances above 0"),
        ("many", {}, "codebook: between: 'many'; expected variances above 0"),
        ([1.0], {"within": 0.0}, "codebook: within: 0"),
        ([1.0], {"within": float("nan")}, "codebook: within: nan"),
        ([1.0], {"concentration": -1.0}, "codebook: concentration: -1"),
    ],
)
def test_a_codebook_of_nonsense_is_refused(between, options, message):
    with pytest.raises(InvalidInputError, match=message):
        Codebook(between, 4, **options)


@pytest.mark.parametrize(
    ("look", "message"),
    [
        ([1.0, 2.0], r"look: shape \(2,\); expected 1 numbers, as in the codebook"),
        (1.0, r"look: shape \(\); expected 1 numbers"),
        ([[1.0]], r"look: shape \(1, 1\); expected 1 numbers"),
        ([np.nan], "look: 1 not finite"),
        (["a"], "look: .*; expected 1 numbers"),
    ],
)
def test_a_look_of_another_length_or_of_no_numbers_is_refused(look, message):
    book = Codebook(ONE_DIMENSION, 4)
    calls = (book.log_densities, book.likelihood, book.posterior, lambda each: book.add(each, 0))
    for value, call in itertools.product((look, np.array(look)), calls):
        with pytest.raises(InvalidInputError, match=message):
            call(value)
    assert book.n_classes == 0


def test_classes_that_there_are_not_and_looks_that_nobody_put_there_are_refused():
    book = Codebook(ONE_DIMENSION, 4)
    for number in (-1, 4, 1.0):
        with pytest.raises(InvalidInputError, match=f"codebook: class: {number}; expected a whole number from 0 to 3"):
            book.add(np.zeros(1), number)
    with pytest.raises(InvalidInputError, match="codebook: class 2 has 0 looks; expected 1 that can be taken out"):
        book.add(np.zeros(1), 2, -1)
    assert book.counts.tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize(
    ("looks", "labels", "message"),
    [
        (np.zeros((2, 3)), [0, 0], r"looks: shape \(2, 3\); expected looks of 1 numbers"),
        ([[0.0], [np.inf]], [0, 0], "looks: 1 not finite"),
        (np.zeros((2, 1)), [0], "labels: 1; expected one for each of 2 looks"),
        (np.zeros((2, 1)), [0, 4], r"labels\[1\]: 4; expected a whole number from -1 to 3"),
    ],
)
def test_looks_and_labels_that_do_not_fit_are_refused(looks, labels, message):
    book = Codebook(ONE_DIMENSION, 4)
    for call in (book.refit, book.log_evidence):
        with pytest.raises(InvalidInputError, match=message):
            call(looks, labels)
