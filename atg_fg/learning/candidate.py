"""One structure against all trials in memory: how well it explains each, and what it makes of their objects."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.learning.likelihood import TrialScores, score_trials
from atg_fg.learning.rates import FAILED, Rates, Tally
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure


class Candidate:
    """A structure with its scores of all trials, kept up trial by trial.

    Args:
        structure: In canonical form.
        assumptions: |O| and the patterns.

    Attributes:
        log_evidence: ln p(trial | structure) given ``NEW``, ``FILED`` and ``BEFORE``, shape [3, n]. The last sums over
            the object that a trial is filed under and a new one alone.
        n_looks: Of each trial, shape [n].
        events: Expected numbers in each trial, columns as ``atg_fg.learning.rates`` has them, shape [n, FAILED].
        contents: What is known of each object, each of shape [P, S].
    """

    def __init__(self, structure: SharedStructure, assumptions: Assumptions) -> None:
        self.structure = structure
        self._alphabet, self._n_objects = assumptions.alphabet, assumptions.n_objects
        self.forget()

    def forget(self) -> None:
        """Have all trials scored anew, and the contents of all objects learned anew."""
        self.log_evidence: FloatArray = np.zeros((3, 0))
        self.n_looks: IntArray = np.zeros(0, dtype=np.int64)
        self.events: FloatArray = np.zeros((0, FAILED))
        self.contents: list[FloatArray] = []

    def catch_up(self, trials: Sequence[RawTrial], owners: Sequence[int], rates: Rates) -> None:
        """Score the trials that are not scored yet, and learn from them what their objects contain.

        Args:
            trials: All raw trials.
            owners: Index of the object of each; a new object has the next index.
            rates: Those in force.
        """
        n_before, n_known = len(self.events), len(self.contents)
        if n_before == len(trials):
            return
        new, by_owner = trials[n_before:], dict[int, list[int]]()
        for number, owner in enumerate(owners[n_before:]):
            by_owner.setdefault(owner, []).append(number)
        nothing = np.zeros((len(new), self.structure.n_registers, self._alphabet.n_symbols))
        met = [owner for owner in by_owner if owner < n_known]
        # All trials as those of fresh objects, and the first ones of objects that were met before as theirs.
        scores = self._learn(met, [*new, *(new[by_owner[owner][0]] for owner in met)], nothing, rates)
        fresh = scores.log_evidence[: len(new)]
        filed = fresh.copy()
        filed[[by_owner[owner][0] for owner in met]] = scores.log_evidence[len(new) :]
        for owner, contents in zip(owners[n_before:], scores.contents, strict=False):
            if owner == len(self.contents):
                self.contents.append(contents)
        # The second trials of all objects at once, then the third, …
        for rank in range(1, max(map(len, by_owner.values()))):
            again = [owner for owner, numbers in by_owner.items() if len(numbers) > rank]
            numbers = [by_owner[owner][rank] for owner in again]
            filed[numbers] = self._learn(again, [new[number] for number in numbers], nothing[:0], rates).log_evidence
        given = self._given(fresh, filed, n_known, owners[n_before:])
        self.log_evidence = np.concatenate((self.log_evidence, given), axis=1)
        self.n_looks = np.concatenate((self.n_looks, [len(trial.detections) for trial in new]))
        self.events = np.concatenate((self.events, scores.events[: len(new)]))

    def _given(self, fresh: FloatArray, filed: FloatArray, n_known: int, owners: Sequence[int]) -> FloatArray:
        """Return the evidence of the newest trials by what is given, shape [3, len(fresh)].

        An object is the one that the trial is filed under, or any that was not met yet, each as probable.
        """
        n_met = np.maximum.accumulate([n_known - 1, *owners[:-1]]) + 1
        n_objects = np.maximum(self._n_objects, n_met + 1)
        of_new = np.log(n_objects - n_met) + fresh
        before = np.where(np.array(owners) == n_met, of_new, np.logaddexp(of_new, filed)) - np.log(n_objects)
        return np.array([fresh, filed, before])

    def _learn(self, owners: Sequence[int], trials: Sequence[RawTrial], fresh: FloatArray, rates: Rates) -> TrialScores:
        """Score trials of fresh objects, and then of known ones, whose contents are learned from these."""
        before = np.array([*fresh, *(self.contents[owner] for owner in owners)])
        scores = score_trials(self.structure, trials, rates, self._alphabet, before)
        for owner, contents in zip(owners, scores.contents[len(fresh) :], strict=True):
            self.contents[owner] = contents
        return scores

    def tally(self, following: FloatArray) -> Tally:
        """Return the expected numbers of events over all trials, each counted as far as it follows the structure.

        Args:
            following: The probability that each follows it, shape [n].
        """
        slips, wrong, repeats, reveals, again, n_failed_before = following @ self.events
        n_actions, n_looks = following @ (self.n_looks - 1), following @ self.n_looks
        return Tally(*map(float, (slips, n_actions, again, n_failed_before, wrong, n_looks, repeats, reveals)))
