"""Populations of chains whose structure is an automaton, shared or an object's own, and rivalry between populations."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.learning import gibbs_kernels, kernels
from atg_fg.learning.chain import Chain
from atg_fg.learning.milestones import is_milestone
from atg_fg.learning.populations import HOPELESS, Conclusion, Population, Samples, log_mean
from atg_fg.learning.raw_trials import Recording
from atg_fg.learning.sampling_task import Structure, Task
from atg_fg.learning.saved_chain import SavedChain

#: Chains of automata, their sweeps a trial, and how much their scores are tempered: these are means over few sweeps.
N_AUTOMATA: Final = 6
AUTOMATON_SWEEPS: Final = 12
AUTOMATON_TEMPERATURE: Final = 2.0
#: Sweeps where objects may have their own automata.
OWN_SWEEPS: Final = 8
#: A population that is so many nats behind its rival, after so many trials, is given up. Before that the better one may
#: be far behind: an automaton has more to learn than register maps.
RIVAL_BEHIND: Final = 20.0
RIVAL_TRIALS: Final = 20
#: Sweeps of a chain that is made anew, and how hot it begins.
RESTART_SWEEPS: Final = 40
RESTART_HOTTEST: Final = 0.1
#: An automaton has |G| states, but at least, and at most, so many. States that are not needed cost nothing by
#: themselves, but with more of them chains find the right ones less often.
LEAST_STATES: Final = 8
MOST_STATES: Final = 12


class AutomatonPopulation(Population):
    """Chains of automata that all objects share.

    Args:
        n_aspects: |G|.
        n_slots: J.
        n_actions: A.
        n_symbols: V.
        may_own: Whether objects may have automata of their own instead.
    """

    def __init__(self, n_aspects: int, n_slots: int, n_actions: int, n_symbols: int, *, may_own: bool = False) -> None:
        super().__init__()
        self._may_own = may_own
        self._n_states = min(max(n_aspects, LEAST_STATES), MOST_STATES)
        self._n_slots, self._n_actions, self._n_symbols = n_slots, n_actions, n_symbols

    def advance(self, task: Task, names: IntArray, rng: np.random.Generator) -> Conclusion:
        """Take in the last trial of a task; at milestones, make the worst chain anew."""
        if self._may_own:
            task = task._replace(log_own=self._own_evidence(task))
        predictive: list[float] = []
        if not self.chains:
            begin = self._new if len(names) == 1 else partial(self._annealed, task)
            self.chains = [begin(rng) for _ in range(N_AUTOMATA)]
        elif is_milestone(len(names)):
            worst = int(np.argmin([chain.score for chain in self.chains]))
            self.chains[worst] = self._annealed(task, rng)
        samples: list[Samples] = []
        for chain in self.chains:
            if len(chain.clusters.owner) < len(names):
                known = len(chain.clusters.owner)
                chain.admit(task)
                if known == len(names) - 1:
                    predictive.append(chain.log_predictive(task))
                chain.place(task, np.arange(known, len(names)), rng)
            samples.append(Samples(chain, names, task))
            for sweep in range(OWN_SWEEPS if self._may_own else AUTOMATON_SWEEPS):
                votes = chain.sweep(task, rng, automaton=True)
                if sweep >= OWN_SWEEPS // 2:
                    samples[-1].add(votes)
        conclusion = self._conclude(samples, AUTOMATON_TEMPERATURE)
        best = max(self.chains, key=lambda chain: chain.score)
        self.chains = [chain if chain.score > best.score - HOPELESS else best.copy() for chain in self.chains]
        return conclusion._replace(log_predictive=log_mean(predictive))

    def _own_evidence(self, task: Task) -> FloatArray:
        """Return ln p(trial | a fresh object with its own automaton), by draws that depend on the trial alone."""
        trials = kernels.TrialArrays(task.looks, task.recording.actions, task.recording.lengths)
        prior = np.full(self._n_symbols, 1.0 / self._n_symbols)
        sizes = (self._n_states, self._n_actions)
        numbers = range(len(trials.lengths))
        return np.array(
            [
                gibbs_kernels.own_log_evidence(trials, trial, *sizes, prior, np.random.default_rng(trial))
                for trial in numbers
            ]
        )

    def log_evidence(self, task: Task) -> float:
        """Return ln p(all trials, each of a fresh object) + ln p(automaton) of the best chain."""
        best = max(self.chains, key=lambda chain: chain.score)
        fresh = best.fresh_log_evidence(task)
        return float(fresh.sum()) - self._n_actions * self._n_states * float(np.log(self._n_states))

    def saved(self, recording: Recording) -> list[SavedChain]:
        """Return the chains as they are kept."""
        return [chain.saved(None, recording) for chain in self.chains]

    def restore(self, saved: Sequence[SavedChain], task: Task) -> None:
        """Have the chains that were kept."""
        self.chains = []
        for each in saved:
            chain = self._of(np.array(each.successors, dtype=np.int64))
            chain.restore(each, task)
            self.chains.append(chain)

    def _new(self, rng: np.random.Generator) -> Chain:
        return self._of(rng.integers(self._n_states, size=(self._n_actions, self._n_states)))

    def _of(self, successors: IntArray) -> Chain:
        registers = np.arange(successors.shape[1] * self._n_slots).reshape(-1, self._n_slots)
        structure = Structure(successors, registers, registers.size)
        return Chain(structure, 0.0, self._n_symbols, may_own=self._may_own)

    def _annealed(self, task: Task, rng: np.random.Generator) -> Chain:
        chain = self._new(rng)
        chain.admit(task)
        chain.anneal(task, RESTART_HOTTEST, RESTART_SWEEPS, rng)
        return chain


class RivalPopulations(Population):
    """Populations of different classes of structure, by what they foretell.

    What each population foretells of a trial before it is taken in is its evidence, trial by trial. One that is far
    behind is given up.

    Args:
        rivals: Two or more, each with ln of its prior weight; saved chains know them by their number.
    """

    def __init__(self, *rivals: tuple[Population, float]) -> None:
        super().__init__()
        self._rivals = [population for population, _ in rivals]
        self._log_evidence = [log_prior for _, log_prior in rivals]

    def advance(self, task: Task, names: IntArray, rng: np.random.Generator) -> Conclusion:
        """Take in the last trial of a task."""
        alive = [number for number, each in enumerate(self._log_evidence) if each > -np.inf]
        conclusions = [self._rivals[number].advance(task, names, rng) for number in alive]
        for number, conclusion in zip(alive, conclusions, strict=True):
            self._log_evidence[number] += conclusion.log_predictive
        logarithms = np.array([self._log_evidence[number] for number in alive])
        shares = np.exp(logarithms - logarithms.max())
        shares /= shares.sum()
        self.chains = [chain for number in alive for chain in self._rivals[number].chains]
        weighed = list(zip(shares.tolist(), conclusions, strict=True))
        result = Conclusion(
            shares @ np.array([each.probabilities for each in conclusions]),
            np.concatenate([share * each.weights for share, each in weighed]),
            shares @ np.array([each.together for each in conclusions]),
            np.concatenate([each.partitions for each in conclusions]),
            np.concatenate([share * each.shares for share, each in weighed]),
        )
        if len(names) >= RIVAL_TRIALS:
            for number in alive:
                if self._log_evidence[number] < logarithms.max() - RIVAL_BEHIND:
                    self._log_evidence[number] = -np.inf
                    gone = {id(chain) for chain in self._rivals[number].chains}
                    kept = np.array([id(chain) not in gone for chain in self.chains])
                    self.chains = [chain for chain in self.chains if id(chain) not in gone]
                    self._rivals[number].give_up()
                    result = result._replace(weights=result.weights[kept] / result.weights[kept].sum())
        return result

    def log_evidence(self, task: Task) -> float:
        """Return ln p(all trials, each of a fresh object) + ln p(structure) of the best rival's best structure."""
        return self._rivals[int(np.argmax(self._log_evidence))].log_evidence(task)

    def saved(self, recording: Recording) -> list[SavedChain]:
        """Return the chains as they are kept, those of each rival with its evidence."""
        return [
            chain._replace(rival=(number, self._log_evidence[number]))
            for number, rival in enumerate(self._rivals)
            for chain in rival.saved(recording)
        ]

    def restore(self, saved: Sequence[SavedChain], task: Task) -> None:
        """Have the chains that were kept."""
        self._log_evidence = [-np.inf] * len(self._rivals)
        for number, rival in enumerate(self._rivals):
            own = [each for each in saved if each.rival is not None and each.rival[0] == number]
            if own and own[0].rival is not None:
                self._log_evidence[number] = own[0].rival[1]
            rival.restore(own, task)
        self.chains = [chain for rival in self._rivals for chain in rival.chains]
