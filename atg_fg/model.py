"""Memory and assumptions as the tables of a hidden Markov model, one chain for each state of O.

Hypothesis i < K is a remembered object, hypothesis K is *unseen*. State 0 of a hypothesis is its collection
node, state 1 + k its k-th known aspect; hypotheses that know fewer aspects are padded with states of
probability zero. A transition row is never stored: it is ``stay · base`` plus its counted edges, where
``stay`` = α / (c + α) is the share that the Dirichlet prior keeps.
"""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np

from atg_fg.belief import IdentityBelief
from atg_fg.memory import RobotMemory
from atg_fg.parameters import ModelParameters
from atg_fg.patterns import Evidence, FloatArray, IntArray

#: State index of the collection node.
COLLECTION = 0


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


class Edges(NamedTuple):
    """Counted transitions of all hypotheses, all arrays of shape [E]; entries of one edge add up."""

    action: IntArray
    hypothesis: IntArray
    source: IntArray
    target: IntArray
    weight: FloatArray

    def followed_by(self, other: Edges) -> Edges:
        """Return the entries of both."""
        return Edges(
            np.concatenate((self.action, other.action)),
            np.concatenate((self.hypothesis, other.hypothesis)),
            np.concatenate((self.source, other.source)),
            np.concatenate((self.target, other.target)),
            np.concatenate((self.weight, other.weight)),
        )


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
        for hypothesis, graph in enumerate(graphs):
            patterns = list(graph.pattern_indices)
            self.pattern_of[hypothesis, 1 : 1 + len(patterns)] = patterns
            self.aspect_of[hypothesis, patterns] = 1 + np.arange(len(patterns))
        entries = [
            (action, hypothesis, 1 + source, 1 + target, count)
            for hypothesis, graph in enumerate(graphs)
            for (source, action, target), count in graph.counts.items()
        ]
        columns = np.array(entries, dtype=np.int64).reshape(-1, 5).T
        action, hypotheses, source, target, count = columns
        self.edges = Edges(action, hypotheses, source, target, count.astype(np.float64))
        self._refresh_aspects()
        self._refresh_transitions()

    @property
    def n_states(self) -> int:
        """W, the states of a hypothesis with its padding."""
        return self.pattern_of.shape[1]

    def _refresh_aspects(self) -> None:
        """Make everything that follows from which aspects are known."""
        delta, n_patterns = self.parameters.observation_noise, self.n_patterns
        n_unobserved = self.n_aspects - self.n_known
        #: p(next aspect) where nothing was counted, shape [H, W]
        self.base = np.where(self.pattern_of >= 0, 1.0 / self.n_aspects, 0.0)
        self.base[:, COLLECTION] = n_unobserved / self.n_aspects
        #: which patterns a hypothesis knows, and which not, as 1.0 and 0.0, shape [H, |𝒵|]
        self.known = (self.aspect_of != COLLECTION).astype(np.float64)
        self.unknown = 1.0 - self.known
        #: p(z | C_i) without noise of each pattern that no known aspect shows, shape [H]
        n_unknown = np.maximum(n_patterns - self.n_known, 1)
        self.unknown_rate = np.where(n_unobserved > 0, (1.0 - delta) / n_unknown, 0.0)

    def _refresh_transitions(self) -> None:
        """Make everything that follows from the counted transitions."""
        alpha = self.parameters.transition_concentration
        shape = (self.n_actions, self.n_hypotheses, self.n_states)
        rows = np.ravel_multi_index((self.edges.action, self.edges.hypothesis, self.edges.source), shape)
        totals = np.bincount(rows, weights=self.edges.weight, minlength=int(np.prod(shape))).astype(np.float64)
        #: whether anything was counted in a transition row, shape [A, H, W]
        self.counted = (totals > 0).reshape(shape)
        #: α / (c + α), the share of ``base`` in each transition row, shape [A, H, W]
        self.stay = np.divide(alpha, totals + alpha, out=np.ones_like(totals), where=totals > 0).reshape(shape)
        #: the rest of each row, divided over its edges, shape [E]
        self.edge_probability = self.edges.weight / (totals[rows] + alpha)
        #: flat index of each edge's (action, hypothesis, target), shape [E]
        self.edge_cells = rows + (self.edges.target - self.edges.source)

    def transition(self, action: int) -> FloatArray:
        """Return p(x' | x, a, i) with its padding, shape [H, W, W]; see ``docs/model.md``."""
        table: FloatArray = self.stay[action][:, :, None] * self.base[:, None, :]
        chosen = self.edges.action == action
        where = (self.edges.hypothesis[chosen], self.edges.source[chosen], self.edges.target[chosen])
        np.add.at(table, where, self.edge_probability[chosen])
        return table

    def likelihood(self, evidence: Evidence) -> FloatArray:
        """Return p(evidence | x, i) = Σ_z evidence(z) p(z | x, i), shape [H, W]."""
        noise = self.parameters.observation_noise / self.n_patterns * evidence.likelihood.sum()
        shown = evidence.likelihood[self.pattern_of]
        table: FloatArray = (1.0 - self.parameters.observation_noise) * np.where(
            self.pattern_of >= 0, shown, 0.0
        ) + noise
        table[:, COLLECTION] = self.unknown_rate * (self.unknown @ evidence.likelihood) + noise
        return table

    def restricted(self, hypotheses: IntArray) -> RecognitionModel:
        """Return the tables of some hypotheses, *unseen* the last of them; they share nothing that can change.

        Args:
            hypotheses: Their indices, ascending, shape [H'].
        """
        part = copy(self)
        part.n_hypotheses = len(hypotheses)
        for name in ("prior", "n_known", "aspect_of", "pattern_of", "base", "known", "unknown", "unknown_rate"):
            setattr(part, name, getattr(self, name)[hypotheses])
        part.counted, part.stay = self.counted[:, hypotheses], self.stay[:, hypotheses]
        number = np.full(self.n_hypotheses, -1)
        number[hypotheses] = np.arange(len(hypotheses))
        kept = number[self.edges.hypothesis] >= 0
        edges = self.edges
        part.edges = Edges(
            edges.action[kept],
            number[edges.hypothesis[kept]],
            edges.source[kept],
            edges.target[kept],
            edges.weight[kept],
        )
        part.edge_probability = self.edge_probability[kept]
        shape = (part.n_actions, part.n_hypotheses, part.n_states)
        part.edge_cells = np.ravel_multi_index((part.edges.action, part.edges.hypothesis, part.edges.target), shape)
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
        padding = int(states.max()) + 1 - self.n_states
        if padding > 0:
            self.pattern_of = np.pad(self.pattern_of, ((0, 0), (0, padding)), constant_values=-1)
        self.aspect_of[hypotheses, pattern] = states
        self.pattern_of[hypotheses, states] = pattern
        self._refresh_aspects()
        self._refresh_transitions()
        return Revelation(hypotheses, states, shares)

    def _count(self, previous: int, action: int, pattern: int) -> None:
        sources, targets = self.aspect_of[:, previous], self.aspect_of[:, pattern]
        hypotheses = np.flatnonzero((sources != COLLECTION) & (targets != COLLECTION))
        new = Edges(
            np.full(len(hypotheses), action),
            hypotheses,
            sources[hypotheses],
            targets[hypotheses],
            np.ones(len(hypotheses)),
        )
        self.edges = self.edges.followed_by(new)
        self._refresh_transitions()
