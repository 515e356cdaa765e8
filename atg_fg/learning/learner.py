"""Learning of the shared structure, trial by trial.

Structures that explained the trials so far are kept, and each new trial is scored under them. At milestones, which
come ever more rarely, the rates are estimated again, and as long as no structure is settled others are searched for.
So the whole of what is learned depends on the trials and the seed alone, and the work is bounded where there is
nothing to be found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import MISSING, FloatArray
from atg_fg.learning.believed_structure import BelievedStructure, UncertainObjects
from atg_fg.learning.candidate import Candidate
from atg_fg.learning.kinds import (
    N_PLAIN,
    UNCERTAIN_KIND,
    KindSet,
    choose_kinds,
    kind_table,
    share_kinds,
    tally_events,
)
from atg_fg.learning.likelihood import FILED, NEW
from atg_fg.learning.milestones import is_milestone
from atg_fg.learning.plain_evidence import USUAL, PlainEvidence, PlainNoise
from atg_fg.learning.rates import Rates, estimate_rates
from atg_fg.learning.raw_trials import RawTrial, Recording
from atg_fg.learning.shared_structure import SharedStructure
from atg_fg.learning.state_merging import merged_draws
from atg_fg.learning.structure_repair import follows, repairs

#: A structure is settled if it is this many nats better than none.
SETTLED_GAIN: Final = 50.0
#: A structure that takes this share of looks and symbols for errors is in doubt, however much it explains.
DOUBTFUL_ERRORS: Final = 0.02
#: Structures that are kept up, and how many nats they may be behind the best.
MAX_CANDIDATES: Final = 5
KEPT_WITHIN: Final = 10.0
#: Proposals of a search that are scored on all trials.
MAX_PROPOSALS: Final = 4
#: Annealing: chains for each number of registers, and probability of a wrong label.
N_CHAINS: Final = 3
WRONG_LABEL: Final = 0.01
#: Trials that no structure explains are merged if there are this many, and this share of all.
LEAST_UNEXPLAINED: Final = 6
UNEXPLAINED_SHARE: Final = 0.1
#: Rates that differ by less than this factor are as good as the same.
RATE_FACTOR: Final = 1.25


class StructureLearner:
    """Learns what all objects share from raw trials.

    Args:
        assumptions: Actions and alphabet.
        seed: Of the searches.

    Attributes:
        trials: All raw trials, in their order.
        owners: Name of the object of each.
        rates: Those in force.
        noise: α and δ of plain objects whose actions are uncertain.
        n_evaluations: Structures scored in all searches so far.
    """

    def __init__(self, assumptions: Assumptions, seed: int = 0) -> None:
        self.assumptions, self.seed = assumptions, seed
        self.trials: list[RawTrial] = []
        self.owners: list[str] = []
        self.rates = Rates()
        self.n_evaluations = 0
        self._objects: dict[str, int] = {}
        self._owner_indices: list[int] = []
        self.noise = USUAL
        self._plain = PlainEvidence(assumptions)
        self._candidates: list[Candidate] = []
        self._chosen: list[KindSet] = []
        self._n_chosen_from = -1
        #: ln p(all trials) of sets of candidates
        self._evidence_of_sets: dict[frozenset[int], float] = {}
        #: p(kind | its trials) of each object, one without and one never met, by a set's structures, [K + 2, 2 + those]
        self._kinds_of_objects: dict[tuple[int, ...], FloatArray] = {}

    def learn(self, owner: str, trial: RawTrial, *, rests: bool = False) -> None:
        """Learn from one more trial.

        Args:
            owner: Name of its object.
            trial: What was seen and done.
            rests: Whether the trial is only kept, unless it is a milestone, and no structures are searched for but by
                merging: what it says of those at hand is made out when it is asked for.
        """
        self._append(owner, trial)
        at_milestone = is_milestone(len(self.trials))
        if not self._can_explain or (rests and not at_milestone):
            return
        self._select()
        self._repair()
        if at_milestone:
            self._merge()
            if not rests and self._is_worth_a_search():
                self._search()
            self._estimate_rates()
            self._select()
        elif self._n_unexplained_is_milestone():
            self._merge()
        self._estimate_noise()

    def restore(
        self,
        owners: Sequence[str],
        trials: Sequence[RawTrial],
        structures: Sequence[SharedStructure],
        rates: Rates,
        noise: PlainNoise = USUAL,
    ) -> None:
        """Become the learner that had these trials, candidates and rates, without searching again."""
        for owner, trial in zip(owners, trials, strict=True):
            self._append(owner, trial)
        self.rates, self.noise = rates, noise
        self._candidates = [Candidate(structure, self.assumptions) for structure in structures]

    def settle(self) -> None:
        """Keep the best of the structures at hand, best first, and estimate the rates: trials were put together."""
        if self._sets:
            self._select()
            self._estimate_rates()
            self._select()
            self._estimate_noise()

    def hand_over(self, owners: Mapping[int, str]) -> None:
        """Take raw trials for those of other objects, and learn the contents of all objects anew.

        Args:
            owners: Name of the object that each is of, by the number of the trial.
        """
        if not owners:
            return
        for number, owner in owners.items():
            self.owners[number] = owner
        self._objects = {}
        self._owner_indices = [self._objects.setdefault(each, len(self._objects)) for each in self.owners]
        self._rescore()

    def take_for(self, trials: Sequence[RawTrial]) -> None:
        """Take what was seen in all raw trials for something else, of the same objects, and score structures anew."""
        self.trials[:] = trials
        self._rescore()

    def same_as(self, other: StructureLearner) -> bool:
        """Return whether both learned the same from the same trials."""
        known, others = (
            (each.trials, each.owners, each.candidates, each.rates, each.noise, each.seed) for each in (self, other)
        )
        return known == others

    @property
    def candidates(self) -> tuple[SharedStructure, ...]:
        """Structures that are kept up, best first."""
        return tuple(candidate.structure for candidate in self._candidates)

    @property
    def _sets(self) -> list[KindSet]:
        """The sets of kinds that explain all trials best."""
        if self._n_chosen_from != len(self.trials):
            self._choose()
        return self._chosen

    @property
    def _can_explain(self) -> bool:
        """Whether structures are for objects like these: symbols do not repeat within a pattern."""
        return self.assumptions.alphabet.exclusive

    @property
    def gain(self) -> float:
        """How many nats the best set of kinds is better than plain ATGs alone, its prior included.

        −∞ if no structure is in it.
        """
        if not self._sets or not self._sets[0].structures:
            return -np.inf
        return self._sets[0].log_evidence - self._evidence_of_sets[frozenset()]

    @property
    def log_evidence(self) -> float:
        """Ln p(all trials, each of an object never met) of the best set of kinds, its prior included."""
        if not self._sets:
            return 0.0
        chosen = [self._candidates[number] for number in self._sets[0].structures]
        fresh = kind_table(chosen, self._plain.of_kinds(self.noise, NEW), self.rates, NEW)
        return share_kinds(fresh).log_evidence + sum(each.structure.log_prior for each in chosen)

    def believed(self, names: Sequence[str]) -> list[BelievedStructure]:
        """Return the structures that are believed in, best first, for objects with these names.

        An object of which no trial is there follows none of them.
        """
        n_registers = self.assumptions.alphabet.n_symbols
        followers: dict[int, FloatArray] = {}
        total: dict[int, float] = {}
        for weight, each in zip(self._weights, self._sets, strict=True):
            of = self._members(each, names)
            for column, number in enumerate(each.structures, start=N_PLAIN):
                total[number] = total.get(number, 0.0) + weight
                followers[number] = followers.get(number, np.zeros(len(names) + 1)) + weight * of[:, column]
        believed = []
        for number in sorted(total, key=lambda number: (-total[number], -followers[number][-1])):
            candidate, own = self._candidates[number], followers[number] / total[number]
            contents = np.zeros((len(names), candidate.structure.n_registers, n_registers))
            for position, name in enumerate(names):
                if name in self._objects:
                    contents[position] = candidate.contents[self._objects[name]]
            believed.append(BelievedStructure(candidate.structure, total[number], own[:-1], contents, float(own[-1])))
        return believed

    def uncertain(self, names: Sequence[str]) -> UncertainObjects | None:
        """Return what is believed of plain objects whose actions are uncertain; ``None`` if nothing was learned yet."""
        if not self._sets:
            return None
        of = np.zeros(len(names) + 1)
        for weight, each in zip(self._weights, self._sets, strict=True):
            of += weight * self._members(each, names)[:, UNCERTAIN_KIND]
        return UncertainObjects(self.noise, of[:-1], float(of[-1]))

    @property
    def _weights(self) -> list[float]:
        """The weight of each set that is believed in; they sum to one."""
        logarithms = np.array([each.log_evidence for each in self._sets])
        weights = np.exp(logarithms - logarithms.max(initial=-np.inf))
        result: list[float] = (weights / weights.sum()).tolist()
        return result

    def _members(self, kinds: KindSet, names: Sequence[str]) -> FloatArray:
        """Return which kind each object is of, and last one that was never met, shape [K + 1, 2 + structures].

        Of an object without a raw trial no structure is known to say anything.
        """
        shares = kinds.trials.shares
        if kinds.structures not in self._kinds_of_objects:
            chosen = [self._candidates[number] for number in kinds.structures]
            by_trial = kind_table(chosen, self._plain.of_kinds(self.noise, FILED), self.rates, FILED)
            by_object = np.zeros((len(self._objects), len(shares)))
            np.add.at(by_object, self._owner_indices, by_trial)
            by_object += np.log(shares)
            by_object = np.exp(by_object - by_object.max(axis=1, keepdims=True))
            by_object /= by_object.sum(axis=1, keepdims=True)
            without = np.append(shares[:N_PLAIN] / shares[:N_PLAIN].sum(), np.zeros(len(shares) - N_PLAIN))
            self._kinds_of_objects[kinds.structures] = np.vstack((by_object, without, shares))
        of: FloatArray = self._kinds_of_objects[kinds.structures][
            [*(self._objects.get(name, -2) for name in names), -1]
        ]
        return of

    def _of_plain(self) -> FloatArray:
        return self._plain.of_kinds(self.noise)

    def _append(self, owner: str, trial: RawTrial) -> None:
        self.trials.append(trial)
        self.owners.append(owner)
        self._owner_indices.append(self._objects.setdefault(owner, len(self._objects)))

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
        """Add what annealing by exact evidence proposes, of trials that do not merge: looks may be wrong or missing."""
        from atg_fg.learning import kernels, register_search  # they load Numba

        numbers = self._unexplained()
        if len(numbers) < LEAST_UNEXPLAINED:
            numbers = list(range(len(self.trials)))
        alphabet, n_actions = self.assumptions.alphabet, len(self.assumptions.actions)
        recording = Recording.of([self.trials[number] for number in numbers], alphabet.n_symbols)
        labels, symbols = recording.labels[..., None], np.arange(alphabet.n_symbols)
        shown = np.where(labels == symbols, 1.0 - WRONG_LABEL, WRONG_LABEL / (len(symbols) - 1))
        looks = np.where(labels == MISSING, 1.0, shown)
        found = register_search.search_registers(
            kernels.TrialArrays(looks, recording.actions, recording.lengths),
            np.logaddexp.reduce(self._plain.of_kinds(self.noise, NEW)[numbers], axis=1),
            len(alphabet.slots),
            n_actions,
            N_CHAINS,
            np.random.default_rng((self.seed, len(self.trials))),
        )
        self.n_evaluations += register_search.n_scored(len(alphabet.slots), n_actions, N_CHAINS)
        self._add(found[:MAX_PROPOSALS])

    def _repair(self) -> None:
        """Add structures that the last trial follows in place of one at hand that it contradicts."""
        trial, best = self.trials[-1], self._sets[0]
        kind = int(best.trials.responsibilities[-1].argmax())
        for column, number in enumerate(best.structures, start=N_PLAIN):
            structure = self._candidates[number].structure
            if kind in (column, *range(N_PLAIN)) and not follows(trial, structure):
                self._add(repairs(structure, trial, self.trials)[:MAX_PROPOSALS])
                return

    def _merge(self) -> None:
        """Add what trials merge into that no structure at hand explains."""
        unexplained = self._unexplained()
        if len(unexplained) >= max(LEAST_UNEXPLAINED, UNEXPLAINED_SHARE * len(self.trials)):
            rng = np.random.default_rng((self.seed, len(self.trials), 1))
            trials = [self.trials[number] for number in unexplained]
            merged, n_scored = merged_draws(trials, len(self.assumptions.actions), rng)
            self.n_evaluations += n_scored
            self._add(merged[:MAX_PROPOSALS])

    def _n_unexplained_is_milestone(self) -> bool:
        """Whether the last trial follows no structure at hand, and is one more milestone among those."""
        unexplained = self._unexplained()
        return unexplained[-1:] == [len(self.trials) - 1] and is_milestone(len(unexplained))

    def _unexplained(self) -> list[int]:
        """Return the numbers of the trials that probably follow no structure at hand."""
        plain = self._sets[0].trials.responsibilities[:, :N_PLAIN].sum(axis=1)
        unexplained: list[int] = np.flatnonzero(plain > 0.5).tolist()
        return unexplained

    def _add(self, structures: Sequence[SharedStructure]) -> None:
        for structure in structures:
            if structure not in self.candidates and structure.is_believable:
                self._candidates.append(Candidate(structure, self.assumptions))
        self._select()

    def _select(self) -> None:
        """Choose the sets of kinds, and keep their structures and those that are best beside them."""
        self._choose()
        kept = list(dict.fromkeys(number for each in self._sets for number in each.structures))
        others = [number for number in range(len(self._candidates)) if number not in kept]
        alone = {number: self._evidence_of_sets[frozenset((number,))] for number in others}
        least = self._evidence_of_sets[frozenset()] - KEPT_WITHIN
        spare = sorted((number for number in alone if alone[number] > least), key=lambda number: -alone[number])
        kept += spare[: max(MAX_CANDIDATES - len(kept), 0)]
        if kept != list(range(len(self._candidates))):
            self._candidates = [self._candidates[number] for number in kept]
            self._choose()

    def _choose(self) -> None:
        """Choose the sets of kinds among the candidates."""
        self._n_chosen_from, self._kinds_of_objects = len(self.trials), {}
        if not self._can_explain:
            return
        self._plain.catch_up(self.trials, self.owners)
        for each in self._candidates:
            each.catch_up(self.trials, self._owner_indices, self.rates)
        self._chosen, self._evidence_of_sets = [], {}
        if self.trials:
            self._chosen = choose_kinds(self._candidates, self._of_plain(), self.rates, self._evidence_of_sets)

    def _rescore(self) -> None:
        self._plain.forget()
        self._forget_scores()

    def _forget_scores(self) -> None:
        for candidate in self._candidates:
            candidate.forget()
        self._n_chosen_from = -1

    def _estimate_noise(self) -> None:
        """Estimate α and δ of objects whose actions are uncertain."""
        noise = self._plain.best_noise(self._sets[0].trials.responsibilities[:, UNCERTAIN_KIND])
        if noise != self.noise:
            self.noise = noise
            self._choose()

    def _estimate_rates(self) -> None:
        """Estimate the rates under the best set of kinds, if better than none, and score anew if they changed."""
        best = self._sets[0]
        if not best.structures:
            return
        tally, alone = tally_events(best, self._candidates, self._of_plain(), self.rates)
        followers = self._members(best, list(self._objects))[:-1, N_PLAIN:].sum(axis=1)
        estimated = estimate_rates(tally, followers, alone)
        old, new = (np.array([*each.slips, each.wrong, each.repeat]) for each in (self.rates, estimated))
        if np.abs(np.log(new / old)).max() < np.log(RATE_FACTOR):
            self.rates = replace(self.rates, share=estimated.share)
            return
        self.rates = estimated
        self._forget_scores()
