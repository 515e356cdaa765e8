"""Markov chain Monte Carlo over (O, X_0:t): a partially collapsed Gibbs sampler with blocked moves.

With next to no transition noise, no single aspect can change alone, and O cannot change while a path of another object
is held. So a sweep has two blocks. O is renewed by Metropolis-Hastings with the path summed out: an object is proposed
from an even mixture of the prior and the uniform distribution over possible objects, and p(O) p(z_0:t | O), from a
forward pass given O, decides. Then X_0:t given O is drawn as a whole by forward filtering and backward sampling.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np

from atg_fg.core.checks import whole_number
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.engines.sampling import drawn, split_r_hat
from atg_fg.engines.whole_trial import Posterior, WholeTrialInference
from atg_fg.inference.chain import Chain, ForwardPass, forward_pass
from atg_fg.inference.interface import TrialSetup

#: Objects that make up less of the samples than this are left out of the diagnostic.
LEAST_SHARE = 0.01


class GibbsReport(NamedTuple):
    """How the Markov chains came out.

    Attributes:
        acceptance: Part of the proposals of another object that were accepted.
        r_hat: The largest split R-hat of an object's indicator, over the objects that make up a hundredth of the
            samples or more; above about 1.01 the chains have not mixed. An object that no chain has visited
            does not show in it.
    """

    acceptance: float
    r_hat: float


class GibbsSampling(WholeTrialInference):
    """Several Markov chains run anew at the first question after each step.

    The samples depend on the seed and on the steps taken so far alone, not on what was asked before. The evidence is
    Chib's estimate p(o, z) / p̂(o | z) at the object o sampled most often: exact but for the sampled p̂. Smoothed
    aspects are the shares of paths drawn given the object.

    Args:
        setup: What the trial begins with.
        n_chains: Number of chains, begun at objects drawn from the proposal.
        n_sweeps: Sweeps of each chain that are kept.
        n_burn_in: Sweeps of each chain before these.
        seed: Seed of the sampler's own generators.

    Raises:
        InvalidInputError: An option has a value that it cannot take.
    """

    name: ClassVar[str] = "gibbs"
    exact: ClassVar[bool] = False

    def __init__(
        self, setup: TrialSetup, *, n_chains: int = 8, n_sweeps: int = 1000, n_burn_in: int = 500, seed: int = 0
    ) -> None:
        super().__init__(setup)
        self.n_chains = whole_number(n_chains, "n_chains", 2)
        self.n_sweeps = whole_number(n_sweeps, "n_sweeps", 4)
        self.n_burn_in = whole_number(n_burn_in, "n_burn_in", 0)
        self.seed = whole_number(seed, "seed", 0)
        self._report = GibbsReport(1.0, 1.0)

    @property
    def report(self) -> GibbsReport:
        """How the Markov chains of the trial so far came out."""
        _ = self.posterior
        return self._report

    def solve(self, chain: Chain) -> Posterior:
        """Return the posterior of a chain whose likelihoods are at most one."""
        rng = self._generator(0)
        past = forward_pass(chain)
        proposal = self._proposal(chain)
        objects, acceptance = self._objects(past.log_joint, proposal, rng)
        n_hypotheses = len(chain.prior)
        samples = objects.ravel()
        identity = np.bincount(samples, minlength=n_hypotheses) / len(samples)
        common = np.flatnonzero(identity >= LEAST_SHARE)
        r_hats = [split_r_hat((objects == hypothesis).T.astype(np.float64)) for hypothesis in common]
        self._report = GibbsReport(acceptance, max(r_hats, default=1.0))
        joint = np.zeros(past.filtered[-1].shape)
        np.add.at(joint, (samples, drawn(past.filtered[-1][samples], rng)), 1.0 / len(samples))
        mode = int(identity.argmax())
        return Posterior(identity, joint, float(past.log_joint[mode] - np.log(identity[mode])))

    def _generator(self, stream: int) -> np.random.Generator:
        """Return a generator that depends on the seed, the length of the trial and the question."""
        return np.random.default_rng([self.seed, len(self.history.evidence), len(self.history.actions), stream])

    def _proposal(self, chain: Chain) -> FloatArray:
        """Return the probability with which each object is proposed, shape [H]."""
        possible = self.support.any(axis=1)
        prior = np.where(possible, chain.prior, 0.0)
        proposal: FloatArray = 0.5 * prior / prior.sum() + 0.5 * possible / possible.sum()
        return proposal

    def _objects(self, log_joint: FloatArray, proposal: FloatArray, rng: np.random.Generator) -> tuple[IntArray, float]:
        """Return the object of each kept sweep of each chain, shape [S, C], and the part of other objects accepted."""
        n_sweeps = self.n_burn_in + self.n_sweeps
        proposed = rng.choice(len(proposal), (n_sweeps + 1, self.n_chains), p=proposal)
        thresholds = np.log1p(-rng.random((n_sweeps, self.n_chains)))
        # ln of target over proposal: the independence sampler accepts by its change.
        log_weight = log_joint - np.log(proposal, out=np.zeros_like(proposal), where=proposal > 0)
        # A possible object whose evidence underflowed weighs next to nothing, but not −∞ − −∞.
        log_weight = np.maximum(log_weight, -1e300)
        state = proposed[0]
        objects = np.empty((n_sweeps, self.n_chains), dtype=np.int64)
        for sweep in range(n_sweeps):
            candidate = proposed[sweep + 1]
            accepted = thresholds[sweep] < log_weight[candidate] - log_weight[state]
            state = np.where(accepted, candidate, state)
            objects[sweep] = state
        before = np.concatenate((proposed[:1], objects[:-1]))
        others = proposed[1:] != before
        moved = objects != before
        return objects[self.n_burn_in :], float(moved.sum() / others.sum()) if others.any() else 1.0

    def compute_smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s from paths drawn given the object."""
        chain, _ = self.chain(hypothesis).scaled()
        past = forward_pass(chain)
        if not np.isfinite(past.log_joint[0]):
            return [np.zeros(width) for width in chain.widths]
        n_samples = self.n_chains * self.n_sweeps
        paths = backward_samples(chain, past, n_samples, self._generator(1 + hypothesis))
        return [
            np.bincount(states, minlength=width) / n_samples for states, width in zip(paths, chain.widths, strict=True)
        ]


def backward_samples(chain: Chain, past: ForwardPass, n_samples: int, rng: np.random.Generator) -> list[IntArray]:
    """Return X_0, …, X_t of paths drawn given the only object of a chain (H = 1), each of shape [n]."""
    paths = [drawn(np.broadcast_to(past.filtered[-1][0], (n_samples, chain.widths[-1])), rng)]
    for time in range(len(chain.transitions) - 1, -1, -1):
        weights = past.filtered[time][0] * chain.transitions[time][0].T[paths[-1]]
        paths.append(drawn(weights, rng))
    return paths[::-1]
