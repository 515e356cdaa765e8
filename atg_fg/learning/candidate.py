"""One structure against all trials in memory: how well it explains each, and what it makes of their objects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.learning.likelihood import TrialScores, score_trials
from atg_fg.learning.rates import Rates, Tally
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure


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

    def forget(self) -> None:
        """Have all trials scored anew, and the contents of all objects learned anew."""
        self.log_evidence, self.events, self.contents = np.zeros(0), np.zeros((0, 4)), []

    def catch_up(self, trials: Sequence[RawTrial], owners: Sequence[int], rates: Rates) -> None:
        """Score the trials that are not scored yet, and learn from them what their objects contain.

        Args:
            trials: All raw trials.
            owners: Index of the object of each; a new object has the next index.
            rates: Those in force.
        """
        n_before = len(self.log_evidence)
        if n_before == len(trials):
            return
        new, by_owner = trials[n_before:], dict[int, list[RawTrial]]()
        for owner, trial in zip(owners[n_before:], new, strict=True):
            by_owner.setdefault(owner, []).append(trial)
        fresh = np.zeros((len(new), self.structure.n_registers, self._alphabet.n_symbols))
        met = [owner for owner in by_owner if owner < len(self.contents)]
        # All trials as those of fresh objects, and the first ones of objects that were met before as theirs.
        scores = self._learn(met, [*new, *(by_owner[owner][0] for owner in met)], fresh, rates)
        self.log_evidence = np.concatenate((self.log_evidence, scores.log_evidence[: len(new)]))
        self.events = np.concatenate((self.events, scores.events[: len(new)]))
        for owner, contents in zip(owners[n_before:], scores.contents, strict=False):
            if owner == len(self.contents):
                self.contents.append(contents)
        # The second trials of all objects at once, then the third, …
        for rank in range(1, max(map(len, by_owner.values()))):
            again = [owner for owner, numbers in by_owner.items() if len(numbers) > rank]
            self._learn(again, [by_owner[owner][rank] for owner in again], fresh[:0], rates)

    def _learn(self, owners: Sequence[int], trials: Sequence[RawTrial], fresh: FloatArray, rates: Rates) -> TrialScores:
        """Score trials of fresh objects, and then of known ones, whose contents are learned from these."""
        before = np.array([*fresh, *(self.contents[owner] for owner in owners)])
        scores = score_trials(self.structure, trials, rates, self._alphabet, before)
        for owner, contents in zip(owners, scores.contents[len(fresh) :], strict=True):
            self.contents[owner] = contents
        return scores

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
