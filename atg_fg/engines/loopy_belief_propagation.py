"""Loopy belief propagation: sum-product messages on the trial's factor graph, with O shared by all factors.

The factors are p(O) with all that is felt of the object as a whole, ψ_0(O, X_0) = p(X_0 | O) p(z_0 | X_0, O) and ψ_s(O,
X_{s-1}, X_s) = p(X_s | X_{s-1}, a_s, O) p(z_s | X_s, O). Each observation factor is part of the factor that brings in
its aspect, since the scope of the one is within that of the other. From the first action on, O, X_{s-1} and the two
factors that hold both make a loop; then the beliefs are those of a fixed point of the Bethe free energy, if there is
one that the messages reach.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np

from atg_fg.core.checks import number, one_of, whole_number
from atg_fg.core.log_math import log_of, log_sum_exp
from atg_fg.core.patterns import FloatArray
from atg_fg.engines.whole_trial import Posterior, WholeTrialInference, joint_of
from atg_fg.inference.chain import Chain
from atg_fg.inference.interface import TrialSetup

SCHEDULES = ("sequential", "parallel")


class LoopyReport(NamedTuple):
    """How the messages came out.

    Attributes:
        iterations: Sweeps over all messages.
        converged: Whether no message changed by more than the tolerance in the last of them.
        largest_change: The largest change of a probability in any message in the last of them.
    """

    iterations: int
    converged: bool
    largest_change: float


class LoopyBeliefPropagation(WholeTrialInference):
    """Sum-product message passing; exact on a tree, which is a trial of one look or an empty memory.

    The evidence is exp(−F) of the Bethe free energy F, on a tree the exact one and else neither bound. Smoothed aspects
    are those of the factors' beliefs given O, whose messages from other times are not conditioned on O.

    Args:
        setup: What the trial begins with.
        damping: Share of the old message in each new one, from 0 to below 1; not used on a tree.
        schedule: ``sequential``, forwards and backwards through time and then to O, or ``parallel``, all at once.
        max_iterations: Most sweeps.
        tolerance: Largest change of a probability in a message that counts as none.

    Raises:
        InvalidInputError: An option has a value that it cannot take.
    """

    name: ClassVar[str] = "loopy-bp"
    exact: ClassVar[bool] = False

    def __init__(
        self,
        setup: TrialSetup,
        *,
        damping: float = 0.3,
        schedule: str = "sequential",
        max_iterations: int = 500,
        tolerance: float = 1e-10,
    ) -> None:
        super().__init__(setup)
        self.damping = number(damping, "damping", 0.0, below=1.0)
        self.schedule = one_of(schedule, "schedule", SCHEDULES)
        self.max_iterations = whole_number(max_iterations, "max_iterations", 1)
        self.tolerance = number(tolerance, "tolerance", 0.0, below=1.0)
        self._report = LoopyReport(0, converged=True, largest_change=0.0)
        self._messages: Messages | None = None

    @property
    def report(self) -> LoopyReport:
        """How the messages of the trial so far came out."""
        _ = self.posterior
        return self._report

    def solve(self, chain: Chain) -> Posterior:
        """Return the posterior of a chain whose likelihoods are at most one."""
        is_tree = len(chain.prior) == 1 or not chain.transitions
        messages = Messages(chain, damping=0.0 if is_tree else self.damping)
        sweep = messages.sweep if self.schedule == "sequential" else messages.flood
        iterations, change = 0, np.inf
        while iterations < self.max_iterations and change > self.tolerance:
            change = sweep()
            iterations += 1
        self._report = LoopyReport(iterations, converged=change <= self.tolerance, largest_change=float(change))
        self._messages = messages
        identity = messages.identity()
        joint = joint_of(identity, messages.aspects(len(chain.transitions)))
        return Posterior(identity, joint, messages.log_evidence())

    def compute_smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s from the beliefs of the factors."""
        _ = self.posterior
        assert self._messages is not None
        identity = np.zeros(self.model.n_hypotheses)
        identity[hypothesis] = 1.0
        times = range(len(self._messages.forward))
        return [joint_of(identity, self._messages.aspects(time))[hypothesis] for time in times]


class Messages:
    """All messages of a chain's factor graph, each normalised; T + 1 factors ψ_0 … ψ_T.

    Attributes:
        forward: From ψ_s to X_s, and so from X_s to ψ_{s+1}, each of shape [W_s].
        backward: From ψ_{s+1} to X_s, and so from X_s to ψ_s; ones for the last X. Each of shape [W_s].
        to_object: From ψ_s to O, shape [T + 1, H].
    """

    def __init__(self, chain: Chain, damping: float) -> None:
        self._damping = damping
        self._log_prior = chain.log_identity
        # ψ_0 as [H, 1, W_0], as if X_0 came from a variable with one state.
        incoming = [chain.initial[:, None, :], *chain.transitions]
        observed = [*chain.likelihoods, np.ones((1, 1))][: len(incoming)]
        self._factors = [table * seen[:, None, :] for table, seen in zip(incoming, observed, strict=True)]
        self.forward: list[FloatArray] = [np.full(width, 1.0 / width) for width in chain.widths]
        self.backward = [message.copy() for message in self.forward[:-1]] + [np.ones(chain.widths[-1])]
        self.to_object = np.full((len(incoming), len(chain.prior)), 1.0 / len(chain.prior))

    def sweep(self) -> float:
        """Renew all messages, forwards, backwards and to O, and return the largest change of a probability."""
        last = len(self._factors) - 1
        changes = [0.0]
        weights = self._from_object()
        for time in range(last + 1):
            self.forward[time], change = self._damped(self.forward[time], self._forward(time, weights[time]))
            changes.append(change)
        for time in range(last, 0, -1):
            message = self._backward(time, weights[time])
            self.backward[time - 1], change = self._damped(self.backward[time - 1], message)
            changes.append(change)
        for time in range(last + 1):
            self.to_object[time], change = self._damped(self.to_object[time], self._to_object(time))
            changes.append(change)
        return max(changes)

    def flood(self) -> float:
        """Renew all messages at once from the old ones, and return the largest change of a probability."""
        times, weights = range(len(self._factors)), self._from_object()
        forward = [self._damped(self.forward[s], self._forward(s, weights[s])) for s in times]
        backward = [self._damped(self.backward[s - 1], self._backward(s, weights[s])) for s in times[1:]]
        to_object = [self._damped(self.to_object[s], self._to_object(s)) for s in times]
        self.forward = [message for message, _ in forward]
        self.backward = [*(message for message, _ in backward), self.backward[-1]]
        self.to_object = np.array([message for message, _ in to_object])
        return max(change for _, change in (*forward, *backward, *to_object))

    def identity(self) -> FloatArray:
        """Return the belief in O, shape [H]."""
        logarithms = self._log_prior + log_of(self.to_object).sum(axis=0)
        belief: FloatArray = np.exp(logarithms - log_sum_exp(logarithms))
        return belief

    def aspects(self, time: int) -> FloatArray:
        """Return weights of X_time under each state of O, from the belief of ψ_time, shape [H, W_time]."""
        weights: FloatArray = np.einsum("x,hxy->hy", self._past(time), self._factors[time]) * self.backward[time]
        return weights

    def log_evidence(self) -> float:
        """Return −F of the Bethe free energy, from the normalisers of factors, variables and edges.

        All T + 1 edges of O and O itself have one normaliser, and so have X_s and its two edges if s < T; the last X
        has one edge.
        """
        last = len(self._factors) - 1
        given = self._log_from_object()
        factors = sum(log_sum_exp(given[s] + log_of(self._to_object(s))) for s in range(last + 1))
        objects = log_sum_exp(self._log_prior + log_of(self.to_object).sum(axis=0))
        overlaps = np.array([past @ future for past, future in zip(self.forward[:-1], self.backward[:-1], strict=True)])
        return float(factors - last * objects - log_of(overlaps).sum())

    def _log_from_object(self) -> FloatArray:
        """Logarithm of the message from O to each factor: what all the others told O, shape [T + 1, H]."""
        told = log_of(self.to_object)
        nothing = np.zeros_like(told[:1])
        # Sums before and after each factor: a difference of sums would be undefined where an object is ruled out.
        before = np.concatenate((nothing, np.cumsum(told[:-1], axis=0)))
        after = np.concatenate((np.cumsum(told[:0:-1], axis=0)[::-1], nothing))
        return self._log_prior + before + after

    def _from_object(self) -> FloatArray:
        logarithms = self._log_from_object()
        weights: FloatArray = np.exp(logarithms - logarithms.max(axis=1, keepdims=True))
        return weights

    def _past(self, time: int) -> FloatArray:
        return self.forward[time - 1] if time else np.ones(1)

    def _forward(self, time: int, weights: FloatArray) -> FloatArray:
        table = self._factors[time]
        message: FloatArray = np.outer(weights, self._past(time)).ravel() @ table.reshape(-1, table.shape[2])
        return message

    def _backward(self, time: int, weights: FloatArray) -> FloatArray:
        message: FloatArray = weights @ (self._factors[time] @ self.backward[time])
        return message

    def _to_object(self, time: int) -> FloatArray:
        message: FloatArray = self._factors[time] @ self.backward[time] @ self._past(time)
        return message

    def _damped(self, old: FloatArray, new: FloatArray) -> tuple[FloatArray, float]:
        """Return the new message, normalised and damped, and its change; one that underflowed is not taken."""
        total = new.sum()
        if not total > 0:
            return old, np.inf
        message = new / total
        # A zero is what no other message can undo, so it is not damped.
        message = np.where(message > 0, (1.0 - self._damping) * message + self._damping * old, 0.0)
        message /= message.sum()
        return message, float(np.abs(message - old).max())
