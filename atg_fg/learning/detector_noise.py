"""What looks are worth: how often labels are right, which are taken for which, and what confidences mean.

Learned by expectation maximisation from how probable it is that each label of the past was right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray

#: Beta prior of a wrong label.
WRONG_PRIOR: Final = (1.0, 9.0)
#: Beta prior of a label that is wrong though not all of its look is.
ALONE_PRIOR: Final = (1.0, 49.0)
#: If more labels than this are wrong alone, it may be the structure that errs.
EXPECTED_ALONE: Final = ALONE_PRIOR[0] / sum(ALONE_PRIOR)
#: How many looks the mean of all confidences counts for in each bin.
BIN_PRIOR: Final = 2.0
#: How many wrong labels of each symbol the uniform distribution over the other symbols counts for.
CONFUSION_PRIOR: Final = 500.0
#: Bins of confidences, each of as many looks, once there are this many looks a bin.
MAX_BINS: Final = 8
LOOKS_OF_BIN: Final = 12
#: A label is never taken for more certain than this.
MOST_CERTAIN: Final = 0.9995


@dataclass(frozen=True, eq=False)
class DetectorNoise:
    """p(label | symbol, confidence).

    Attributes:
        edges: Confidences at which one bin ends and the next begins, ascending, shape [B − 1].
        right: Probability that a label is right in each bin, shape [B].
        confusion: p(label | symbol, the label is wrong), shape [V, V]; rows sum to one, the diagonal is 0.
        wrong: Probability that a label is wrong, whatever its confidence.
        alone: Probability that a label is wrong though not all of its look is.
    """

    edges: FloatArray
    right: FloatArray
    confusion: FloatArray
    wrong: float
    alone: float = EXPECTED_ALONE

    @classmethod
    def unknown(cls, n_symbols: int) -> DetectorNoise:
        """Return what is believed before the first look."""
        wrong = WRONG_PRIOR[0] / sum(WRONG_PRIOR)
        return cls(np.zeros(0), np.array([1.0 - wrong]), _uniform(n_symbols), wrong)

    def likelihoods(self, labels: IntArray, confidences: FloatArray, *, of_right_looks: bool = False) -> FloatArray:
        """Return p(label | symbol), up to a factor, of labels of any shape […]; the shape is […, V].

        Args:
            labels: Symbols seen, −1 where none was: that says nothing.
            confidences: Of each; where none was given, not a number.
            of_right_looks: Whether the looks are known not to be wrong as a whole.
        """
        n_symbols = len(self.confusion)
        wrong = self.alone if of_right_looks else self.wrong
        right = np.where(np.isnan(confidences), 1.0 - wrong, self.right[self._bins(confidences)])[..., None]
        seen = np.maximum(labels, 0)
        is_right = seen[..., None] == np.arange(n_symbols)
        likelihood = np.where(is_right, right, (1.0 - right) * self.confusion.T[seen])
        return np.where(labels[..., None] >= 0, n_symbols * likelihood, 1.0)

    def learned(
        self,
        labels: IntArray,
        confidences: FloatArray,
        right: FloatArray,
        truth: FloatArray,
        sound: FloatArray | None = None,
    ) -> DetectorNoise:
        """Return the noise estimated from all looks.

        Args:
            labels: As for ``likelihoods``.
            confidences: As for ``likelihoods``.
            right: p(label is right) of each.
            truth: Expected number of looks by symbol and label, shape [V, V].
            sound: Probability that the whole look of each label is not wrong, if looks are judged.
        """
        seen = labels >= 0
        alone = self.alone
        if sound is not None:
            errors = np.sum((sound * (1.0 - right))[seen])
            alone = float((errors + ALONE_PRIOR[0]) / (np.sum(sound[seen]) + sum(ALONE_PRIOR)))
            alone = max(alone, 1.0 - MOST_CERTAIN)
        right, confidences = right[seen], confidences[seen]
        wrong = float((np.sum(1.0 - right) + WRONG_PRIOR[0]) / (len(right) + sum(WRONG_PRIOR)))
        wrong = max(wrong, 1.0 - MOST_CERTAIN)
        stated = ~np.isnan(confidences)
        n_bins = int(np.clip(np.count_nonzero(stated) // LOOKS_OF_BIN, 1, MAX_BINS))
        edges = (
            np.unique(np.quantile(confidences[stated], np.arange(1, n_bins) / n_bins)) if n_bins > 1 else np.zeros(0)
        )
        bins = np.searchsorted(edges, confidences[stated], side="right")
        number = np.bincount(bins, minlength=len(edges) + 1)
        expected = np.bincount(bins, right[stated], minlength=len(edges) + 1)
        rate = (expected + BIN_PRIOR * (1.0 - wrong)) / (number + BIN_PRIOR)
        mistaken = truth * (1.0 - np.eye(len(truth)))
        counted = mistaken + CONFUSION_PRIOR * _uniform(len(truth))
        confusion = counted / counted.sum(axis=1, keepdims=True)
        return DetectorNoise(edges, np.clip(rate, 1.0 / len(truth), MOST_CERTAIN), confusion, wrong, alone)

    def _bins(self, confidences: FloatArray) -> IntArray:
        bins: IntArray = np.searchsorted(self.edges, np.nan_to_num(confidences), side="right")
        return bins


def _uniform(n_symbols: int) -> FloatArray:
    """Return the uniform distribution over all other symbols of each."""
    return (1.0 - np.eye(n_symbols)) / max(n_symbols - 1, 1)
