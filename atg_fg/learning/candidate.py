"""One structure against all trials in memory: how well it explains each, and what it makes of their objects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.learning.likelihood import score_trials
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
        fresh = score_trials(self.structure, trials[n_before:], rates, self._alphabet)
        self.log_evidence = np.concatenate((self.log_evidence, fresh.log_evidence))
        self.events = np.concatenate((self.events, fresh.events))
        later: dict[int, list[int]] = {}
        for number in range(n_before, len(trials)):
            if owners[number] == len(self.contents):
                self.contents.append(fresh.contents[number - n_before])
            else:
                later.setdefault(owners[number], []).append(number)
        # The second trials of all objects at once, then the third, …
        for rank in range(max(map(len, later.values()), default=0)):
            again = [owner for owner, numbers in later.items() if len(numbers) > rank]
            self._learn_contents(again, [trials[later[owner][rank]] for owner in again], rates)

    def _learn_contents(self, owners: Sequence[int], trials: Sequence[RawTrial], rates: Rates) -> None:
        before = np.array([self.contents[owner] for owner in owners])
        scores = score_trials(self.structure, trials, rates, self._alphabet, before)
        for owner, contents in zip(owners, scores.contents, strict=True):
            self.contents[owner] = contents

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
