"""A Bayes filter over pose and contents of objects that follow a known structure, many objects side by side.

What is believed of an object is a set of rows: a pose, its probability, and a soft table of contents given that pose.
A look weighs the rows and reveals registers; an action turns each pose, and leaves a second row behind for a slip. Rows
of one object that come to the same pose become one, whose table has their mean. That is the approximation: the rest of
what they knew, how registers depend on each other and on the way the pose was reached, is given up. The rows of a known
object all have one table, and of a new one that never slips no two that began alike are in one pose: both are filtered
exactly, but that rows that become one also have the mean of how probably each action failed when it was last done.
"""

from __future__ import annotations

import copy
from functools import cached_property
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.actions import AnyAction, UncertainAction
from atg_fg.core.patterns import FloatArray, IntArray, PatternAlphabet
from atg_fg.learning.rates import REPEAT, REVEAL, WRONG, Rates
from atg_fg.learning.register_contents import (
    SAME,
    TINY,
    distinctness,
    pattern_products,
    reweigh,
    unrevealed,
)
from atg_fg.learning.shared_structure import Poses, poses_in_view


class Rows(NamedTuple):
    """What is believed, a row for each owner, start and pose that is not negligible, in this order.

    Attributes:
        owner: The object, or trial, that a row is about, shape [R].
        start: Which class of poses a new object was in at first, shape [R]; 0 for known ones. What is lost in one pose
            may be known in the other, so that rows which began apart are kept apart.
        pose: Shape [R].
        weight: p(start, pose | owner, what was seen), shape [R].
        table: Index of the row's table of contents, shape [R]; rows that know the same share one.
        events: Expected numbers so far, and of each action how probably it failed when it was last done, columns as
            ``atg_fg.learning.rates`` has them, shape [R, FAILED + A]; what rivals for one trial reveal does not count.
    """

    owner: IntArray
    start: IntArray
    pose: IntArray
    weight: FloatArray
    table: IntArray
    events: FloatArray

    def take(self, index: IntArray) -> Rows:
        """Return the rows with these indices."""
        return Rows._make(column[index] for column in self)


class PoseFilter:
    """Filters the pose of H owners: objects that one trial may be about, or trials that each have their own object.

    Args:
        poses: Of the structure.
        contents: What is known of each owner's registers, shape [H, P, S]; all zero for a new object.
        rates: Slip, wrong looks and repeated symbols.
        alphabet: The patterns.
        log_weights: ln of the weight of each owner, shape [H], if they are rivals for one trial, so that rows which
            are negligible beside those of other owners are dropped. Without, each owner is a trial of its own.

    Attributes:
        log_evidence: ln p(what was seen | owner), shape [H].
    """

    def __init__(
        self,
        poses: Poses,
        contents: FloatArray,
        rates: Rates,
        alphabet: PatternAlphabet,
        log_weights: FloatArray | None = None,
    ) -> None:
        self._rates, self._alphabet = rates, alphabet
        self.log_weights = np.zeros(0) if log_weights is None else log_weights
        self._poses = structure = poses_in_view(poses, len(alphabet.slots))
        from atg_fg.learning import row_kernels  # they load Numba

        n_poses, n_actions = structure.successors.shape
        classes = structure.first, structure.first_weights
        rows, self._shown = row_kernels.first_rows(contents, n_poses, *classes, n_actions, rates.repeat)
        self.rows = Rows(*rows)
        self._contents = contents
        self.log_evidence = np.zeros(len(contents))

    def copy(self) -> PoseFilter:
        """Return a filter that goes on alone from here."""
        twin = copy.copy(self)
        # All else is replaced at each step rather than changed.
        twin.log_evidence = self.log_evidence.copy()
        return twin

    def act(self, action: AnyAction) -> None:
        """Take in an action."""
        if isinstance(action, UncertainAction):
            self._act_uncertainly(action)
            return
        self.act_apart(np.full(len(self.log_evidence), action))

    def _act_uncertainly(self, action: UncertainAction) -> None:
        """Take in each action that may have been done, and that nothing happened, as far as they are probable."""
        before, rows = self.rows, []
        if action.stays > 0:
            rows.append(before._replace(weight=before.weight * action.stays))
        for index, chance in action.chances:
            self.rows = before._replace(weight=before.weight * chance)
            self.act(index)
            rows.append(self.rows)
        self.rows = Rows(*(np.concatenate(columns) for columns in zip(*rows, strict=True)))

    def act_apart(self, actions: IntArray) -> None:
        """Take in an action of each owner, shape [H]."""
        self.rows = Rows(*self._kernels.act(tuple(self.rows), self._poses.successors, actions, self._rates.slips))

    def observe_pattern(self, symbols: IntArray) -> None:
        """Take in looks that showed every slot, shape [J], or [H, J] for a look of each owner."""
        n_owners = len(self.log_evidence)
        seen = np.empty((1, n_owners, symbols.shape[-1]), dtype=np.int64)
        seen[:] = symbols
        self.follow(np.zeros((0, n_owners), dtype=np.int64), seen)

    def follow(self, actions: IntArray, symbols: IntArray) -> None:
        """Take in looks that showed every slot, shape [T, H, J], and the actions between them, shape [T − 1, H]."""
        rates = self._rates
        rows, (self._contents, self._shown) = self._kernels.follow(
            tuple(self.rows),
            (self._contents, self._shown),
            (*self._poses[:3], len(self._poses.first)),
            actions,
            symbols,
            (*rates.slips, rates.wrong, rates.wrong / len(self._alphabet), rates.repeat),
            self.log_evidence,
            self.log_weights,
        )
        self.rows = Rows(*rows)

    def observe_likelihood(self, likelihood: FloatArray) -> None:
        """Take in any evidence as a likelihood of each pattern, shape [|𝒵|], or [H, |𝒵|] for a look of each owner."""
        rows, symbols = self.rows, self._alphabet.symbols
        likelihood = np.broadcast_to(likelihood, (len(self.log_evidence), len(symbols)))
        registers = self._poses.registers[rows.pose]
        shown = self._shown_in_view(rows.pose, rows.table)
        joint = pattern_products(shown, symbols) / distinctness(shown, symbols)[:, None]
        joint *= self._poses.possible[rows.pose, None] * likelihood[rows.owner]
        probability = joint.sum(axis=1)
        kept, truth = self._condition(probability, likelihood.sum(axis=1))
        right = np.flatnonzero(truth > SAME)
        source, tables = kept[right], self._contents[self.rows.table[right]]
        joint = joint[source] / probability[source, None]
        posteriors = self._of_slots(joint)
        index = np.arange(len(right))
        for slot, posterior in enumerate(posteriors):
            register, expected = registers[source, slot], shown[slot][source]
            before = tables[index, register]
            taken = sum((each for other, each in enumerate(posteriors) if other != slot), np.zeros_like(posterior))
            tables[index, register], revealed = reweigh(before, expected, posterior, taken, truth[right])
            self._count_reveals(right, before, expected, revealed)
        self._merge(tables, right)

    def predicted_patterns(self) -> tuple[IntArray, FloatArray]:
        """Return the owners that matter, shape [I], and p(next pattern | action, owner) of each, shape [A, I, |𝒵|]."""
        return self._patterns_after(self._poses.successors, self._rates.slips, self._rates.wrong)

    def shown_patterns(self) -> tuple[IntArray, FloatArray]:
        """Return the owners that matter, shape [I], and p(pattern shown now | owner) of each, shape [I, |𝒵|]."""
        owners, (patterns,) = self._patterns_after(np.arange(len(self._poses.successors))[:, None], (0.0, 0.0), 0.0)
        return owners, patterns

    def _patterns_after(
        self, successors: IntArray, slips: tuple[float, float], wrong: float
    ) -> tuple[IntArray, FloatArray]:
        """Return the owners that matter, and p(pattern shown after each move of [P', A] | owner), shape [A, I, |𝒵|]."""
        from atg_fg.learning import prediction_kernels  # they load Numba

        structure = successors, self._poses.registers, self._poses.possible
        evidence = self.log_evidence, self.log_weights
        owners, patterns = prediction_kernels.patterns_after(
            self.rows[:], self._shown, structure, self._alphabet.symbols, *evidence, slips, wrong
        )
        return owners, patterns

    def poses_of(self, owner: int) -> dict[int, float]:
        """Return the probability of each pose of an owner that is not negligible."""
        own = np.flatnonzero(self.rows.owner == owner)
        weight = np.bincount(self.rows.pose[own], self.rows.weight[own])
        there = np.unique(self.rows.pose[own])
        return dict(zip(there.tolist(), (weight[there] / weight.sum()).tolist(), strict=True))

    def learned_contents(self, owner: int) -> FloatArray | None:
        """Return what was learned of an owner, shape [P, S]; ``None`` if it has been ruled out."""
        contents, is_possible = self.learned()
        learned: FloatArray = contents[owner]
        return learned if is_possible[owner] else None

    def learned(self) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return what was learned of each owner, shape [H, P, S], and whether it has not been ruled out, shape [H].

        It is the table of the most probable row if it is more so than all others, else their mean.
        """
        from atg_fg.learning import row_kernels  # they load Numba

        contents, is_possible = row_kernels.learned_contents(self.rows[:], self._contents, len(self.log_evidence))
        return contents, is_possible

    def expected_events(self) -> FloatArray:
        """Return the expected numbers of each owner, columns as ``atg_fg.learning.rates`` has them, [H, FAILED]."""
        from atg_fg.learning import row_kernels  # they load Numba

        events: FloatArray = row_kernels.expected_events(self.rows[:], len(self.log_evidence))
        return events

    @property
    def _kernels(self) -> ModuleType:
        from atg_fg.learning import pose_kernels  # they load Numba; as an attribute they could not be pickled

        return pose_kernels

    def _shown_in_view(self, poses: IntArray, tables: IntArray) -> list[FloatArray]:
        """Return the probability of each symbol in each slot of rows with these poses [..., R], J × [rows, S]."""
        in_view = np.moveaxis(self._poses.registers[poses], -1, 0)
        return [self._shown[tables, registers].reshape(-1, self._shown.shape[2]) for registers in in_view]

    def _condition(self, probability: FloatArray, scale: FloatArray) -> tuple[IntArray, FloatArray]:
        """Weigh the rows by a look, drop the negligible ones, and count how many looks were wrong.

        Args:
            probability: Of the look under each row if it is not wrong, shape [R].
            scale: The look's sum over patterns, for each owner or for all, shape [H] or [1].

        Returns:
            Which rows are left, and how probable it is that the look was not wrong under each of them.
        """
        wrong = self._rates.wrong / len(self._alphabet) * np.broadcast_to(scale, len(self.log_evidence))
        likelihoods = (1.0 - self._rates.wrong) * probability, wrong
        kept, truth, weight = self._kernels.weigh(
            self.rows.owner, self.rows.weight, likelihoods, self.log_evidence, self.log_weights
        )
        self.rows = self.rows.take(kept)._replace(weight=weight)
        self.rows.events[:, WRONG] += 1.0 - truth
        return kept, truth

    def _count_reveals(self, rows: IntArray, before: FloatArray, shown: FloatArray, revealed: FloatArray) -> None:
        """Count how probably a slot's register was revealed by a look, and its symbol drawn from all symbols.

        Rivals for one trial are not counted for.

        Args:
            rows: Index of each of the rows in question, shape [I].
            before: The register's table, shape [I, S].
            shown: The probability of each of its symbols, shape [I, S].
            revealed: The probability that it was revealed and has a symbol, shape [I, S].
        """
        if len(self.log_weights):
            return
        from_all = self._rates.repeat / self._alphabet.n_symbols * unrevealed(before[:, None, :])
        share = np.minimum(from_all / np.maximum(shown - before, TINY), 1.0)
        self.rows.events[rows, REVEAL] += revealed.sum(axis=1)
        self.rows.events[rows, REPEAT] += (revealed * share).sum(axis=1)

    def _merge(self, tables: FloatArray, changed: IntArray) -> None:
        """Make one row of those with the same owner, start and pose, and keep each different table once.

        Args:
            tables: New ones, shape [I, P, S].
            changed: Index of the row that each belongs to, shape [I].
        """
        sizes = (len(self._poses.first), len(self._poses.successors))
        rows, (self._contents, self._shown) = self._kernels.merged(
            tuple(self.rows), (self._contents, self._shown), tables, changed, sizes, self._rates.repeat
        )
        self.rows = Rows(*rows)

    def _of_slots(self, joint: FloatArray) -> list[FloatArray]:
        """Return the marginal of each slot, shape [J, n_symbols], of a joint of all patterns, shape [J, |𝒵|]."""
        n_slots, shape = self._alphabet.symbols.shape[1], (self._alphabet.n_symbols,)
        grid = np.zeros((len(joint), self._alphabet.n_symbols**n_slots))
        grid[:, self._places] = joint
        grid = grid.reshape(len(joint), *shape * n_slots)
        return [grid.sum(axis=tuple(other + 1 for other in range(n_slots) if other != slot)) for slot in range(n_slots)]

    @cached_property
    def _places(self) -> IntArray:
        """Where each pattern is among all combinations of symbols, shape [|𝒵|]."""
        symbols = self._alphabet.symbols
        places: IntArray = np.ravel_multi_index(tuple(symbols.T), (self._alphabet.n_symbols,) * symbols.shape[1])
        return places
