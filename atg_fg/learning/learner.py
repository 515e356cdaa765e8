"""Learning of the shared structure, trial by trial.

Structures that explained the trials so far are kept, and each new trial is scored under them. At milestones, which
come ever more rarely, the rates are estimated again, and as long as no structure is settled others are searched for.
So the whole of what is learned depends on the trials and the seed alone, and the work is bounded where there is
nothing to be found.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import TooLargeError
from atg_fg.core.patterns import FloatArray
from atg_fg.learning.believed_structure import BelievedStructure
from atg_fg.learning.candidate import Candidate
from atg_fg.learning.kinds import choose_kinds, kind_table, share_kinds
from atg_fg.learning.likelihood import plain_log_evidence
from atg_fg.learning.milestones import is_milestone
from atg_fg.learning.rates import Rates, Tally, estimate_rates
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.search import SearchPlan, propose_structures
from atg_fg.learning.shared_structure import SharedStructure
from atg_fg.learning.state_merging import merge_states, mode_automata

#: A structure is settled if it is this many nats better than none.
SETTLED_GAIN: Final = 50.0


#: A structure that takes this share of looks and symbols for errors is in doubt, however much it explains.
DOUBTFUL_ERRORS: Final = 0.02


#: A structure that takes a greater share of its followers' looks for errors is nearly right at best. It is not kept,
#: however much it explains: the same mistakes come again with the same object, and a new object, whose mistakes are
#: accidents as well, explains them as well as the right one. So many errors more are forgiven, for the first trials.
MAX_WRONG: Final = 0.02
FORGIVEN: Final = 2.0


#: Structures that are believed in at once, and how many nats the others may be behind the best.
MAX_BELIEVED: Final = 3
BELIEVED_WITHIN: Final = 7.0


#: Structures that are kept up, and how many nats they may be behind the best.
MAX_CANDIDATES: Final = 5
KEPT_WITHIN: Final = 10.0


#: Proposals of a search that are scored on all trials.
MAX_PROPOSALS: Final = 4


#: States of trials that no structure explains are merged if there are this many, and this share of all, from so many
#: draws of so many of them: for one mode, and for more. Where a draw with one mode has most of its trials follow, there
#: is no need for further modes.
LEAST_UNEXPLAINED: Final = 6
UNEXPLAINED_SHARE: Final = 0.1
N_DRAWS: Final = (24, 8)
DRAWN: Final = 16
MOST: Final = 0.75


#: Rates that differ by less than this factor are as good as the same.
RATE_FACTOR: Final = 1.25


class StructureLearner:
    """Learns what all objects share from raw trials.

    Args:
        assumptions: Actions and alphabet.
        seed: Of the searches.
        plan: How much is searched at a milestone.

    Attributes:
        trials: All raw trials, in their order.
        owners: Name of the object of each.
        rates: Those in force.
        n_evaluations: Structures scored in all searches so far.
    """

    def __init__(self, assumptions: Assumptions, seed: int = 0, plan: SearchPlan | None = None) -> None:
        self.assumptions, self.seed, self.plan = assumptions, seed, plan or SearchPlan()
        self.trials: list[RawTrial] = []
        self.owners: list[str] = []
        self.rates = Rates()
        self.n_evaluations = 0
        self._objects: dict[str, int] = {}
        self._owner_indices: list[int] = []
        self._plain: list[float] = []
        self._candidates: list[Candidate] = []
        self._kinds: list[Candidate] = []
        self._log_evidence_of_kinds = -np.inf

    def learn(self, owner: str, trial: RawTrial, *, search: bool = True) -> None:
        """Learn from one more trial.

        Args:
            owner: Name of its object.
            trial: What was seen and done.
            search: Whether other structures may be searched for.
        """
        self._append(owner, trial)
        for candidate in self._candidates:
            candidate.extend(trial, self._owner_indices[-1], self.rates)
        self._select()
        if is_milestone(len(self.trials)):
            if search and self._is_worth_a_search():
                self._search()
            if search:
                self._merge()
            self._estimate_rates()
            self._select()

    def restore(
        self, owners: Sequence[str], trials: Sequence[RawTrial], structures: Sequence[SharedStructure], rates: Rates
    ) -> None:
        """Become the learner that had these trials, candidates and rates, without searching again."""
        for owner, trial in zip(owners, trials, strict=True):
            self._append(owner, trial)
        self.rates = rates
        if self.trials:
            self._candidates = [self._scored(structure) for structure in structures]
            self._choose()

    def settle(self) -> None:
        """Keep the best of the structures at hand, best first, and estimate the rates: trials were put together."""
        self._select()
        self._estimate_rates()
        self._select()

    def hand_over(self, numbers: Sequence[int], owner: str) -> None:
        """Take raw trials for those of another object, and learn the contents of all objects anew.

        Args:
            numbers: Of the trials, in their order.
            owner: Name of the object that they are of.
        """
        if not numbers:
            return
        for number in numbers:
            self.owners[number] = owner
        self._objects = {}
        self._owner_indices = [self._objects.setdefault(each, len(self._objects)) for each in self.owners]
        self._rescore()

    def take_for(self, trials: Sequence[RawTrial]) -> None:
        """Take what was seen in all raw trials for something else, of the same objects, and score structures anew."""
        self.trials[:] = trials
        self._plain = [plain_log_evidence(trial, self.assumptions) for trial in self.trials]
        self._rescore()

    def same_as(self, other: StructureLearner) -> bool:
        """Return whether both learned the same from the same trials."""
        known, others = ((each.trials, each.owners, each.candidates, each.rates, each.seed) for each in (self, other))
        return known == others

    @property
    def candidates(self) -> tuple[SharedStructure, ...]:
        """Structures that are kept up, best first."""
        return tuple(candidate.structure for candidate in self._candidates)

    @property
    def gain(self) -> float:
        """How many nats the best structure, or set of kinds, is better than none, its prior included.

        −∞ if there is none.
        """
        plain = np.array(self._plain)
        best = max((each.score(plain) - float(plain.sum()) for each in self._candidates), default=-np.inf)
        return max(best, self._log_evidence_of_kinds - float(plain.sum())) if self._kinds else best

    @property
    def log_evidence(self) -> float:
        """Ln p(all trials, each of a fresh object) of the best structures, their prior included, or of none."""
        return float(sum(self._plain)) + max(self.gain, 0.0)

    def believed(self, names: Sequence[str]) -> list[BelievedStructure]:
        """Return the structures that are believed in, best first, for objects with these names.

        An object of which no trial is there follows none of them.
        """
        return self._believed_kinds(names) if self._kinds else self._believed_alone(names)

    def _believed_kinds(self, names: Sequence[str]) -> list[BelievedStructure]:
        """Return the structures of the set of kinds, the one with most members first."""
        by_trial = kind_table(self._kinds, np.array(self._plain), self.trials)
        by_object = np.zeros((len(self._objects), by_trial.shape[1]))
        np.add.at(by_object, self._owner_indices, by_trial)
        of = share_kinds(by_object)
        columns = sorted(range(1, by_trial.shape[1]), key=lambda column: -of.shares[column])
        return [
            self._of_names(self._kinds[column - 1], 1.0, of.responsibilities[:, column], names)._replace(
                share=float(of.shares[column])
            )
            for column in columns
        ]

    def _believed_alone(self, names: Sequence[str]) -> list[BelievedStructure]:
        """Return structures that are each the only one of its set."""
        plain = np.array(self._plain)
        scores = np.array([candidate.score(plain) for candidate in self._candidates])[:MAX_BELIEVED]
        scores = scores[scores >= scores.max(initial=-np.inf) - BELIEVED_WITHIN]
        if not len(scores):
            return []
        logarithms = np.append(scores, plain.sum())
        weights = np.exp(logarithms - logarithms.max())
        weights /= weights.sum()
        return [
            self._of_names(
                candidate, weight, candidate.followers(plain, self._owner_indices, self.rates.share), names
            )._replace(kinds=number)
            for number, (candidate, weight) in enumerate(zip(self._candidates, weights[:-1].tolist(), strict=False))
        ]

    def _of_names(
        self, candidate: Candidate, weight: float, followers: FloatArray, names: Sequence[str]
    ) -> BelievedStructure:
        """Return what a structure says of objects with these names, given the followers among those of trials."""
        own_followers = np.zeros(len(names))
        own_contents = np.zeros((len(names), candidate.structure.n_registers, self.assumptions.alphabet.n_symbols))
        for position, name in enumerate(names):
            if name in self._objects:
                index = self._objects[name]
                own_followers[position], own_contents[position] = followers[index], candidate.contents[index]
        return BelievedStructure(candidate.structure, weight, own_followers, own_contents, self.rates.share, 0)

    def _append(self, owner: str, trial: RawTrial) -> None:
        self.trials.append(trial)
        self.owners.append(owner)
        self._owner_indices.append(self._objects.setdefault(owner, len(self._objects)))
        self._plain.append(plain_log_evidence(trial, self.assumptions))

    def _is_worth_a_search(self) -> bool:
        """Return whether there may be a structure that explains more than those at hand.

        While none is settled this is so at each milestone, then whenever the trials have doubled: another structure may
        explain as much at first, or the rest of the trials.
        """
        n_trials = len(self.trials)
        has_doubled = n_trials.bit_length() > (n_trials * 4 // 5).bit_length()  # at every third milestone or so
        in_doubt = self.rates.wrong + self.rates.repeat > DOUBTFUL_ERRORS
        return self.gain < SETTLED_GAIN or in_doubt or has_doubled

    def _search(self) -> None:
        """Add what a search proposes to the candidates."""
        rng = np.random.default_rng((self.seed, len(self.trials)))
        incumbents = [structure for structure in self.candidates if structure.n_modes == 1]
        found = propose_structures(self.trials, self.assumptions, rng, plan=self.plan, incumbents=incumbents)
        self.n_evaluations += found.n_evaluations
        self._add(found.structures[:MAX_PROPOSALS])

    def _merge(self) -> None:
        """Add what trials merge into that no structure at hand explains."""
        unexplained = self._unexplained()
        if len(unexplained) < max(LEAST_UNEXPLAINED, UNEXPLAINED_SHARE * len(self.trials)):
            return
        rng = np.random.default_rng((self.seed, len(self.trials), 1))
        found: dict[SharedStructure, int] = {}
        for n_modes, n_draws in enumerate(N_DRAWS, start=1):
            for _ in range(n_draws):
                drawn = [self.trials[number] for number in rng.permutation(unexplained)[:DRAWN].tolist()]
                merged = [merge_states(drawn, each) for each in mode_automata(n_modes, len(self.assumptions.actions))]
                self.n_evaluations += len(merged)
                for each in merged:
                    if each is not None and _is_believable(each.structure):
                        found[each.structure] = max(each.n_trials, found.get(each.structure, 0))
            if max(found.values(), default=0) > MOST * min(DRAWN, len(unexplained)):
                break
        best = sorted(found, key=lambda structure: (-found[structure], -structure.log_prior))
        self._add(best[:MAX_PROPOSALS])

    def _unexplained(self) -> list[int]:
        """Return the numbers of the trials that probably follow no structure at hand."""
        if not self._candidates:
            return list(range(len(self.trials)))
        plain = np.array(self._plain)
        kinds = self._kinds or self._candidates[:1]
        following = share_kinds(kind_table(kinds, plain, self.trials)).responsibilities
        unexplained: list[int] = np.flatnonzero(following[:, 0] > 0.5).tolist()
        return unexplained

    def _add(self, structures: Sequence[SharedStructure]) -> None:
        for structure in structures:
            if structure in self.candidates:
                continue
            try:
                self._candidates.append(self._scored(structure))
            except TooLargeError:
                continue  # more poses than a structure may have
        self._select()

    def _select(self) -> None:
        """Keep the candidates that are worth it: the best alone, and the set of kinds that explains most together."""
        pool = self._candidates
        self._candidates = self._worth_keeping(pool)
        reliable = [each for each in pool if each in self._candidates or self._is_plausible(each)]
        self._candidates += [each for each in self._chosen(reliable)[0] if each not in self._candidates]
        self._choose()

    def _choose(self) -> None:
        """Have the best set of kinds among the candidates, if there is one that is better than any of them alone."""
        self._kinds, self._log_evidence_of_kinds = self._chosen(self._candidates)
        plain = np.array(self._plain)
        alone = max((each.score(plain) for each in self._candidates), default=-np.inf)
        if len(self._kinds) < 2 or self._log_evidence_of_kinds <= alone:
            self._kinds = []

    def _chosen(self, pool: Sequence[Candidate]) -> tuple[list[Candidate], float]:
        """Return the best set of kinds of a pool of which all are reliable, and its log evidence."""
        left, plain = list(pool), np.array(self._plain)
        while len(left) > 1:
            numbers, log_evidence = choose_kinds(left, plain, self.trials)
            kinds = [left[number] for number in numbers]
            of = share_kinds(kind_table(kinds, plain, self.trials))
            erring = [
                kind
                for kind, following in zip(kinds, of.responsibilities.T[1:], strict=True)
                if not _errs_little(kind.tally(self.trials, following))
            ]
            if not erring:
                return kinds, log_evidence
            left = [each for each in left if each not in erring]
        return [], -np.inf

    def _is_plausible(self, candidate: Candidate) -> bool:
        """Return whether most of what follows a structure, or several trials, follow it without many errors."""
        table = kind_table([candidate], np.array(self._plain), self.trials)
        following = share_kinds(table).responsibilities[:, 1]
        return bool((following > 0.5).sum() >= 2)

    def _rescore(self) -> None:
        for candidate in self._candidates:
            candidate.rescore(self.trials, self._owner_indices, self.rates)
        if self.trials:
            self._choose()

    def _scored(self, structure: SharedStructure) -> Candidate:
        candidate = Candidate(structure, self.assumptions.alphabet)
        candidate.rescore(self.trials, self._owner_indices, self.rates)
        return candidate

    def _worth_keeping(self, pool: Sequence[Candidate]) -> list[Candidate]:
        """Return the best candidates, best first, without those that are far behind, explain nothing or err much."""
        plain = np.array(self._plain)
        useful = [each for each in pool if each.responsibilities(plain).max() > 0.5 and self._is_reliable(each, plain)]
        scored = sorted(((each.score(plain), each) for each in useful), key=lambda pair: -pair[0])
        best = max(float(plain.sum()), scored[0][0]) if scored else 0.0
        return [each for score, each in scored[:MAX_CANDIDATES] if score >= best - KEPT_WITHIN]

    def _is_reliable(self, candidate: Candidate, plain: FloatArray) -> bool:
        return _errs_little(candidate.tally(self.trials, candidate.responsibilities(plain)))

    def _estimate_rates(self) -> None:
        """Estimate the rates under the best structures, if better than none, and score anew if they changed."""
        if self.gain <= 0:
            return
        plain = np.array(self._plain)
        if self._kinds:
            of = share_kinds(kind_table(self._kinds, plain, self.trials))
            tallies = [
                kind.tally(self.trials, following)
                for kind, following in zip(self._kinds, of.responsibilities.T[1:], strict=True)
            ]
            tally = Tally(*map(sum, zip(*tallies, strict=True)))
            followers = 1.0 - of.responsibilities[:, 0]
        else:
            best = self._candidates[0]
            followers = best.followers(plain, self._owner_indices, self.rates.share)
            tally = best.tally(self.trials, best.responsibilities(plain))
        estimated = estimate_rates(tally, followers)
        old, new = (np.array([each.slip, each.wrong, each.repeat]) for each in (self.rates, estimated))
        if np.abs(np.log(new / old)).max() < np.log(RATE_FACTOR):
            self.rates = Rates(self.rates.slip, self.rates.wrong, self.rates.repeat, estimated.share)
            return
        self.rates = estimated
        self._rescore()


def _is_believable(structure: SharedStructure) -> bool:
    try:
        structure.poses()
    except TooLargeError:
        return False
    return True


def _errs_little(tally: Tally) -> bool:
    return tally.wrong <= FORGIVEN + MAX_WRONG * tally.n_looks
