"""What a trial's factor graph gives beyond a filter: explanations (O, X_0, …, X_t), samples of them, and surprise.

All work on a ``Chain``, so any exact engine can be asked: ``best_explanations(inference.chain(), 5)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from atg_fg.core.checks import MANY, whole_number
from atg_fg.core.errors import ImpossibleEvidenceError, TooLargeError
from atg_fg.core.log_math import log_of, log_sum_exp
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.chain import Chain, ForwardPass, forward_pass


@dataclass(frozen=True)
class Explanation:
    """One way in which all that was seen can have come about.

    Attributes:
        hypothesis: State of O; the last one is *unseen*.
        states: State of X_s at every time s; 0 is the collection node, 1 + k the k-th known aspect.
        log_probability: ln p(O, X_0:t | z_0:t, a_1:t).
    """

    hypothesis: int
    states: tuple[int, ...]
    log_probability: float

    @property
    def probability(self) -> float:
        """p(O, X_0:t | z_0:t, a_1:t)."""
        return float(np.exp(self.log_probability))


#: Ways to a look that are compared at once, 8 bytes each.
_MOST_WAYS: Final = 2**26


def best_explanations(chain: Chain, k: int = 1) -> list[Explanation]:
    """Return the k most probable explanations, best first; the first is the MPE. Fewer if fewer are possible.

    A Viterbi recursion that keeps, for every object and last aspect, the k best ways there.

    Raises:
        InvalidInputError: k below one.
        TooLargeError: Too many ways would have to be compared.
        ImpossibleEvidenceError: The evidence has probability zero.
    """
    whole_number(k, "k", least=1)
    _check_ways(chain, k)
    likelihoods = _likelihoods(chain)
    log_evidence = log_sum_exp(_possible(chain).log_joint)
    #: ln p of the r-th best way to each state, shape [H, W, r], and where it came from, flat over (state, rank)
    scores = (chain.log_identity[:, None] + log_of(chain.initial) + log_of(likelihoods[0]))[:, :, None]
    origins: list[IntArray] = []
    for transition, likelihood in zip(chain.transitions, likelihoods[1:], strict=True):
        ways = scores[:, :, :, None] + log_of(transition)[:, :, None, :]
        ways = ways.reshape(len(ways), -1, transition.shape[2])
        best = np.argsort(-ways, axis=1, kind="stable")[:, :k]
        origins.append(best.transpose(0, 2, 1))
        scores = np.take_along_axis(ways, best, axis=1).transpose(0, 2, 1) + log_of(likelihood)[:, :, None]
    order = np.argsort(-scores, axis=None, kind="stable")[:k]
    found = []
    for flat in order:
        hypothesis, state, rank = (int(index) for index in np.unravel_index(flat, scores.shape))
        log_joint = float(scores[hypothesis, state, rank])
        if np.isfinite(log_joint):
            states = _traced(origins, hypothesis, state, rank)
            found.append(Explanation(hypothesis, states, log_joint - log_evidence))
    return found


def _check_ways(chain: Chain, k: int) -> None:
    """Raise TooLargeError if at some look too many ways to it would be compared, before any is."""
    n_ranks = 1
    for transition in chain.transitions:
        if transition.size * n_ranks > _MOST_WAYS:
            raise TooLargeError(
                f"k: {k}: would compare {transition.size * n_ranks} ways to a look at once; "
                f"expected fewer explanations, for at most {_MOST_WAYS} ways"
            )
        n_ranks = min(k, n_ranks * transition.shape[1])


def _traced(origins: list[IntArray], hypothesis: int, state: int, rank: int) -> tuple[int, ...]:
    """Follow the origins back from a last state."""
    states = [state]
    for time in range(len(origins) - 1, -1, -1):
        # Ranks before time 1 are one a state; later ones are as many as were kept.
        ranks = 1 if time == 0 else origins[time - 1].shape[2]
        state, rank = divmod(int(origins[time][hypothesis, state, rank]), ranks)
        states.append(state)
    return tuple(reversed(states))


def sample_explanations(chain: Chain, n: int, rng: np.random.Generator) -> list[Explanation]:
    """Return n explanations drawn from p(O, X_0:t | z_0:t, a_1:t), by filtering forward and sampling backward.

    Raises:
        InvalidInputError: n below one, or above 100,000.
        ImpossibleEvidenceError: The evidence has probability zero.
    """
    whole_number(n, "number of samples", 1, MANY)
    past = _possible(chain)
    filtered = past.filtered
    log_identity = past.log_joint - log_sum_exp(past.log_joint)
    hypotheses = rng.choice(len(log_identity), size=n, p=np.exp(log_identity) / np.exp(log_identity).sum())
    drawn = []
    for hypothesis in hypotheses:
        states = [int(rng.choice(chain.widths[-1], p=filtered[-1][hypothesis]))]
        log_probability = float(log_identity[hypothesis] + np.log(filtered[-1][hypothesis, states[0]]))
        for time in range(len(chain.transitions) - 1, -1, -1):
            weights = filtered[time][hypothesis] * chain.transitions[time][hypothesis, :, states[-1]]
            weights = weights / weights.sum()
            states.append(int(rng.choice(len(weights), p=weights)))
            log_probability += float(np.log(weights[states[-1]]))
        drawn.append(Explanation(int(hypothesis), tuple(reversed(states)), log_probability))
    return drawn


def surprise(chain: Chain) -> FloatArray:
    """Return −ln p(z_s | z_0:s-1, a_1:s) of every look, shape [looks], in nats; they sum to −ln p(z_0:t | a_1:t).

    Raises:
        ImpossibleEvidenceError: The evidence has probability zero.
    """
    log_joints = _possible(chain).log_joints[: len(chain.likelihoods)]
    log_evidence = np.array([log_sum_exp(log_joint) for log_joint in log_joints])
    return -np.diff(log_evidence, prepend=0.0)


def _possible(chain: Chain) -> ForwardPass:
    """Return the forward pass, or raise ``ImpossibleEvidenceError`` at the first look that no object allows."""
    past = forward_pass(chain)
    for time, log_joint in enumerate(past.log_joints):
        if not np.isfinite(log_joint).any():
            raise ImpossibleEvidenceError(
                f"observation {time}: the evidence has probability zero under the model; "
                "expected evidence that some object could give, or noise above 0"
            )
    return past


def _likelihoods(chain: Chain) -> list[FloatArray]:
    """Return p(z_s | X_s, O) for every time, ones where nothing was seen yet."""
    unseen_yet = [np.ones((len(chain.prior), width)) for width in chain.widths[len(chain.likelihoods) :]]
    return [*chain.likelihoods, *unseen_yet]
