"""Memory and assumptions as the tables of a hidden Markov model, one chain for each state of O.

Hypothesis i < K is a remembered object, hypothesis K is *unseen*. State 0 of a hypothesis is its collection
node, state 1 + k its k-th known aspect; hypotheses that know fewer aspects are padded with states of
probability zero. A transition row is never stored: it is ``stay · base`` plus its counted edges, where
``stay`` = α / (c + α) is the share that the Dirichlet prior keeps.
"""

from __future__ import annotations

import math
from copy import copy
from itertools import chain
from typing import Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.inference.counted_edges import Edges, Targets, distinct

#: State index of the collection node.
COLLECTION = 0


#: Attributes of a ``RecognitionModel`` whose first axis are its hypotheses.
_BY_HYPOTHESIS: Final = (
    *("prior", "n_known", "aspect_of", "pattern_of", "base", "known", "unknown", "n_unknown"),
    *("unknown_rate", "unknown_share"),
)


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
    """The tables in force at one time of one trial; ``learn`` makes them those of the next.

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
    """

    def __init__(self, memory: RobotMemory, parameters: ModelParameters, prior: IdentityBelief | None = None) -> None:
        assumptions = memory.assumptions
        self.memory = memory
        self.parameters = parameters
        self.n_actions = len(assumptions.actions)
        self.n_aspects = assumptions.n_aspects
        self.n_patterns = len(assumptions.alphabet)
        self.n_unseen = memory.n_unseen
        self.n_hypotheses = len(memory) + 1
        graphs = list(memory)
        if prior is None:
            self.prior = IdentityBelief.uniform(len(graphs), self.n_unseen).probabilities
        else:
            prior.check(len(graphs), self.n_unseen)
            self.prior = prior.probabilities / prior.probabilities.sum()
        self.n_known = np.array([graph.n_known for graph in graphs] + [0], dtype=np.int64)
        self.aspect_of = np.full((self.n_hypotheses, self.n_patterns), COLLECTION, dtype=np.int64)
        self.pattern_of = np.full((self.n_hypotheses, 1 + int(self.n_known.max())), -1, dtype=np.int64)
        patterns = np.fromiter(chain.from_iterable(graph.pattern_indices for graph in graphs), dtype=np.int64)
        hypotheses = np.repeat(np.arange(self.n_hypotheses), self.n_known)
        states = 1 + np.arange(len(patterns)) - np.repeat(np.cumsum(self.n_known) - self.n_known, self.n_known)
        self.pattern_of[hypotheses, states] = patterns
        self.aspect_of[hypotheses, patterns] = states
        #: which patterns a hypothesis knows, and which not, as 1.0 and 0.0, shape [H, |𝒵|]
        self.known = (self.aspect_of != COLLECTION).astype(np.float64)
        self.unknown = 1.0 - self.known
        owners = np.repeat(np.arange(len(graphs)), [graph.n_counted for graph in graphs])
        columns = np.concatenate([np.empty((0, 4), dtype=np.int64), *(graph.count_table for graph in graphs)]).T
        source, action, target, count = columns
        self.edges = Edges(action, owners, 1 + source, 1 + target, count.astype(np.float64))
        self._refresh_aspects()
        self._refresh_transitions()

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
        delta, n_patterns = self.parameters.observation_noise, self.n_patterns
        n_unobserved = self.n_aspects - self.n_known
        #: p(next aspect) where nothing was counted, shape [H, W]
        self.base = np.where(self.pattern_of >= 0, 1.0 / self.n_aspects, 0.0)
        self.base[:, COLLECTION] = n_unobserved / self.n_aspects
        #: how many patterns a hypothesis does not know, shape [H]
        self.n_unknown = (n_patterns - self.n_known).astype(np.float64)
        #: p(z | C_i) without noise of each pattern that no known aspect shows, shape [H]
        self.unknown_rate = np.where(n_unobserved > 0, (1.0 - delta) / np.maximum(self.n_unknown, 1.0), 0.0)
        #: the same of the next look if nothing was counted, shape [H]
        self.unknown_share = self.base[:, COLLECTION] * self.unknown_rate

    def _refresh_transitions(self) -> None:
        """Make everything that follows from the counted transitions."""
        alpha = self.parameters.transition_concentration
        edges, shape = self.edges, (self.n_actions, self.n_hypotheses, self.n_states)
        rows = (edges.action * self.n_hypotheses + edges.hypothesis) * self.n_states + edges.source
        totals = np.bincount(rows, weights=edges.weight, minlength=math.prod(shape))[rows] + alpha
        #: α / (c + α), the share of ``base`` in each transition row, shape [A, H, W]
        self.stay = np.ones(shape)
        self.stay.ravel()[rows] = alpha / totals
        #: the rest of each row, divided over its edges, shape [E]
        self.edge_probability = edges.weight / totals
        #: flat index of each edge's (hypothesis, source), shape [E]
        self.edge_source = edges.hypothesis * self.n_states + edges.source
        self._refresh_targets(rows + (edges.target - edges.source))

    def _refresh_targets(self, cells: IntArray) -> None:
        """Make everything that follows from the (action, hypothesis, target) of each edge, flat indices [E]."""
        #: which target each edge leads to, shape [E]
        self.edge_target, one_edge = distinct(cells, self.stay.size)
        action, hypothesis, _, state, _ = self.edges.chosen(one_edge)
        row = action * self.n_hypotheses + hypothesis
        #: what edges lead to
        self.targets = Targets(
            action, hypothesis, state, row, action * self.n_patterns + self.pattern_of[hypothesis, state]
        )
        n_targets = np.bincount(row, minlength=self.n_actions * self.n_hypotheses).reshape(self.n_actions, -1)
        #: how many known aspects of a hypothesis no edge of an action leads to, shape [A, H]
        self.n_unreached = (self.n_known - n_targets).astype(np.float64)

    def transition(self, action: int) -> FloatArray:
        """Return p(x' | x, a, i) with its padding, shape [H, W, W]; see ``docs/model.md``."""
        table: FloatArray = self.stay[action][:, :, None] * self.base[:, None, :]
        chosen = self.edges.action == action
        where = (self.edges.hypothesis[chosen], self.edges.source[chosen], self.edges.target[chosen])
        np.add.at(table, where, self.edge_probability[chosen])
        return table

    def predict(self, mass: FloatArray, action: int) -> FloatArray:
        """Return Σ_x mass(i, x) p(x' | x, a, i), shape [H, W], from ``mass`` [H, W] without any transition table."""
        chosen = self.edges.of_action(action)
        targets = self.edges.hypothesis[chosen] * self.n_states + self.edges.target[chosen]
        carried = mass.ravel()[self.edge_source[chosen]] * self.edge_probability[chosen]
        arrived = np.bincount(targets, weights=carried, minlength=self.base.size).reshape(self.base.shape)
        kept = np.vecdot(mass, self.stay[action])
        predicted: FloatArray = kept[:, None] * self.base + arrived
        return predicted

    def likelihood(self, evidence: Evidence) -> FloatArray:
        """Return p(evidence | x, i) = Σ_z evidence(z) p(z | x, i), shape [H, W]."""
        noise = self.parameters.observation_noise / self.n_patterns * evidence.likelihood.sum()
        shown = (1.0 - self.parameters.observation_noise) * evidence.likelihood + noise
        # At index -1, the pattern of collection nodes and padding, there is noise alone.
        table: FloatArray = np.append(shown, noise)[self.pattern_of]
        table[:, COLLECTION] = self.unknown_rate * (self.unknown @ evidence.likelihood) + noise
        return table

    def restricted(self, hypotheses: IntArray) -> RecognitionModel:
        """Return the tables of some hypotheses, *unseen* the last of them; they share nothing that can change.

        Args:
            hypotheses: Their indices, ascending, shape [H'].
        """
        part = copy(self)
        part.n_hypotheses = len(hypotheses)
        for name in _BY_HYPOTHESIS:
            setattr(part, name, getattr(self, name)[hypotheses])
        part.stay = self.stay[:, hypotheses]
        number = np.full(self.n_hypotheses, -1)
        number[hypotheses] = np.arange(len(hypotheses))
        kept = number[self.edges.hypothesis] >= 0
        part.edges = self.edges.chosen(kept)._replace(hypothesis=number[self.edges.hypothesis[kept]])
        part.edge_probability = self.edge_probability[kept]
        part.edge_source = part.edges.hypothesis * part.n_states + part.edges.source
        part._refresh_targets(
            np.ravel_multi_index((part.edges.action, part.edges.hypothesis, part.edges.target), part.stay.shape)
        )
        return part

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
        truth = self.unknown_rate[hypotheses]
        noise = self.parameters.observation_noise / self.n_patterns
        last = self.n_known[hypotheses] + 1 == self.n_aspects
        shares = np.where(last, 1.0, truth / (truth + noise))
        self.n_known[hypotheses] += 1
        states = self.n_known[hypotheses]
        self.pattern_of = widened(self.pattern_of, int(states.max()) + 1, -1)
        self.aspect_of[hypotheses, pattern] = states
        self.pattern_of[hypotheses, states] = pattern
        self.known[hypotheses, pattern] = 1.0
        self.unknown[hypotheses, pattern] = 0.0
        self._refresh_aspects()
        return Revelation(hypotheses, states, shares)

    def _count(self, previous: int, action: int, pattern: int) -> None:
        sources, targets = self.aspect_of[:, previous], self.aspect_of[:, pattern]
        edges = self.edges
        of_action = edges.of_action(action)
        owners = edges.hypothesis[of_action]
        same = (edges.source[of_action] == sources[owners]) & (edges.target[of_action] == targets[owners])
        again = of_action[same]
        edges.weight[again] += 1.0
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
        self.edges = edges.followed_by(new)


def widened(table: NDArray[_Number], width: int, fill: float = 0) -> NDArray[_Number]:
    """Return a copy of ``table`` [..., W] with ``width`` columns or, if that is more, as many as it has.

    New columns hold ``fill``.
    """
    wide = np.full((*table.shape[:-1], max(width, table.shape[-1])), fill, dtype=table.dtype)
    wide[..., : table.shape[-1]] = table
    return wide
