"""The paper's own method: a Bayes filter, in NumPy.

A transition row is ``stay · base`` plus a few counted edges (see ``atg_fg.model``), so a step costs what the
known edges cost.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from atg_fg.chain import Chain
from atg_fg.engines.base import FilterInference
from atg_fg.expected_entropy import expected_entropies_of
from atg_fg.patterns import FloatArray


class BayesFilter(FilterInference):
    """Exact filtering and forward-backward smoothing on plain arrays."""

    name: ClassVar[str] = "bayes-filter"
    exact: ClassVar[bool] = True

    def _propagate(self, aspects: FloatArray, action: int) -> FloatArray:
        return self.model.predict(aspects, action)

    def _correct(self, aspects: FloatArray, likelihood: FloatArray) -> FloatArray:
        return aspects * likelihood

    def _expected_entropies(self) -> FloatArray:
        """Return eq. 3 for each action, shape [A]."""
        return expected_entropies_of(self.model, self.aspect_belief)

    def _smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s by forward-backward."""
        return forward_backward(self.chain(hypothesis))


def forward_backward(chain: Chain) -> list[FloatArray]:
    """Return p(X_s | O, z_0:t, a_1:t) of a chain with one hypothesis, each of shape [W_s]."""
    likelihoods = [table[0] for table in chain.likelihoods]
    likelihoods += [np.ones(width) for width in chain.widths[len(likelihoods) :]]
    forward = [_normalised(chain.initial[0] * likelihoods[0])]
    for transition, likelihood in zip(chain.transitions, likelihoods[1:], strict=True):
        forward.append(_normalised(forward[-1] @ transition[0] * likelihood))
    backward = [np.ones(chain.widths[-1])]
    for transition, likelihood in zip(reversed(chain.transitions), reversed(likelihoods[1:]), strict=True):
        backward.append(_normalised(transition[0] @ (likelihood * backward[-1])))
    return [_normalised(past * future) for past, future in zip(forward, reversed(backward), strict=True)]


def _normalised(mass: FloatArray) -> FloatArray:
    total = mass.sum()
    return mass / total if total > 0 else mass
