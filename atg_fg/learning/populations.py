"""Populations of chains: several, for one chain gets stuck. Their weighted average is what is believed.

All objects share one structure: an automaton, whose transitions move with all else, or register maps, which a search
on the exact evidence proposes and of which each chain holds one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.errors import TooLargeError
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.learning import kernels
from atg_fg.learning.chain import Chain
from atg_fg.learning.detector_noise import EXPECTED_ALONE, DetectorNoise
from atg_fg.learning.milestones import is_milestone
from atg_fg.learning.raw_trials import Recording
from atg_fg.learning.register_search import search_registers
from atg_fg.learning.sampling_task import Structure, Task
from atg_fg.learning.saved_chain import SavedChain
from atg_fg.learning.shared_structure import SharedStructure

#: A chain this many nats behind the best is given up.
HOPELESS: Final = 15.0
#: Register maps believed in at once, how many nats the others may be behind the best, and their sweeps a trial.
MAX_MAPS: Final = 4
MAPS_WITHIN: Final = 12.0
MAP_SWEEPS: Final = 5
#: Trials from which on a map that is left alone is settled.
SETTLED_TRIALS: Final = 3


class Conclusion(NamedTuple):
    """What a population makes of the last trial.

    Attributes:
        probabilities: p(the trial is of the object of each name | all trials), *new* last, shape [names + 1].
        weights: Of the chains, in their order; they sum to one.
        together: p(the trial is of one object with each earlier one | all trials), shape [N − 1].
        partitions: Object of each trial in samples, each of which has numbers of its own, shape [M, N].
        shares: Weights of these samples; they sum to one, shape [M].
        log_predictive: ln p(the trial | all others) before it was taken in, up to the scale of its looks.
    """

    probabilities: FloatArray
    weights: FloatArray
    together: FloatArray
    partitions: IntArray
    shares: FloatArray
    log_predictive: float = 0.0


class Samples:
    """What one chain says in those of its sweeps that count.

    Args:
        chain: Whose sweeps they are.
        names: Number of the name of each trial, −1 of the last one, shape [N].
        task: What the chain is given.
    """

    def __init__(self, chain: Chain, names: IntArray, task: Task) -> None:
        self._chain, self._names, self._task = chain, names, task
        self.by_name, self.together = np.zeros(int(names.max(initial=-1)) + 2), np.zeros(len(names) - 1)
        self.partitions: list[IntArray] = []
        self._scores: list[float] = []

    def add(self, votes: FloatArray) -> None:
        """Take note of the chain as it is now.

        Args:
            votes: p(cluster | all other trials) of the last trial, *new* last, shape [C + 1].
        """
        owner = self._chain.clusters.owner
        self.by_name += votes_by_name(self._chain, votes, self._names, self._task)
        self.together += votes[:-1][owner[:-1]]
        self.partitions.append(owner.copy())
        self._scores.append(self._chain.log_joint(self._task))

    @property
    def score(self) -> float:
        """Mean of ln of the joint probability."""
        return float(np.mean(self._scores))


class Population(ABC):
    """Chains that take in trial after trial.

    Attributes:
        chains: What is believed.
    """

    def __init__(self) -> None:
        self.chains: list[Chain] = []

    @abstractmethod
    def advance(self, task: Task, names: IntArray, rng: np.random.Generator) -> Conclusion:
        """Take in the last trial of a task.

        Args:
            task: All trials; the population knows all but the last one.
            names: Number of the name of each trial, −1 of the last one, shape [N].
            rng: Draws.
        """

    def give_up(self) -> None:
        """Believe nothing any more."""
        self.chains = []

    @abstractmethod
    def log_evidence(self, task: Task) -> float:
        """Return ln p(all trials, each of a fresh object) + ln p(structure) of the best structure."""

    @abstractmethod
    def saved(self, recording: Recording) -> list[SavedChain]:
        """Return the chains as they are kept; the recording is of the trials that they know."""

    @abstractmethod
    def restore(self, saved: Sequence[SavedChain], task: Task) -> None:
        """Have the chains that were kept, of the trials of a task."""

    def tally(self, task: Task, weights: FloatArray, noise: DetectorNoise) -> DetectorNoise:
        """Return the noise that the chains estimate."""
        recording = task.recording
        right = np.zeros(recording.labels.shape)
        truth = np.zeros((recording.n_symbols, recording.n_symbols))
        sound = np.ones(recording.labels.shape)
        for chain, weight in zip(self.chains, weights.tolist(), strict=True):
            if weight > 0.01:
                share = weight / weights[weights > 0.01].sum()
                chain.tally(task, share, right, truth)
                sound -= share * chain.wrong[..., None]
        judged = sound if any(chain.judges for chain in self.chains) else None
        return noise.learned(recording.labels, recording.confidences, right, truth, judged)

    def _conclude(self, samples: Sequence[Samples], temperature: float) -> Conclusion:
        for chain, each in zip(self.chains, samples, strict=True):
            chain.score = each.score
        scores = np.array([chain.score for chain in self.chains])
        weights = np.exp((scores - scores.max()) / temperature)
        weights /= weights.sum()
        n_samples = len(samples[0].partitions)
        return Conclusion(
            weights @ np.array([each.by_name / n_samples for each in samples]),
            weights,
            weights @ np.array([each.together / n_samples for each in samples]),
            np.concatenate([each.partitions for each in samples]),
            np.repeat(weights / n_samples, n_samples),
        )


def log_mean(logarithms: Sequence[float]) -> float:
    """Return ln of the mean of numbers whose logarithms these are, 0 if there are none."""
    return float(np.logaddexp.reduce(logarithms) - np.log(len(logarithms))) if logarithms else 0.0


def votes_by_name(chain: Chain, votes: FloatArray, names: IntArray, task: Task) -> FloatArray:
    """Return votes for clusters as votes for names, *new* last; a cluster has the name that most of its looks have."""
    objects = chain.objects(names, task)
    result = np.zeros(int(names.max(initial=-1)) + 2)
    there = objects >= 0
    np.add.at(result, objects[there], votes[:-1][there])
    result[-1] = votes[-1]
    return result


class RegisterPopulation(Population):
    """Chains of register maps, one for each map that is believed in.

    Args:
        n_slots: J.
        n_actions: A.
        n_symbols: V.
    """

    def __init__(self, n_slots: int, n_actions: int, n_symbols: int) -> None:
        super().__init__()
        self._n_slots, self._n_actions, self._n_symbols = n_slots, n_actions, n_symbols
        self.maps: list[SharedStructure] = []

    def advance(self, task: Task, names: IntArray, rng: np.random.Generator) -> Conclusion:
        """Take in the last trial of a task; at milestones, and after a rest, search for other maps."""
        predictive, known = [], 0
        for chain in self.chains:
            known = len(chain.clusters.owner)
            chain.admit(task)
            if known == len(names) - 1:
                predictive.append(chain.log_predictive(task))
            chain.place(task, np.arange(known, len(names)), rng)
        if is_milestone(len(names)) or known < len(names) - 1:
            self._search(task, rng)
        samples: list[Samples] = []
        for chain in self.chains:
            if not len(chain.clusters.owner):
                chain.admit(task)
                chain.place(task, np.arange(len(names)), rng)
            samples.append(Samples(chain, names, task))
            for sweep in range(MAP_SWEEPS):
                votes = chain.slip_sweep(task, rng, thorough=sweep % 2 == 1)
                if sweep >= MAP_SWEEPS // 2:
                    samples[-1].add(votes)
                if sweep + 1 < MAP_SWEEPS:
                    chain.sweep(task, rng)
        conclusion = self._conclude(samples, 1.0)
        best = max(chain.score for chain in self.chains)
        kept = [number for number, chain in enumerate(self.chains) if chain.score > best - HOPELESS]
        self.chains, self.maps = [self.chains[number] for number in kept], [self.maps[number] for number in kept]
        weights = conclusion.weights[kept]
        return conclusion._replace(weights=weights / weights.sum(), log_predictive=log_mean(predictive))

    def give_up(self) -> None:
        """Believe nothing any more."""
        self.chains, self.maps = [], []

    def log_evidence(self, task: Task) -> float:
        """Return ln p(all trials, each of a fresh object) + ln p(maps) of the best maps."""
        best = max(self.chains, key=lambda chain: chain.score)
        return float(best.fresh_log_evidence(task).sum()) + best.log_prior

    def saved(self, recording: Recording) -> list[SavedChain]:
        """Return the chains as they are kept."""
        return [chain.saved(maps, recording) for chain, maps in zip(self.chains, self.maps, strict=True)]

    def restore(self, saved: Sequence[SavedChain], task: Task) -> None:
        """Have the chains that were kept."""
        self.maps, self.chains = [], []
        for each in saved:
            if each.maps is not None:
                self.maps.append(each.maps)
                self.chains.append(self._chain(compiled_maps(each.maps), each.maps.log_prior))
                self.chains[-1].restore(each, task)

    def _chain(self, structure: Structure, log_prior: float) -> Chain:
        # With one slot it is all the same whether a label or its look is wrong.
        return Chain(structure, log_prior, self._n_symbols, judges=self._n_slots > 1)

    def _total(self, task: Task, structure: Structure, log_prior: float) -> float:
        recording = task.recording
        trials = kernels.TrialArrays(task.looks, recording.actions, recording.lengths)
        prior = np.full(self._n_symbols, 1.0 / self._n_symbols)
        fresh = kernels.fresh_log_evidence(
            trials, structure.successors, structure.registers, structure.n_registers, prior
        )
        return float(fresh.sum()) + log_prior

    def _search(self, task: Task, rng: np.random.Generator) -> None:
        """Have a chain for each of the best maps, of those at hand and those that a search proposes."""
        n_trials = len(task.recording.lengths)
        is_settled = n_trials > SETTLED_TRIALS and len(self.chains) == 1
        if is_settled and n_trials.bit_count() > 1 and task.alone <= EXPECTED_ALONE:
            return  # looks err as a whole: that is the detector's doing, not the maps'
        trials = kernels.TrialArrays(task.looks, task.recording.actions, task.recording.lengths)
        nothing_else = np.full(n_trials, -np.inf)
        found = search_registers(trials, nothing_else, self._n_slots, self._n_actions, 1 if is_settled else 2, rng)
        scored: list[tuple[float, SharedStructure, Structure]] = []
        for each in dict.fromkeys((*self.maps, *found)):
            try:
                structure = compiled_maps(each)
            except TooLargeError:
                continue  # more poses than a structure may have
            scored.append((self._total(task, structure, each.log_prior), each, structure))
        scored.sort(key=lambda entry: -entry[0])
        at_hand = dict(zip(self.maps, self.chains, strict=True))
        self.maps, self.chains = [], []
        for score, each, structure in scored[:MAX_MAPS]:
            if score > scored[0][0] - MAPS_WITHIN:
                self.maps.append(each)
                self.chains.append(at_hand.get(each) or self._chain(structure, each.log_prior))


def compiled_maps(maps: SharedStructure) -> Structure:
    """Return register maps in the form that all structures compile to: their poses are the states.

    Raises:
        TooLargeError: There are more poses than a structure may have.
    """
    poses = maps.poses()
    # All loops are compiled anew for arrays that are read-only, or laid out otherwise: these are copies, always alike.
    successors = np.array(poses.successors.T, order="C")
    return Structure(successors, np.array(poses.registers[:, : maps.n_slots], order="C"), maps.n_registers)
