"""A Bayes filter over object and aspect whose loops are compiled, and its decision."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from atg_fg.core.actions import AnyAction, UncertainAction, mixed
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.kernels import belief_kernels as kernels
from atg_fg.inference.kernels.memory_tables import ROOM, arrays_for_trial, with_more_room

#: Hypotheses whose terms are made at once: they stay in the processor's cache until their logarithms are taken.
_BLOCK: Final = 1024


class CompiledFilter:
    """p(O) and p(X_t | O) in one trial, and what each hypothesis knows, extended as the trial goes.

    Args:
        memory: The robot memory when the trial begins.
        parameters: α and δ.
        prior: p(O), shape [H].
    """

    def __init__(self, memory: RobotMemory, parameters: ModelParameters, prior: FloatArray) -> None:
        assumptions = memory.assumptions
        self._constants = kernels.Constants(
            assumptions.n_aspects,
            len(assumptions.alphabet),
            float(parameters.transition_concentration),
            float(parameters.observation_noise),
        )
        arrays = arrays_for_trial(memory, self._constants.concentration, self)
        self._tables, self._aspects, self._next_aspects = arrays
        self._room = ROOM
        self._n_learned = 0
        #: p(O), shape [H]
        self.identity = prior.copy()
        self._log_identity = np.log(prior, out=np.full_like(prior, -np.inf), where=prior > 0)
        kernels.spread_by_base(self._tables, self._constants, self._aspects)
        self._terms: FloatArray | None = None

    def state(self) -> tuple[FloatArray, FloatArray]:
        """Return ln p(O | z_0:t), shape [H], and p(X_t | O, z_0:t), shape [H, W], W as of the model's tables."""
        n_known = self._tables.n_known.astype(np.int64)
        is_there = np.arange(1 + n_known.max()) <= n_known[:, None]
        return self._log_identity, np.where(is_there, self._aspects[:, : is_there.shape[1]], 0.0)

    def look(self, likelihood: FloatArray) -> float:
        """Condition on a look by its likelihood over 𝒵; return ln p(z_t | z_0:t-1), or −∞ with nothing changed."""
        log_updated, identity = np.empty_like(self._log_identity), np.empty_like(self.identity)
        log_probability = kernels.condition(
            self._tables,
            self._constants,
            likelihood,
            self._aspects,
            self._log_identity,
            self._next_aspects,
            log_updated,
            identity,
        )
        if math.isfinite(log_probability):
            self._aspects, self._next_aspects = self._next_aspects, self._aspects
            self._log_identity, self.identity = log_updated, identity
        return float(log_probability)

    def learn(self, previous: int | None, action: int | None, pattern: int) -> None:
        """Extend every hypothesis by the last look, at pattern ``pattern``, for the steps to come.

        Args:
            previous: Pattern seen one step earlier, ``None`` if that look was not complete.
            action: Action since then, ``None`` at the first step.
            pattern: Pattern seen now.
        """
        if self._n_learned == self._room:
            self._make_room()
        counted = previous is not None and action is not None
        kernels.learn(
            self._tables,
            self._constants,
            self._aspects,
            previous if counted and previous is not None else -1,
            action if counted and action is not None else 0,
            pattern,
        )
        self._n_learned += 1

    def _make_room(self) -> None:
        """Move rows apart, twice as far as before."""
        self._tables = with_more_room(self._tables, self._room, self._constants.n_aspects)
        self._room += self._room
        more = self._tables.pattern.shape[1] - self._aspects.shape[1]
        self._aspects = np.pad(self._aspects, ((0, 0), (0, more)))
        self._next_aspects = np.zeros_like(self._aspects)
        self._terms = None

    def act(self, action: AnyAction) -> None:
        """Predict the effect of an action."""
        if isinstance(action, UncertainAction):
            # Not a copy of one's own: padding behind the aspects is to stay as it is.
            self._aspects[...] = mixed(action, lambda index: self._moved(index).copy(), self._aspects)
            return
        moved = self._moved(action)
        self._aspects, self._next_aspects = moved, self._aspects

    def _moved(self, action: int) -> FloatArray:
        kernels.predict(self._tables, self._constants, self._aspects, action, self._next_aspects)
        return self._next_aspects

    def expected_entropies(self, n_unseen: int) -> FloatArray:
        """Return eq. 3 for each action in nats, shape [A]."""
        n_hypotheses, n_actions = len(self.identity), self._tables.prior_weight.shape[1]
        terms = self._room_for_terms()
        predictive, sums = np.zeros((n_actions, self._constants.n_patterns)), np.zeros(n_actions)
        ends = np.empty(n_actions, np.int64)
        belief = (self.identity, self._aspects)
        for first in range(0, n_hypotheses, _BLOCK):
            block = (first, min(first + _BLOCK, n_hypotheses))
            kernels.joint_terms(self._tables, self._constants, belief, block, predictive, terms, ends)
            # Some behind the last term of an action are left from before; they are positive, too.
            kernels.add_up(terms, np.log(terms[:, 0, : ends.max()]), ends, sums)
        expected: FloatArray = np.maximum(float(self.identity[-1]) * math.log(n_unseen) - sums, 0.0)
        return expected

    def _room_for_terms(self) -> FloatArray:
        """Return an array for the terms of any block, until rows are moved apart."""
        if self._terms is None:
            n_actions, n_edges = self._tables.prior_weight.shape[1], self._tables.n_edges.astype(np.int64)
            per_block = np.add.reduceat(n_edges + self._room, np.arange(0, len(n_edges), _BLOCK))
            rows = min(len(n_edges), _BLOCK)
            needed = int(per_block.max()) + 2 * rows + self._constants.n_patterns
            self._terms = np.ones((n_actions, 2, needed))
        return self._terms
