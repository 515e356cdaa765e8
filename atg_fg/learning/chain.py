"""One chain of Gibbs sampling over which trials are of one object, where each began, and where actions slipped."""

from __future__ import annotations

import copy
from typing import Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.log_math import log_sum_exp
from atg_fg.core.patterns import MISSING, FloatArray, IntArray
from atg_fg.learning import (
    gibbs_kernels,
    kernels,
    look_kernels,
    object_kernels,
    slip_kernels,
    transition_kernels,
    weight_kernels,
)
from atg_fg.learning.kernels import Clusters, TrialArrays
from atg_fg.learning.raw_trials import Recording
from atg_fg.learning.sampling_task import Structure, Task
from atg_fg.learning.saved_chain import SavedChain
from atg_fg.learning.shared_structure import SharedStructure

#: Beta prior of a slip.
SLIP_PRIOR: Final = (1.0, 99.0)
#: Beta prior of a look that is wrong in all slots at once: most detectors never do that.
ERROR_PRIOR: Final = (0.1, 4.9)
#: Probability that two wrong labels of a register are the same if the structure is not the right one.
RECURRING: Final = 0.4
#: With more trials than this, a sweep moves only those of objects that the new one may be of, and some others.
ALL_TRIALS: Final = 200
OTHER_TRIALS: Final = 50
TOUCHED: Final = 1e-3
#: Trials, drawn at random, whose slips are toggled in one sweep.
TOGGLED_TRIALS: Final = 40


class Chain:
    """A state of the sampler, and its moves.

    Args:
        structure: Shared by all objects, or what they begin with.
        log_prior: ln of its prior.
        n_symbols: V.
        may_own: Whether objects may have automata of their own.
        judges: Whether looks may be wrong in all slots at once, and each is judged.

    Attributes:
        slip: ε, the probability that an action fails.
        error: Probability that a look is wrong in all slots at once.
        wrong: Which looks are, shape [N, T].
        score: ln of the joint probability of all that it believes and saw, averaged over its last sweeps.
    """

    def __init__(
        self, structure: Structure, log_prior: float, n_symbols: int, *, may_own: bool = False, judges: bool = False
    ) -> None:
        self.may_own, self.judges = may_own, judges
        self.error = ERROR_PRIOR[0] / sum(ERROR_PRIOR)
        self.wrong: NDArray[np.bool_] = np.zeros((0, 0), dtype=np.bool_)
        n_states = len(structure.registers)
        stay = np.arange(n_states)[None]
        self.structure, self.log_prior = structure, log_prior
        self.clusters = Clusters(
            np.ascontiguousarray(np.concatenate((structure.successors, stay))[None]),
            np.ascontiguousarray(structure.registers),
            np.zeros(0, dtype=np.int64),
            np.zeros((0, structure.n_registers, n_symbols)),
            np.zeros(0, dtype=np.int64),
            np.zeros(0, dtype=np.int64),
            np.zeros(0, dtype=np.int64),
            np.full(n_symbols, 1.0 / n_symbols),
        )
        self.actions: IntArray = np.zeros((0, 0), dtype=np.int64)
        self.slip = SLIP_PRIOR[0] / sum(SLIP_PRIOR)
        self.score = -np.inf
        self._touched: IntArray = np.zeros(0, dtype=np.int64)

    def copy(self) -> Chain:
        """Return a chain that goes on alone from here."""
        return copy.deepcopy(self)

    def saved(self, maps: SharedStructure | None, recording: Recording) -> SavedChain:
        """Return the chain as it is kept.

        Args:
            maps: That it follows, if it has no automaton of its own.
            recording: The trials that it knows.
        """
        stay, there = self.clusters.successors.shape[1] - 1, np.arange(self.actions.shape[1])
        slips = np.argwhere((self.actions == stay) & (there < recording.lengths[:, None] - 1))
        return SavedChain(
            maps,
            () if maps is not None else tuple(map(tuple, self.successors.tolist())),
            tuple(
                (number - 1, tuple(map(tuple, self.clusters.successors[number, :-1].tolist())))
                for number in self.own_automata
            ),
            tuple(self.clusters.owner.tolist()),
            tuple(self.clusters.start.tolist()),
            tuple((int(trial), int(time)) for trial, time in slips),
            self.slip,
            self.score,
            wrong=tuple((int(trial), int(look)) for trial, look in np.argwhere(self.wrong)),
            error=self.error,
        )

    def restore(self, saved: SavedChain, task: Task) -> None:
        """Become the chain that was kept, of the trials of a task."""
        self.admit(task)
        self.clusters.owner[:], self.clusters.start[:] = saved.owner, saved.start
        self.clusters.n_trials[:] = np.bincount(saved.owner, minlength=len(self.clusters.n_trials))
        for cluster, successors in saved.own:
            self.clusters.automaton[cluster] = 1 + cluster
            self.clusters.successors[1 + cluster, :-1] = successors
        for trial, time in saved.slips:
            self.actions[trial, time] = self.clusters.successors.shape[1] - 1
        for trial, look in saved.wrong:
            self.wrong[trial, look] = True
        self.slip, self.score, self.error = saved.slip, saved.score, saved.error

    @property
    def n_states(self) -> int:
        """S."""
        return len(self.clusters.registers)

    @property
    def successors(self) -> IntArray:
        """Of the shared automaton, shape [A, S]."""
        return self.clusters.successors[0, :-1]

    def admit(self, task: Task) -> None:
        """Make room for trials that the chain does not know yet; they are of no object so far."""
        recording, clusters = task.recording, self.clusters
        n_trials, n_known = len(recording.lengths), len(clusters.owner)
        new = n_trials - n_known
        grown = n_trials + 2 - len(clusters.n_trials)
        tables = np.broadcast_to(clusters.prior, (grown, *clusters.tables.shape[1:]))
        successors = clusters.successors
        if self.may_own:  # room for one of each cluster, after the shared one
            more = np.repeat(successors[:1], n_trials + 3 - len(successors), axis=0)
            successors = np.concatenate((successors, more))
        self.clusters = clusters._replace(
            successors=successors,
            automaton=np.append(clusters.automaton, np.zeros(grown, dtype=np.int64)),
            tables=np.concatenate((clusters.tables, tables)),
            n_trials=np.append(clusters.n_trials, np.zeros(grown, dtype=np.int64)),
            owner=np.append(clusters.owner, np.full(new, -1)),
            start=np.append(clusters.start, np.zeros(new, dtype=np.int64)),
        )
        actions = recording.actions.copy()
        actions[:n_known, : self.actions.shape[1]] = self.actions
        self.actions = actions
        wrong = np.zeros(actions.shape, dtype=np.bool_)
        wrong[:n_known, : self.wrong.shape[1]] = self.wrong
        self.wrong = wrong

    def trials(self, task: Task) -> TrialArrays:
        """Return the trials as this chain takes them to have gone."""
        looks = np.where(self.wrong[..., None, None], 1.0, task.right_looks) if self.judges else task.looks
        return TrialArrays(looks, self.actions, task.recording.lengths, task.recording.felt)

    def _each_slot(self, task: Task) -> TrialArrays:
        return TrialArrays(task.looks, self.actions, task.recording.lengths, task.recording.felt)

    def scatter(self, rng: np.random.Generator) -> None:
        """Take each trial for one of an object of its own, with a start drawn at random."""
        n_trials = len(self.clusters.owner)
        self.clusters.owner[:] = np.arange(n_trials)
        self.clusters.n_trials[:] = 0
        self.clusters.n_trials[:n_trials] = 1
        self.clusters.start[:] = rng.integers(self.n_states, size=n_trials)

    def anneal(self, task: Task, hottest: float, n_sweeps: int, rng: np.random.Generator) -> None:
        """Forget which trials are of one object, and cool down from there with all else, successors too.

        With more trials than ``ALL_TRIALS`` that is done with the newest; the others are placed in the end.
        """
        self.scatter(rng)
        newest = np.arange(max(len(self.clusters.owner) - ALL_TRIALS, 0), len(self.clusters.owner))
        self.clusters.owner[: newest[0]] = -1
        self.clusters.n_trials[: newest[0]] = 0
        self._learn_again(task)
        for beta in np.geomspace(hottest, 1.0, n_sweeps).tolist():
            self._move_successors(task, beta, rng)
            self._moved(task, np.append(rng.permutation(newest[:-1]), newest[-1]), beta, rng)
        if newest[0]:
            self.place(task, np.arange(newest[0]), rng)

    def place(self, task: Task, numbers: IntArray, rng: np.random.Generator) -> None:
        """Draw object and start of trials that are of no object yet, one after the other."""
        self._learn_again(task)
        votes = self._moved(task, numbers, 1.0, rng)
        # Which objects the last one touches is settled here for all sweeps, so that each of these leaves the
        # distribution of what it moves as it was.
        objects = np.flatnonzero(votes[:-1] > TOUCHED)
        self._touched = np.flatnonzero(np.isin(self.clusters.owner[:-1], objects))

    def sweep(self, task: Task, rng: np.random.Generator, beta: float = 1.0, *, automaton: bool = False) -> FloatArray:
        """Move trials once, the last one at the end: all of them, or those that ``ALL_TRIALS`` leaves.

        Returns p(cluster | all other trials) of the last one, *new* last, shape [C + 1].

        Args:
            task: What there is to explain.
            rng: Draws.
            beta: Inverse temperature.
            automaton: Whether the successors move too.
        """
        if automaton:
            self._move_successors(task, beta, rng)
        return self._moved(task, self._order(rng), beta, rng)

    def _move_successors(self, task: Task, beta: float, rng: np.random.Generator) -> None:
        # An entry costs as much as there are trials: where there are many, some are moved in each sweep.
        n_entries = max(self.successors.size * ALL_TRIALS // max(len(self.clusters.owner), ALL_TRIALS), 1)
        for number in (0, *self.own_automata):
            transition_kernels.transition_moves(self.trials(task), self.clusters, number, n_entries, beta, rng)

    def _moved(self, task: Task, order: IntArray, beta: float, rng: np.random.Generator) -> FloatArray:
        votes = np.zeros(len(self.clusters.n_trials) + 1)
        if self.judges:
            looks, each_slot = task.right_looks, self._each_slot(task)
            given = order, self.clusters, task.log_new, self.error, self.wrong, rng, votes
            look_kernels.judged_sweep(self.trials(task), looks, each_slot, *given)
            self._estimate_error(task)
        else:
            log_own = self._log_own(task)
            gibbs_kernels.sweep(self.trials(task), order, self.clusters, task.log_new, log_own, beta, rng, votes)
        return votes

    def slip_sweep(self, task: Task, rng: np.random.Generator, *, thorough: bool) -> FloatArray:
        """Move slips, and the last trial by forward filtering; return its p(cluster | all others), *new* last.

        Args:
            task: What there is to explain.
            rng: Draws.
            thorough: Whether trials other than the last one move.
        """
        trials, done = self.trials(task), task.recording.actions
        log_odds = float(np.log(self.slip) - np.log1p(-self.slip))
        order = self._order(rng)
        if thorough:
            for trial in order[:-1][:TOGGLED_TRIALS].tolist():
                slip_kernels.slip_moves(trials, trial, self.clusters, done[trial], log_odds, task.log_new, rng)
        votes = np.zeros(len(self.clusters.n_trials) + 1)
        last = int(order[-1])
        given = last, self.clusters, done[last], log_odds, task.log_new
        if self.judges:
            looks, each_slot = task.right_looks, self._each_slot(task)
            look_kernels.judged_path_move(trials, looks, each_slot, *given, self.error, self.wrong, rng, votes)
        else:
            slip_kernels.path_move(trials, *given, rng, votes)
        self._estimate_slip(task)
        return votes

    def log_joint(self, task: Task) -> float:
        """Return ln p(partition, starts, slips, all looks | structure) + ln p(structure), up to a constant."""
        n_trials, n_objects = len(self.clusters.owner), int(np.count_nonzero(self.clusters.n_trials))
        total = self.log_prior + self._learn_again(task) + float(task.log_partition[n_objects])
        total += object_kernels.log_felt(self.trials(task), self.clusters)
        # The first trial of an object may begin anywhere: it only gives its states their names.
        total -= (n_trials - n_objects) * float(np.log(self.n_states))
        for automaton in self.own_automata:
            used = gibbs_kernels.entries_used(self.trials(task), self.clusters, automaton)
            total -= used * float(np.log(self.n_states))
        if self.judges:
            n_wrong, n_looks = int(np.count_nonzero(self.wrong)), int(task.recording.lengths.sum())
            total += n_wrong * float(np.log(self.error)) + (n_looks - n_wrong) * float(np.log1p(-self.error))
        n_slips, n_actions = self._slips(task)
        return total + n_slips * float(np.log(self.slip)) + (n_actions - n_slips) * float(np.log1p(-self.slip))

    def objects(self, names: IntArray, task: Task) -> IntArray:
        """Return the name that most looks of each cluster have, −1 of a cluster without, shape [C].

        Args:
            names: Number of the name of each trial, −1 of one without, shape [N].
            task: For the numbers of looks.
        """
        named = (names >= 0) & (self.clusters.owner >= 0)
        n_names = int(names.max(initial=-1)) + 1
        result = np.full(len(self.clusters.n_trials), -1)
        if n_names:
            looks = np.zeros((len(result), n_names))
            np.add.at(looks, (self.clusters.owner[named], names[named]), task.recording.lengths[named])
            result = np.where(looks.any(axis=1), looks.argmax(axis=1), -1)
        return result

    def log_odds_of_mistakes(self, task: Task) -> float:
        """Return ln of the Bayes factor that what is taken for wrong labels is a mistake of the structure instead.

        Accidents of one register seldom show the same wrong label twice in a trial, with probability 1 / (V − 1); where
        the structure is not the right one, the same label comes again whenever the object is turned the same way.
        Looks that are wrong in all slots are the detector's, whatever they show.
        """
        self._learn_again(task)
        labels = np.where(self.wrong[..., None], MISSING, task.recording.labels)
        pairs, same = kernels.recurrences(self.trials(task), self.clusters, labels)
        by_accident = 1.0 / max(task.recording.n_symbols - 1, 2)
        again, other = np.log(RECURRING / by_accident), np.log((1.0 - RECURRING) / (1.0 - by_accident))
        return float(same * again + (pairs - same) * other)

    def fresh_log_evidence(self, task: Task) -> FloatArray:
        """Return ln p(trial | a fresh object that shares), up to the scale of its looks, shape [N]."""
        clusters, recording = self.clusters, task.recording
        trials = TrialArrays(task.looks, recording.actions, recording.lengths)
        n_registers = clusters.tables.shape[1]
        result: FloatArray = kernels.fresh_log_evidence(
            trials, clusters.successors[0], clusters.registers, n_registers, clusters.prior
        )
        return result

    def tally(self, task: Task, weight: float, right: FloatArray, truth: FloatArray) -> None:
        """Add weight · p(label is right), and of symbol and label, to what is counted over all chains."""
        labels = task.recording.labels
        kernels.right_probabilities(self.trials(task), self.clusters, labels, weight, right, truth)

    @property
    def own_automata(self) -> list[int]:
        """Those that objects have of their own; the one of cluster k is 1 + k."""
        there = (self.clusters.n_trials > 0) & (self.clusters.automaton > 0)
        return list(self.clusters.automaton[there].tolist())

    def log_predictive(self, task: Task) -> float:
        """Return ln p(the last trial | all others), up to the scale of its looks, while it is of no object yet."""
        self._learn_again(task)
        trials, last = self.trials(task), len(self.clusters.owner) - 1
        path = np.zeros(task.looks.shape[1], dtype=np.int64)
        free, n_objects = gibbs_kernels.take_out(trials, last, self.clusters, path)
        weights = np.full((len(self.clusters.n_trials), self.n_states), -np.inf)
        log_new, log_own = float(task.log_new[n_objects]), self._log_own(task)
        prior = object_kernels.cluster_weights(trials, last, self.clusters, free, log_new)
        weight_kernels.trial_weights(trials, last, self.clusters, free, prior, weights)
        total = log_sum_exp(weights.ravel()) - np.log(self.n_states)
        if len(log_own):
            share = gibbs_kernels.sharing(self.clusters)
            weights[free] += np.log(share)
            total = log_sum_exp(weights.ravel()) - np.log(self.n_states)
            total = np.logaddexp(total, log_new + np.log(1.0 - share) + log_own[last])
        return float(total - np.logaddexp(np.log(max(n_objects, 1e-300)), log_new))

    def _log_own(self, task: Task) -> FloatArray:
        return task.log_own if self.may_own else np.zeros(0)

    def _learn_again(self, task: Task) -> float:
        path = np.zeros(task.looks.shape[1], dtype=np.int64)
        return float(kernels.learn_all_again(self.trials(task), self.clusters, -1, path))

    def _order(self, rng: np.random.Generator) -> IntArray:
        last = len(self.clusters.owner) - 1
        moving = np.arange(last)
        if last > ALL_TRIALS:
            touched = rng.permutation(self._touched)[: ALL_TRIALS - OTHER_TRIALS]
            others = np.setdiff1d(moving, touched)
            moving = np.append(touched, rng.choice(others, OTHER_TRIALS, replace=False))
        order: IntArray = np.append(rng.permutation(moving), last)
        return order

    def _slips(self, task: Task) -> tuple[int, int]:
        there = np.arange(self.actions.shape[1]) < task.recording.lengths[:, None] - 1
        stay = self.clusters.successors.shape[1] - 1
        return int(np.count_nonzero((self.actions == stay) & there)), int(np.count_nonzero(there))

    def _estimate_error(self, task: Task) -> None:
        n_wrong, n_looks = int(np.count_nonzero(self.wrong)), int(task.recording.lengths.sum())
        self.error = (n_wrong + ERROR_PRIOR[0]) / (n_looks + sum(ERROR_PRIOR))

    def _estimate_slip(self, task: Task) -> None:
        n_slips, n_actions = self._slips(task)
        self.slip = (n_slips + SLIP_PRIOR[0]) / (n_actions + sum(SLIP_PRIOR))
