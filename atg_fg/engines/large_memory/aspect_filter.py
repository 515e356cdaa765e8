"""The Bayes filter of many hypotheses, each over aspects that the trial has found: padded arrays, and counted edges.

It computes what ``atg_fg.inference.recognition_model`` says, without any table over objects and patterns. Aspects that
were known before the trial are *hidden*: nothing in it has told them apart yet. Their mass is kept as one number. What
is not known of their edges lies between the two extremes that the row is given (``docs/large_memories.md``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction, UncertainAction
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.log_math import log_of
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.inference.recognition_model import COLLECTION


class Hidden(NamedTuple):
    """Known aspects of each row that are kept as one, all arrays of shape [R].

    Attributes:
        number: How many they are.
        prior_weight: The share of their mass that takes part in the row's S = Σ_x b(x) prior_weight(x).
        keep: The share of their mass that goes from one of them to another by counted edges.
    """

    number: FloatArray
    prior_weight: FloatArray
    keep: FloatArray


class CountedEdges(NamedTuple):
    """Counted transitions of all rows under one action, each once; a cell is row · W + state. All of shape [E]."""

    source: IntArray
    target: IntArray
    counts: FloatArray
    probability: FloatArray

    def followed_by(self, other: CountedEdges) -> CountedEdges:
        """Return the entries of both."""
        return CountedEdges(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))

    def in_cells(self, width: int, new_width: int) -> CountedEdges:
        """Return the same edges where rows are ``new_width`` wide."""
        source, target = (cells // width * new_width + cells % width for cells in self[:2])
        return CountedEdges(source, target, self.counts, self.probability)


class Looked(NamedTuple):
    """What a look makes of a filter, before anything is changed.

    Attributes:
        mass: p(X_t | row, z_0:t), shape [R, W]; the prediction where the row is ruled out.
        hidden_mass: The same of the hidden aspects, shape [R].
        log_weight: ln p(row, z_0:t), shape [R].
    """

    mass: FloatArray
    hidden_mass: FloatArray
    log_weight: FloatArray


class AspectFilter:
    """R hypotheses, with A actions; state 0 of a row is its collection node, state 1 + k the k-th aspect found.

    Args:
        assumptions: |G|, actions and alphabet.
        parameters: α, δ and whether to learn within the trial.
        log_weight: ln of the prior weight of each row, shape [R].
        hidden: The aspects of each row that were known before the trial.

    Attributes:
        n_known: n of each row, the hidden ones included, shape [R].
        pattern: What each state shows, shape [R, W]; −1 for collection nodes and padding.
        mass: p(X_t | row), shape [R, W].
        hidden_mass: p(X_t is hidden | row), shape [R].
        log_weight: ln p(row, z_0:t), shape [R].
        prior_weight: α/(c + α) of each aspect under each action, shape [A, R, W].
        edges: The transitions counted in the trial, by action.
    """

    def __init__(
        self, assumptions: Assumptions, parameters: ModelParameters, log_weight: FloatArray, hidden: Hidden
    ) -> None:
        self.parameters = parameters
        self.n_patterns = len(assumptions.alphabet)
        self.n_aspects = assumptions.n_aspects
        n_rows, n_actions = len(log_weight), len(assumptions.actions)
        self.hidden = hidden
        self.n_known = hidden.number.astype(np.int64)
        self.log_weight = log_weight
        self.pattern = np.full((n_rows, 1), -1, dtype=np.int32)
        self.mass = (self.n_unobserved / self.n_aspects)[:, None]
        self.hidden_mass = hidden.number / self.n_aspects
        self.prior_weight = np.ones((n_actions, n_rows, 1))
        cells, numbers = np.zeros(0, dtype=np.int64), np.zeros(0)
        self.edges = [CountedEdges(cells, cells, numbers, numbers) for _ in range(n_actions)]

    @property
    def n_rows(self) -> int:
        """R."""
        return self.pattern.shape[0]

    @property
    def width(self) -> int:
        """W."""
        return self.pattern.shape[1]

    @property
    def n_unobserved(self) -> IntArray:
        """G − n of each row, shape [R]."""
        unobserved: IntArray = self.n_aspects - self.n_known
        return unobserved

    @property
    def collection_rate(self) -> FloatArray:
        """p(z | C) without noise of each pattern that the row does not know, shape [R]."""
        n_unknown = np.maximum(self.n_patterns - self.n_known, 1)
        return np.where(self.n_unobserved > 0, (1.0 - self.parameters.observation_noise) / n_unknown, 0.0)

    def arrivals(self, action: int, mass: FloatArray) -> FloatArray:
        """Return what counted edges carry to each state under an action, shape [R, W]."""
        edges = self.edges[action]
        carried = mass.ravel()[edges.source] * edges.probability
        return np.bincount(edges.target, carried, mass.size).astype(np.float64).reshape(mass.shape)

    def predict(self, action: AnyAction) -> None:
        """Take in an action that is sure, or that nothing happened."""
        if isinstance(action, UncertainAction):
            return
        kept = np.einsum("rw,rw->r", self.mass, self.prior_weight[action]) + self.hidden.prior_weight * self.hidden_mass
        predicted = self.arrivals(action, self.mass)
        np.add(predicted, (kept / self.n_aspects)[:, None], out=predicted, where=self.pattern >= 0)
        predicted[:, COLLECTION] = kept * (self.n_unobserved / self.n_aspects)
        self.mass = predicted
        self.hidden_mass = kept * (self.hidden.number / self.n_aspects) + self.hidden.keep * self.hidden_mass

    def looked(self, evidence: Evidence) -> Looked:
        """Return what a look makes of this filter; hidden aspects show no pattern that it allows."""
        delta, likelihood = self.parameters.observation_noise, evidence.likelihood
        noise = delta / self.n_patterns * likelihood.sum()
        mass = self.mass * noise
        if not is_complete(evidence):
            listed = self.pattern >= 0
            shown = np.where(listed, likelihood[self.pattern], 0.0)
            unknown = likelihood.sum() - shown.sum(axis=1)
            # Subtraction leaves rounding errors where nothing is left.
            left = np.count_nonzero(likelihood) - np.count_nonzero(shown, axis=1)
            unknown = np.where(left > 0, np.maximum(unknown, 0.0), 0.0)
            mass += self.mass * ((1.0 - delta) * shown)
        else:
            rows, states = np.nonzero(self.pattern == evidence.pattern)
            weight = likelihood.sum()
            unknown = np.full(self.n_rows, weight)
            unknown[rows] = 0.0
            mass[rows, states] += self.mass[rows, states] * ((1.0 - delta) * weight)
        mass[:, COLLECTION] = self.mass[:, COLLECTION] * (self.collection_rate * unknown + noise)
        hidden_mass = self.hidden_mass * noise
        total = mass.sum(axis=1) + hidden_mass
        log_weight = self.log_weight + log_of(total)
        possible = total > 0
        divisor = np.where(possible, total, 1.0)
        mass /= divisor[:, None]
        hidden_mass /= divisor
        if not possible.all():
            mass[~possible], hidden_mass[~possible] = self.mass[~possible], self.hidden_mass[~possible]
        return Looked(mass, hidden_mass, log_weight)

    def accept(self, looked: Looked) -> None:
        """Take in a look."""
        self.mass, self.hidden_mass, self.log_weight = looked

    def learn(self, previous: int | None, action: int | None, pattern: int | None) -> None:
        """Extend every row by what was just seen, as ``RecognitionModel.learn`` does."""
        if not self.parameters.learn_in_trial or pattern is None:
            return
        self._reveal(pattern)
        if previous is not None and action is not None:
            self._count(previous, action, pattern)

    def _reveal(self, pattern: int) -> None:
        knows = (self.pattern == pattern).any(axis=1)
        rows = np.flatnonzero(~knows & (self.n_known < self.n_aspects))
        if not len(rows):
            return
        truth = self.collection_rate[rows]
        noise = self.parameters.observation_noise / self.n_patterns
        last = self.n_known[rows] + 1 == self.n_aspects
        shares = np.where(last, 1.0, truth / (truth + noise))
        self.n_known[rows] += 1
        states = self.n_known[rows] - self.hidden.number[rows].astype(np.int64)
        self._widen(int(states.max()) + 1)
        self.pattern[rows, states] = pattern
        revealed = self.mass[rows, COLLECTION] * shares
        self.mass[rows, states] = revealed
        self.mass[rows, COLLECTION] -= revealed

    def _widen(self, width: int) -> None:
        old = self.width
        if width <= old:
            return
        more = ((0, 0), (0, width - old))
        self.pattern = np.pad(self.pattern, more, constant_values=-1)
        self.mass = np.pad(self.mass, more)
        self.prior_weight = np.pad(self.prior_weight, ((0, 0), *more), constant_values=1.0)
        self.edges = [edges.in_cells(old, width) for edges in self.edges]

    def _count(self, previous: int, action: int, pattern: int) -> None:
        alpha = self.parameters.transition_concentration
        n_cells = self.pattern.size
        source_of, target_of = (self._cells_showing(shown) for shown in (previous, pattern))
        rows = np.flatnonzero((source_of >= 0) & (target_of >= 0))
        source, target = source_of[rows], target_of[rows]
        edges = self.edges[action]
        touched = np.zeros(n_cells, dtype=bool)
        touched[source] = True
        theirs = np.flatnonzero(touched[edges.source])
        again = theirs[edges.target[theirs] == target_of[edges.source[theirs] // self.width]]
        edges.counts[again] += 1.0
        totals = np.bincount(edges.source[theirs], edges.counts[theirs], n_cells).astype(np.float64)
        touched[edges.source[again]] = False
        new = touched[source]
        totals[source[new]] += 1.0
        edges.probability[theirs] = edges.counts[theirs] / (totals[edges.source[theirs]] + alpha)
        self.prior_weight[action].ravel()[source] = alpha / (totals[source] + alpha)
        first = source[new]
        added = CountedEdges(first, target[new], np.ones(len(first)), 1.0 / (totals[first] + alpha))
        self.edges[action] = edges.followed_by(added)

    def _cells_showing(self, pattern: int) -> IntArray:
        """Return the cell of each row that shows a pattern, −1 if none does, shape [R]."""
        cells = np.full(self.n_rows, -1)
        rows, states = np.nonzero(self.pattern == pattern)
        cells[rows] = rows * self.width + states
        return cells


def is_complete(evidence: Evidence) -> bool:
    """Whether evidence allows one pattern alone, and says which."""
    return evidence.pattern is not None and bool(evidence.likelihood[evidence.pattern] == evidence.likelihood.sum())
