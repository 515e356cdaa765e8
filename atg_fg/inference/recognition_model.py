r"""Memory and assumptions as the tables of a hidden Markov model, one chain for each state of O.

Hypothesis i < K is a remembered object, hypothesis K is *unseen*. State 0 of a hypothesis is its collection
node C, state 1 + k its k-th known aspect; hypotheses that know fewer aspects are padded with states of
probability zero. A transition row is never stored: it is ``prior_weight · base_row`` plus its counted edges.

With n of G aspects known, c transitions counted from x by a, and the symbols of ``docs/model.md``:

=========================  ========================================  ==============================================
``prior_weight``           α / (c + α)                               what the Dirichlet prior keeps of a row, [A, H, W]
``base_row``               1/G of an aspect, (G − n)/G of C          p(x' | x, a, i) if nothing was counted, [H, W]
``edge_probability``       count / (c + α)                           what an edge adds to its row, [E]
``knows``, ``lacks``       1 or 0                                    whether an aspect shows z, or none, [H, |𝒵|]
``n_lacking``              \|𝒵\| − n                                 patterns that no known aspect shows, [H]
``collection_rate``        (1 − δ) / (\|𝒵\| − n), 0 if n = G         p(z | C, i) of each of these without noise, [H]
``base_collection_rate``   (G − n)/G · ``collection_rate``           the same of the next look by ``base_row``, [H]
``n_unreached``                                                      known aspects that no edge of a leads to, [A, H]
=========================  ========================================  ==============================================
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from itertools import chain
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.actions import AnyAction, UncertainAction, mixed
from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.compact.columns import positions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray, IntArray, Measured, protect
from atg_fg.inference.counted_edges import Edges, Targets, distinct
from atg_fg.inference.history import History
from atg_fg.inference.object_tables import ObjectTables

#: State index of the collection node.
COLLECTION = 0
_Number = TypeVar("_Number", np.float64, np.int64)


class Revelation(NamedTuple):
    """Aspects found by learning within the trial: mass of a collection node that moves to a new state.

    Attributes:
        hypotheses: Indices of the hypotheses that get a new aspect, shape [R].
        states: The state each of them gives the aspect, shape [R].
        shares: The part of the collection node's posterior that moves to the new state, shape [R].
    """

    hypotheses: IntArray
    states: IntArray
    shares: FloatArray

    def move(self, mass: FloatArray) -> None:
        """Divide the collection nodes' ``mass``, shape [..., H, W], in place."""
        revealed = mass[..., self.hypotheses, COLLECTION] * self.shares
        mass[..., self.hypotheses, self.states] = revealed
        mass[..., self.hypotheses, COLLECTION] -= revealed


class RecognitionModel:
    """The tables in force at one time of a trial; ``learn`` turns them into those of the next time.

    No table can be written to: ``learn`` replaces them, so a shallow copy keeps those of its time.

    H = K + 1 hypotheses, W states (padded), A actions, |𝒵| patterns, E edge entries.

    Args:
        memory: The robot memory when the trial begins; it is not changed.
        parameters: α, δ and whether to learn within the trial.
        prior: p(O) in place of the memory's 1/N each and U/N; zeros rule objects out.

    Raises:
        InvalidInputError: ``prior`` is not a distribution over the objects of this memory.

    Attributes:
        prior: p(O), shape [H].
        n_known: n_i, shape [H].
        aspect_of: State of each hypothesis that shows a pattern, shape [H, |𝒵|]; ``COLLECTION`` if it knows none.
        pattern_of: Pattern that each state shows, shape [H, W]; -1 for collection nodes and padding.
        edges: The counted transitions.
        objects: What is felt of the object as a whole.
    """

    def __init__(self, memory: RobotMemory, parameters: ModelParameters, prior: IdentityBelief | None = None) -> None:
        self._set_sizes(memory, parameters, prior)
        self._make_tables(list(memory))

    def _make_tables(self, graphs: Sequence[AspectTransitionGraph]) -> None:
        self.n_known = np.array([graph.n_known for graph in graphs] + [0], dtype=np.int64)
        self.aspect_of = np.full((self.n_hypotheses, self.n_patterns), COLLECTION, dtype=np.int64)
        self.pattern_of = np.full((self.n_hypotheses, 1 + int(self.n_known.max())), -1, dtype=np.int64)
        patterns = np.fromiter(chain.from_iterable(graph.pattern_indices for graph in graphs), dtype=np.int64)
        hypotheses = np.repeat(np.arange(self.n_hypotheses), self.n_known)
        states = positions(np.ones_like(self.n_known), self.n_known)
        self.pattern_of[hypotheses, states] = patterns
        self.aspect_of[hypotheses, patterns] = states
        owners = np.repeat(np.arange(len(graphs)), [graph.n_counted for graph in graphs])
        columns = np.concatenate([np.empty((0, 4), dtype=np.int64), *(graph.count_table for graph in graphs)]).T
        source, action, target, count = columns
        self.edges = Edges(action, owners, 1 + source, 1 + target, count.astype(np.float64))
        self._refresh_aspects()
        self._refresh_transitions()

    def _set_sizes(self, memory: RobotMemory, parameters: ModelParameters, prior: IdentityBelief | None) -> None:
        """Set everything that needs no table over objects and patterns."""
        self.memory = memory
        self.parameters = parameters
        self.n_actions = len(memory.assumptions.actions)
        self.n_aspects = memory.assumptions.n_aspects
        self.n_patterns = len(memory.assumptions.alphabet)
        self.n_unseen = memory.n_unseen
        self.n_hypotheses = len(memory) + 1
        self.objects = ObjectTables.of(memory)
        if prior is None:
            self.prior = IdentityBelief.uniform(len(memory), self.n_unseen).probabilities
        else:
            prior.check(len(memory), self.n_unseen)
            self.prior = prior.probabilities / prior.probabilities.sum()

    @property
    def n_states(self) -> int:
        """W, the states of a hypothesis with its padding."""
        return self.pattern_of.shape[1]

    @property
    def states(self) -> IntArray:
        """Flat indices (hypothesis, state) of all states but the padding, ascending."""
        return np.flatnonzero(np.arange(self.n_states) <= self.n_known[:, None])

    def _refresh_aspects(self) -> None:
        """Make everything that follows from which aspects are known."""
        delta = self.parameters.observation_noise
        n_unobserved = self.n_aspects - self.n_known
        self.base_row = np.where(self.pattern_of >= 0, 1.0 / self.n_aspects, 0.0)
        self.base_row[:, COLLECTION] = n_unobserved / self.n_aspects
        self.knows = (self.aspect_of != COLLECTION).astype(np.float64)
        self.lacks = 1.0 - self.knows
        self.n_lacking = (self.n_patterns - self.n_known).astype(np.float64)
        self.collection_rate = np.where(n_unobserved > 0, (1.0 - delta) / np.maximum(self.n_lacking, 1.0), 0.0)
        self.base_collection_rate = self.base_row[:, COLLECTION] * self.collection_rate

    def _refresh_transitions(self) -> None:
        """Make everything that follows from the counted transitions."""
        alpha = self.parameters.transition_concentration
        edges, shape = self.edges, (self.n_actions, self.n_hypotheses, self.n_states)
        rows = (edges.action * self.n_hypotheses + edges.hypothesis) * self.n_states + edges.source
        totals = np.bincount(rows, weights=edges.weight, minlength=math.prod(shape))[rows] + alpha
        self.prior_weight = np.ones(shape)
        self.prior_weight.ravel()[rows] = alpha / totals
        self.edge_probability = edges.weight / totals
        #: flat index of each edge's (hypothesis, source), shape [E]
        self.edge_source = edges.hypothesis * self.n_states + edges.source
        #: which target each edge leads to, shape [E]
        self.edge_target, one_edge = distinct(rows + (edges.target - edges.source), self.prior_weight.size)
        action, hypothesis, _, state, _ = self.edges.chosen(one_edge)
        row = action * self.n_hypotheses + hypothesis
        #: what edges lead to
        self.targets = Targets(
            action, hypothesis, state, row, action * self.n_patterns + self.pattern_of[hypothesis, state]
        )
        n_targets = np.bincount(row, minlength=self.n_actions * self.n_hypotheses).reshape(self.n_actions, -1)
        self.n_unreached = (self.n_known - n_targets).astype(np.float64)
        protect(vars(self).values())

    def transition(self, action: AnyAction) -> FloatArray:
        """Return p(x' | x, a, i) with its padding, shape [H, W, W]; see ``docs/model.md``."""
        if isinstance(action, UncertainAction):
            return mixed(action, self.transition, np.tile(np.eye(self.n_states), (self.n_hypotheses, 1, 1)))
        table: FloatArray = self.prior_weight[action][:, :, None] * self.base_row[:, None, :]
        chosen = self.edges.action == action
        where = (self.edges.hypothesis[chosen], self.edges.source[chosen], self.edges.target[chosen])
        np.add.at(table, where, self.edge_probability[chosen])
        return table

    def predict(self, mass: FloatArray, action: int) -> FloatArray:
        """Return Σ_x mass(i, x) p(x' | x, a, i), shape [H, W], from ``mass`` [H, W] without any transition table."""
        chosen = self.edges.of_action(action)
        targets = self.edges.hypothesis[chosen] * self.n_states + self.edges.target[chosen]
        carried = mass.ravel()[self.edge_source[chosen]] * self.edge_probability[chosen]
        arrived = np.bincount(targets, weights=carried, minlength=self.base_row.size).reshape(self.base_row.shape)
        kept = np.vecdot(mass, self.prior_weight[action])
        predicted: FloatArray = kept[:, None] * self.base_row + arrived
        return predicted

    def likelihood(self, evidence: Evidence) -> FloatArray:
        """Return p(evidence | x, i), shape [H, W]: of the pattern, and of what was felt of the object."""
        table = self.pattern_likelihood(evidence)
        return table * self.objects.likelihood(evidence.measured)[:, None] if evidence.measured else table

    def pattern_likelihood(self, evidence: Evidence) -> FloatArray:
        """Return p(evidence | x, i) = Σ_z evidence(z) p(z | x, i), shape [H, W]."""
        noise = self.parameters.observation_noise / self.n_patterns * evidence.likelihood.sum()
        shown = (1.0 - self.parameters.observation_noise) * evidence.likelihood + noise
        # At index -1, the pattern of collection nodes and padding, there is noise alone.
        table: FloatArray = np.append(shown, noise)[self.pattern_of]
        table[:, COLLECTION] = self.collection_rate * (self.lacks @ evidence.likelihood) + noise
        return table

    def restricted(self, hypotheses: IntArray) -> RecognitionModel:
        """Return the tables of some hypotheses, *unseen* the last of them; they share nothing that can change.

        Args:
            hypotheses: Their indices, ascending, shape [H'].
        """
        part = copy(self)
        part.n_hypotheses = len(hypotheses)
        part.prior, part.n_known = self.prior[hypotheses], self.n_known[hypotheses]
        part.objects = self.objects.restricted(hypotheses)
        part.aspect_of, part.pattern_of = self.aspect_of[hypotheses], self.pattern_of[hypotheses]
        number = np.full(self.n_hypotheses, -1)
        number[hypotheses] = np.arange(len(hypotheses))
        kept = self.edges.chosen(number[self.edges.hypothesis] >= 0)
        part.edges = kept._replace(hypothesis=number[kept.hypothesis])
        part._refresh_aspects()
        part._refresh_transitions()
        return part

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        protect(state.values())

    def feel(self, measured: Measured) -> None:
        """Take in readings of the object as a whole, for those to come."""
        self.objects = self.objects.after(measured)

    def learn_from(self, history: History, time: int) -> Revelation | None:
        """Extend every hypothesis by the look at a time of a trial, as ``learn`` does; ``None`` if no aspect is new.

        What was felt of the object counts for the looks to come, whether or not aspects are learned.
        """
        if history.evidence[time].measured:
            self.feel(history.evidence[time].measured)
        return self.learn(*history.step(time))

    def learn(self, previous: int | None, action: int | None, pattern: int | None) -> Revelation | None:
        """Extend every hypothesis by what was just seen (``learn_in_trial``), for the steps to come.

        Args:
            previous: Pattern seen one step earlier, ``None`` if that look was not complete.
            action: Action since then, ``None`` at the first step.
            pattern: Pattern seen now, ``None`` if this look was not complete.

        Returns:
            How belief in the collection nodes is to be divided, or ``None`` if no aspect is new.
        """
        if not self.parameters.learn_in_trial or pattern is None:
            return None
        revelation = self._reveal(pattern)
        if previous is not None and action is not None:
            self._count(previous, action, pattern)
        self._refresh_transitions()
        return revelation

    def _reveal(self, pattern: int) -> Revelation | None:
        lacks = (self.aspect_of[:, pattern] == COLLECTION) & (self.n_known < self.n_aspects)
        hypotheses = np.flatnonzero(lacks)
        if not len(hypotheses):
            return None
        truth = self.collection_rate[hypotheses]
        noise = self.parameters.observation_noise / self.n_patterns
        last = self.n_known[hypotheses] + 1 == self.n_aspects
        shares = np.where(last, 1.0, truth / (truth + noise))
        states = self.n_known[hypotheses] + 1
        # Tables are replaced, not written to: a copy of this model keeps those that it has.
        self.n_known, self.aspect_of = self.n_known.copy(), self.aspect_of.copy()
        self.pattern_of = widened(self.pattern_of, int(states.max()) + 1, -1)
        self.n_known[hypotheses] = states
        self.aspect_of[hypotheses, pattern] = states
        self.pattern_of[hypotheses, states] = pattern
        self._refresh_aspects()
        return Revelation(hypotheses, states, shares)

    def _count(self, previous: int, action: int, pattern: int) -> None:
        sources, targets = self.aspect_of[:, previous], self.aspect_of[:, pattern]
        edges = self.edges
        of_action = edges.of_action(action)
        owners = edges.hypothesis[of_action]
        same = (edges.source[of_action] == sources[owners]) & (edges.target[of_action] == targets[owners])
        again = of_action[same]
        weight = edges.weight.copy()
        weight[again] += 1.0
        first_time = (sources != COLLECTION) & (targets != COLLECTION)
        first_time[edges.hypothesis[again]] = False
        hypotheses = np.flatnonzero(first_time)
        new = Edges(
            np.full(len(hypotheses), action),
            hypotheses,
            sources[hypotheses],
            targets[hypotheses],
            np.ones(len(hypotheses)),
        )
        self.edges = edges._replace(weight=weight).followed_by(new)


def widened(table: NDArray[_Number], width: int, fill: float = 0) -> NDArray[_Number]:
    """Return a copy of ``table`` [..., W] with ``width`` columns or, if that is more, as many as it has.

    New columns hold ``fill``.
    """
    wide = np.full((*table.shape[:-1], max(width, table.shape[-1])), fill, dtype=table.dtype)
    wide[..., : table.shape[-1]] = table
    return wide
