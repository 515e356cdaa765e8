"""One structure against all trials in memory: how well it explains each, and what it makes of their objects."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from atg_fg.core.log_math import x_log_x
from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.learning.likelihood import score_trials
from atg_fg.learning.rates import Rates, Tally
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure

#: Rounds in which the share of trials that follow a structure is estimated.
_SHARE_ROUNDS: Final = 10


class Candidate:
    """A structure with its scores of all trials, kept up trial by trial.

    Args:
        structure: In canonical form.
        alphabet: The patterns.

    Attributes:
        log_evidence: ln p(trial | structure, a fresh object), shape [n].
        events: Expected slips, wrong looks, repeated symbols and revealed registers of each trial, shape [n, 4].
        contents: What is known of each object, each of shape [P, S].
    """

    def __init__(self, structure: SharedStructure, alphabet: PatternAlphabet) -> None:
        self.structure = structure
        self._alphabet = alphabet
        self.log_evidence: FloatArray = np.zeros(0)
        self.events: FloatArray = np.zeros((0, 4))
        self.contents: list[FloatArray] = []

    def rescore(self, trials: Sequence[RawTrial], owners: Sequence[int], rates: Rates) -> None:
        """Score all trials anew, and learn the contents of all objects anew.

        Args:
            trials: All raw trials, at least one.
            owners: Index of the object of each; a new object has the next index.
            rates: Those in force.
        """
        fresh = score_trials(self.structure, trials, rates, self._alphabet)
        self.log_evidence, self.events = fresh.log_evidence, fresh.events
        self.contents = []
        later: list[list[int]] = []
        for number, owner in enumerate(owners):
            if owner == len(self.contents):
                self.contents.append(fresh.contents[number])
                later.append([])
            else:
                later[owner].append(number)
        # The second trials of all objects at once, then the third, …
        for rank in range(max(map(len, later))):
            again = [owner for owner, numbers in enumerate(later) if len(numbers) > rank]
            self._learn_contents(again, [trials[later[owner][rank]] for owner in again], rates)

    def extend(self, trial: RawTrial, owner: int, rates: Rates) -> None:
        """Score one more trial, and learn from it what its object contains."""
        fresh = score_trials(self.structure, [trial], rates, self._alphabet)
        self.log_evidence = np.concatenate((self.log_evidence, fresh.log_evidence))
        self.events = np.concatenate((self.events, fresh.events))
        if owner == len(self.contents):
            self.contents.append(fresh.contents[0])
        else:
            self._learn_contents([owner], [trial], rates)

    def _learn_contents(self, owners: Sequence[int], trials: Sequence[RawTrial], rates: Rates) -> None:
        before = np.array([self.contents[owner] for owner in owners])
        scores = score_trials(self.structure, trials, rates, self._alphabet, before)
        for owner, contents in zip(owners, scores.contents, strict=True):
            self.contents[owner] = contents

    def responsibilities(self, plain: FloatArray) -> FloatArray:
        """Return the probability that each trial follows the structure rather than a plain ATG, shape [n].

        Args:
            plain: ln p(trial | plain), shape [n].
        """
        gain, share = self.log_evidence - plain, 0.5
        for _ in range(_SHARE_ROUNDS):
            following = logistic(gain + np.log(share) - np.log1p(-share))
            share = (1.0 + following.sum()) / (2.0 + len(following))
        return following

    def score(self, plain: FloatArray) -> float:
        """Return ln p(S) + ln ∫ Π_t (π p(trial | S) + (1 − π) p(trial | plain)) dπ, bounded from below.

        The bound is that of the responsibilities; it is tight where each trial clearly follows the structure or not.

        Args:
            plain: ln p(trial | plain), shape [n].
        """
        following = self.responsibilities(plain)
        explained = following @ self.log_evidence + (1.0 - following) @ plain
        doubt = -float((x_log_x(following) + x_log_x(1.0 - following)).sum())
        n, expected = len(following), float(following.sum())
        log_shares = math.lgamma(1.0 + expected) + math.lgamma(1.0 + n - expected) - math.lgamma(2.0 + n)
        return self.structure.log_prior + float(explained) + doubt + log_shares

    def tally(self, trials: Sequence[RawTrial], following: FloatArray) -> Tally:
        """Return the expected numbers of events over all trials, each counted as far as it follows the structure.

        Args:
            trials: All raw trials.
            following: The probability that each follows it, shape [n].
        """
        slips, wrong, repeats, reveals = following @ self.events
        n_actions = following @ np.array([len(trial.actions) for trial in trials])
        n_looks = following @ np.array([len(trial.detections) for trial in trials])
        return Tally(*map(float, (slips, n_actions, wrong, n_looks, repeats, reveals)))

    def followers(self, plain: FloatArray, owners: Sequence[int], share: float) -> FloatArray:
        """Return ρ, the probability of each object to follow the structure, shape [K].

        Args:
            plain: ln p(trial | plain), shape [n].
            owners: Index of the object of each trial.
            share: π.
        """
        gain = np.bincount(np.array(owners), self.log_evidence - plain, len(self.contents))
        return logistic(gain + np.log(share) - np.log1p(-share))


def logistic(logits: FloatArray) -> FloatArray:
    """Return 1 / (1 + e^-x), elementwise and without overflow."""
    result: FloatArray = np.exp(-np.logaddexp(0.0, -logits))
    return result
