"""A Bayes filter over object and aspect whose loops are compiled, and its decision."""

from __future__ import annotations

import math

import numpy as np

from atg_fg.core.actions import AnyAction, UncertainAction, mixed
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.log_math import log_of, log_sum_exp
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels import belief_kernels as kernels
from atg_fg.inference.kernels import decision_kernels
from atg_fg.inference.kernels.memory_tables import ROOM, TrialArrays, arrays_for_trial, with_more_room

#: What there is to learn from a look: the pattern before, the action since then, the pattern seen.
LookedAt = tuple[int | None, int | None, int | None]


class CompiledRows:
    """p(O) and p(X_t | O) of some hypotheses in one trial, and what each of them knows, extended as the trial goes.

    What an action does to the belief is computed with the look after it, in one call.

    Args:
        assumptions: |G|, actions and alphabet.
        parameters: α, δ and whether to learn within the trial.
        arrays: What the hypotheses know, with room for ``ROOM`` more aspects and edges, and room for p(X_t | O).
        prior: p(O) of each, shape [H].
    """

    def __init__(
        self, assumptions: Assumptions, parameters: ModelParameters, arrays: TrialArrays, prior: FloatArray
    ) -> None:
        self._constants = tuple(_constants(assumptions, parameters))
        self._n_aspects, self._n_actions = assumptions.n_aspects, len(assumptions.actions)
        self._n_patterns = len(assumptions.alphabet)
        self._learns = parameters.learn_in_trial
        self._tables, self._aspects = arrays
        self._arrays = tuple(self._tables)
        self._room = ROOM
        self._n_learned = 0
        #: p(O) and its logarithm, shape [H]
        self.identity = prior.copy()
        self.log_identity = log_of(prior)
        self._shown, self._shown_pattern = np.zeros(len(prior), self._tables.n_known.dtype), -1
        #: what has happened since the last look
        self._action: int = kernels.BEGIN

    def state(self) -> tuple[FloatArray, FloatArray]:
        """Return ln p(O | z_0:t), shape [H], and p(X_t | O, z_0:t), shape [H, W], W as of the model's tables."""
        self._move()
        n_known = self._tables.n_known.astype(np.int64)
        is_there = np.arange(1 + n_known.max()) <= n_known[:, None]
        return self.log_identity.copy(), np.where(is_there, self._aspects[:, : is_there.shape[1]], 0.0)

    def weigh(self, likelihood: FloatArray) -> float:
        """Condition on what was felt of the object, p(reading | O) above 0, shape [H]; return ln p(reading | z_0:t)."""
        log_joint = self.log_identity + np.log(likelihood)
        log_probability = log_sum_exp(log_joint)
        self.log_identity = log_joint - log_probability
        self.identity = np.exp(self.log_identity)
        return log_probability

    def look(self, likelihood: FloatArray, seen: LookedAt) -> float:
        """Condition on a look, and extend every hypothesis by it for the steps to come, if it is to be learned from.

        Args:
            likelihood: Of each pattern, shape [|𝒵|].
            seen: What there is to learn; a pattern is ``None`` if its look was not complete.

        Returns:
            ln p(z_t | z_0:t-1), or −∞ with nothing changed.
        """
        learned, (before, action, pattern) = (-1, 0, -1, -1), seen
        if self._learns and pattern is not None:
            if self._n_learned == self._room:
                self._make_room()
            self._n_learned += 1
            counted = (-1, 0) if before is None or action is None else (before, action)
            learned = (*counted, pattern, self._shown_pattern)
        belief = (self._aspects, self.log_identity, self.identity)
        evidence = np.array(likelihood)  # of a read-only array, which is another type, all would be compiled again
        log_probability = kernels.step(
            self._arrays, self._constants, belief, self._action, evidence, learned, self._shown
        )
        self._action = kernels.REST
        if learned[2] >= 0 and log_probability > -math.inf:
            self._shown_pattern = learned[2]
        return log_probability

    def next_patterns(self, weights: FloatArray, hypotheses: IntArray) -> FloatArray:
        """Return p(O = i, z | a) of the next look, shape [A, I, |𝒵|], of some hypotheses [I] with p(O) as given [H]."""
        self._move()
        result: FloatArray = decision_kernels.next_patterns(
            self._arrays, self._constants, self._aspects, weights, hypotheses, self._n_actions
        )
        return result

    def _make_room(self) -> None:
        """Move rows apart, twice as far as before."""
        self._tables = with_more_room(self._tables, self._room, self._n_aspects)
        self._arrays = tuple(self._tables)
        self._room += self._room
        aspects = np.zeros(self._tables.pattern.shape)
        aspects[:, : self._aspects.shape[1]] = self._aspects
        self._aspects = aspects

    def act(self, action: AnyAction) -> None:
        """Predict the effect of an action."""
        self._move()
        if not isinstance(action, UncertainAction):
            self._action = action
            return
        before = self._aspects.copy()
        self._aspects[...] = mixed(action, lambda index: self._moved(before, index), before)

    def _move(self) -> None:
        """Let the belief be that after what has happened since the last look."""
        if self._action != kernels.REST:
            kernels.move(self._arrays, self._constants, self._aspects, self._action)
            self._action = kernels.REST

    def _moved(self, aspects: FloatArray, action: int) -> FloatArray:
        moved = aspects.copy()
        kernels.move(self._arrays, self._constants, moved, action)
        return moved


class CompiledFilter(CompiledRows):
    """The rows of all hypotheses: the remembered objects, and last *unseen*.

    Args:
        memory: The robot memory when the trial begins.
        parameters: α, δ and whether to learn within the trial.
        prior: p(O), shape [H].
    """

    def __init__(self, memory: RobotMemory, parameters: ModelParameters, prior: FloatArray) -> None:
        alpha = float(parameters.transition_concentration)
        arrays = arrays_for_trial(memory, alpha, self, extends=parameters.learn_in_trial)
        super().__init__(memory.assumptions, parameters, arrays, prior)

    def expected_entropies(self, n_unseen: int) -> FloatArray:
        """Return eq. 3 for each action in nats, shape [A]."""
        self._move()
        expected = np.empty(self._n_actions)
        decision_kernels.expected_entropies(
            self._arrays, self._constants, self._aspects, self.identity, math.log(n_unseen), expected
        )
        return expected


def _constants(assumptions: Assumptions, parameters: ModelParameters) -> kernels.Constants:
    return kernels.Constants(
        assumptions.n_aspects,
        len(assumptions.alphabet),
        float(parameters.transition_concentration),
        float(parameters.observation_noise),
    )
