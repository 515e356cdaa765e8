"""What is learned from raw trials whose looks err: which are of one object, what all objects share, how looks err.

At the end of each trial all raw trials are sampled again. What is believed depends on the trials, their order and the
seed alone.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.learning.detector_noise import EXPECTED_ALONE, DetectorNoise
from atg_fg.learning.learner import StructureLearner
from atg_fg.learning.raw_trials import RawTrial, Recording
from atg_fg.learning.saved_chain import SavedChain

#: A structure that takes more labels than this for wrong explains nothing.
MOST_WRONG: Final = 0.3
#: A trial is of a new object if that is more probable than this.
NOVEL: Final = 0.5
#: Classes of structure that are rivals where there is one slot.
MOST_RIVALS: Final = 3
#: ln of the prior weight of each other class beside an automaton that all objects share, where there is one slot.
LOG_PRIOR_OF_OTHERS: Final = -4.0
#: Chains of less weight are not followed through a trial.
LEAST_WEIGHT: Final = 1e-3

# Compiled code takes longer to load than all else, so it is loaded where it is used.
if TYPE_CHECKING:
    from atg_fg.learning.chain import Chain
    from atg_fg.learning.populations import Conclusion, Population
    from atg_fg.learning.sampling_task import Task


class BelievedChain(NamedTuple):
    """One chain, with what it says of the K remembered objects.

    Attributes:
        weight: Of the chain; with those of the others it sums to one.
        successors: The state that each action leads to, shape [A, S].
        registers: The register in each slot in each state, shape [S, J].
        tables: p(symbol in each register) of each object, and last of a new one, shape [K + 1, R, V].
        log_prior: ln p(object) when a trial begins, shape [K + 1]; −∞ of objects that follow another automaton, or that
            the chain does not know.
        slip: ε.
    """

    weight: float
    successors: IntArray
    registers: IntArray
    tables: FloatArray
    log_prior: FloatArray
    slip: float


class Verdict(NamedTuple):
    """What is believed of the last trial, once all are sampled again.

    Attributes:
        names: Of the objects of all trials before.
        probabilities: p(the trial is of the object of each name), *new* last, shape [names + 1].
    """

    names: tuple[str, ...]
    probabilities: FloatArray


class SavedEvidence(NamedTuple):
    """What was sampled, as it is kept.

    Attributes:
        chains: All of them.
        weights: Of each.
        noise: Of the detector.
        n_trials: Raw trials that were sampled, the first ones.
        log_evidence: Of these.
    """

    chains: tuple[SavedChain, ...]
    weights: tuple[float, ...]
    noise: DetectorNoise
    n_trials: int
    log_evidence: float


class _State(NamedTuple):
    """All that is learned: replaced, never changed."""

    population: Population | None
    noise: DetectorNoise
    weights: FloatArray
    n_trials: int
    log_evidence: float
    partition: IntArray


class EvidenceLearner:
    """Learns from the raw trials that a structure learner keeps.

    Args:
        learner: Has the trials, the names of their objects, and the seed.
    """

    def __init__(self, learner: StructureLearner) -> None:
        self.learner, self.assumptions, self.seed = learner, learner.assumptions, learner.seed
        noise = DetectorNoise.unknown(self.assumptions.alphabet.n_symbols)
        self._state = _State(None, noise, np.zeros(0), 0, 0.0, np.zeros(0, dtype=np.int64))
        self._concluded: tuple[tuple[RawTrial, ...], _State, Verdict] | None = None
        self._saved: SavedEvidence | None = None

    def saved(self) -> SavedEvidence | None:
        """Return what was sampled, as it is kept; ``None`` if nothing was."""
        state = self._state
        if self._saved is None and state.population is not None:
            recording = Recording.of(self.learner.trials[: state.n_trials], self.assumptions.alphabet.n_symbols)
            chains = tuple(state.population.saved(recording))
            self._saved = SavedEvidence(
                chains, tuple(state.weights.tolist()), state.noise, state.n_trials, state.log_evidence
            )
        return self._saved

    def restore(self, saved: SavedEvidence) -> None:
        """Go on from what was sampled once."""
        self._saved = saved

    def _awake(self) -> _State:
        """Return the state, made of what was kept if that has not been done yet."""
        if self._saved is not None and self._state.population is None:
            saved, population = self._saved, self._population()
            task = self._task(self.learner.trials[: saved.n_trials], saved.noise)
            population.restore(saved.chains, task)
            weights = np.array(saved.weights)
            nothing = np.zeros(0, dtype=np.int64)
            self._state = _State(population, saved.noise, weights, saved.n_trials, saved.log_evidence, nothing)
        return self._state

    def copy(self, learner: StructureLearner) -> EvidenceLearner:
        """Return one that has learned the same, of another learner with the same trials."""
        twin = EvidenceLearner(learner)
        twin._state, twin._saved = copy.deepcopy(self._state), self._saved
        return twin

    @property
    def noise(self) -> DetectorNoise:
        """How looks err."""
        return self._current.noise

    @property
    def log_evidence(self) -> float:
        """Ln p(all trials, each of a fresh object) + ln p(structure) of the best structure."""
        return self._current.log_evidence

    def conclude(self, trial: RawTrial) -> Verdict:
        """Return what is believed of a trial that has ended, all others sampled again; nothing is learned yet."""
        return self._sampled_with((trial,))[1]

    def objects_with(self, trials: Sequence[RawTrial]) -> list[int]:
        """Return which trials are of one object, as ``objects`` does, of all trials and of more; nothing is learned."""
        result: list[int] = self._sampled_with(tuple(trials))[0].partition.tolist()
        return result

    def _sampled_with(self, more: tuple[RawTrial, ...]) -> tuple[_State, Verdict]:
        n_trials = len(self.learner.trials) + len(more)
        if self._concluded is None or self._concluded[0] != more or self._concluded[1].n_trials != n_trials:
            sampled = self._sampled(self._current, [*self.learner.trials, *more], self.learner.owners)
            self._concluded = more, *sampled
        return self._concluded[1:]

    def learn(self) -> None:
        """Learn from the trials that the learner has just been given."""
        trials, owners = self.learner.trials, self.learner.owners
        done, self._concluded = self._concluded, None
        state = self._awake()
        if done is not None and done[1].n_trials == len(trials) and done[0] == tuple(trials[-len(done[0]) :]):
            state = done[1]
        elif state.n_trials == len(trials) - 1:
            state = self._sampled(state, trials, owners[:-1])[0]
        self._adopt(state)

    def _adopt(self, state: _State) -> None:
        self._state, self._saved = state, None

    def forget_verdict(self) -> None:
        """Sample again before the next verdict: trials have changed hands."""
        self._concluded = None

    def believed(self, names: Sequence[str]) -> list[BelievedChain]:
        """Return the chains, as far as they matter, for objects with these names."""
        state, trials = self._current, self.learner.trials
        if state.population is None:
            return []
        task, numbers = self._task(trials, state.noise), self._numbers(self.learner.owners, names)
        return [
            part
            for chain, weight in zip(state.population.chains, state.weights.tolist(), strict=True)
            if weight > LEAST_WEIGHT
            for part in _believed(chain, weight, task, numbers, len(names))
        ]

    def objects(self) -> list[int]:
        """Return which trials are of one object: a number each, the same for the same object.

        The estimate makes few pairs of trials wrong (``partition_estimate``); the last trial is of the object of the
        one that it is most probably of one object with, or of none before it.
        """
        state, owners = self._current, self.learner.owners
        known = len(state.partition) == len(owners)
        result: list[int] = (state.partition if known else self._numbers(owners, tuple(dict.fromkeys(owners)))).tolist()
        return result

    def best(self) -> Chain | None:
        """Return the chain of most weight, ``None`` if nothing was sampled."""
        state = self._current
        return None if state.population is None else state.population.chains[int(state.weights.argmax())]

    @property
    def is_mistaken(self) -> bool:
        """Whether what the best chain takes for wrong labels recurs, as a structure's mistakes do, or is too much.

        Where looks are judged, labels that are wrong alone have to be more than expected, too.
        """
        state, best = self._current, self.best()
        if best is None:
            return False
        if state.noise.wrong > MOST_WRONG:
            return True
        if best.judges and state.noise.alone <= EXPECTED_ALONE:
            return False
        return best.log_odds_of_mistakes(self._task(self.learner.trials, state.noise)) > 0

    def log_gain_over_chance(self) -> FloatArray:
        """Return ln p(trial | a fresh object, the best chain) / p(labels drawn uniformly) of each trial, shape [N]."""
        state, best = self._current, self.best()
        if best is None:
            return np.zeros(0)
        return best.fresh_log_evidence(self._task(self.learner.trials, state.noise))

    @property
    def _current(self) -> _State:
        """What is learned from all trials; those that came in a file without it are sampled all at once."""
        trials, owners, state = self.learner.trials, self.learner.owners, self._awake()
        if state.n_trials != len(trials):
            self._adopt(self._sampled(state, trials, owners[:-1])[0])
        return self._state

    def _sampled(self, state: _State, trials: Sequence[RawTrial], owners: Sequence[str]) -> tuple[_State, Verdict]:
        """Return what is learned from trials, the last of which have no owner yet, and the verdict on the last one."""
        names = tuple(dict.fromkeys(owners))
        numbers = np.append(self._numbers(owners, names), np.full(len(trials) - len(owners), -1))
        rng = np.random.default_rng((self.seed, len(trials)))
        population = copy.deepcopy(state.population) or self._population()
        task = self._task(trials, state.noise)
        conclusion = population.advance(task, numbers, rng)
        noise = population.tally(task, conclusion.weights, state.noise)
        log_evidence = population.log_evidence(task) - self._log_scale(task)
        partition = self._partition(conclusion, numbers)
        learned = _State(population, noise, conclusion.weights, len(trials), log_evidence, partition)
        return learned, Verdict(names, conclusion.probabilities)

    @staticmethod
    def _partition(conclusion: Conclusion, numbers: IntArray) -> IntArray:
        """Return which object each trial is of, the last one as the verdict has it; that is of one with a name."""
        from atg_fg.learning.partition_estimate import estimated_partition

        before = numbers.copy()
        new = np.flatnonzero(before < 0)
        before[new] = np.setdiff1d(np.arange(len(numbers)), before)[: len(new)]
        partition = estimated_partition(conclusion.partitions, conclusion.shares, before)
        if len(partition) > 1:
            is_new = conclusion.probabilities[-1] > NOVEL
            same = partition[int(conclusion.together.argmax())]
            partition[-1] = np.setdiff1d(np.arange(len(numbers)), partition[:-1])[0] if is_new else same
        return partition

    def _population(self) -> Population:
        from atg_fg.learning.automaton_populations import AutomatonPopulation, RivalPopulations
        from atg_fg.learning.populations import RegisterPopulation

        alphabet, n_actions = self.assumptions.alphabet, len(self.assumptions.actions)
        n_slots = len(alphabet.slots)
        if n_slots == 1 and not alphabet.exclusive:
            sizes = (self.assumptions.n_aspects, n_slots, n_actions, alphabet.n_symbols)
            return RivalPopulations(
                (AutomatonPopulation(*sizes), 0.0),
                (AutomatonPopulation(*sizes, may_own=True), LOG_PRIOR_OF_OTHERS),
                (RegisterPopulation(n_slots, n_actions, alphabet.n_symbols), LOG_PRIOR_OF_OTHERS),
            )
        return RegisterPopulation(n_slots, n_actions, alphabet.n_symbols)

    def _task(self, trials: Sequence[RawTrial], noise: DetectorNoise) -> Task:
        from atg_fg.learning.sampling_task import Task

        recording = Recording.of(trials, self.assumptions.alphabet.n_symbols, self.assumptions.object_senses)
        return Task.of(recording, noise, self.assumptions.n_objects)

    def _log_scale(self, task: Task) -> float:
        """Return ln of the factor that the likelihoods of all labels have been scaled by."""
        return float(np.count_nonzero(task.recording.labels >= 0) * np.log(task.recording.n_symbols))

    @staticmethod
    def _numbers(owners: Sequence[str], names: Sequence[str]) -> IntArray:
        number = {name: index for index, name in enumerate(names)}
        return np.array([number.get(owner, -1) for owner in owners], dtype=np.int64)


def _believed(chain: Chain, weight: float, task: Task, numbers: IntArray, n_names: int) -> Iterator[BelievedChain]:
    """Yield what a chain says of the objects of each of its automata, the shared one first.

    Of a name that several clusters have, the largest counts. A new object is taken for one that shares.
    """
    chain.log_joint(task)  # its tables are made anew, with the noise in force
    clusters = chain.clusters
    names = chain.objects(numbers, task)
    largest: dict[int, int] = {}
    for cluster in np.flatnonzero(names >= 0).tolist():
        rival = largest.setdefault(int(names[cluster]), cluster)
        if clusters.n_trials[cluster] > clusters.n_trials[rival]:
            largest[int(names[cluster])] = cluster
    n_objects = int(np.count_nonzero(clusters.n_trials))
    log_new = float(task.log_new[n_objects])
    total = np.logaddexp(np.log(max(len(largest), 1e-300)), log_new)
    for automaton in (0, *chain.own_automata):
        tables = np.broadcast_to(clusters.prior, (n_names + 1, *clusters.tables.shape[1:])).copy()
        log_prior = np.full(n_names + 1, -np.inf)
        if automaton == 0:
            log_prior[-1] = log_new - total
        for name, cluster in largest.items():
            if clusters.automaton[cluster] == automaton:
                tables[name], log_prior[name] = clusters.tables[cluster], -total
        if np.isfinite(log_prior).any():
            successors = clusters.successors[automaton, :-1]
            yield BelievedChain(weight, successors, clusters.registers, tables, log_prior, chain.slip)
