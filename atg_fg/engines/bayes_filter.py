"""The paper's own method: a Bayes filter, in NumPy.

A transition row is ``stay · base`` plus a few counted edges (see ``atg_fg.model``), so a step costs what the
known edges cost.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from atg_fg.chain import Chain
from atg_fg.engines.base import FilterInference
from atg_fg.expected_entropy import NextPatternJoint, Targets, expected_entropies
from atg_fg.model import COLLECTION
from atg_fg.patterns import FloatArray


class BayesFilter(FilterInference):
    """Exact filtering and forward-backward smoothing on plain arrays."""

    name: ClassVar[str] = "bayes-filter"
    exact: ClassVar[bool] = True

    def _propagate(self, aspects: FloatArray, action: int) -> FloatArray:
        model = self.model
        kept = (aspects * model.stay[action]).sum(axis=1)
        predicted: FloatArray = kept[:, None] * model.base + self._arrivals(aspects)[action]
        return predicted

    def _correct(self, aspects: FloatArray, likelihood: FloatArray) -> FloatArray:
        return aspects * likelihood

    def _arrivals(self, mass: FloatArray) -> FloatArray:
        """Mass that counted edges carry to each state under each action, shape [A, H, W]."""
        model, edges = self.model, self.model.edges
        shape = (model.n_actions, model.n_hypotheses, model.n_states)
        carried = mass[edges.hypothesis, edges.source] * model.edge_probability
        arrivals = np.bincount(model.edge_cells, weights=carried, minlength=int(np.prod(shape)))
        return arrivals.astype(np.float64).reshape(shape)

    def _expected_entropies(self) -> FloatArray:
        """Return eq. 3 for each action, shape [A]."""
        model = self.model
        observed = 1.0 - model.parameters.observation_noise
        mass = self.aspect_belief
        total = mass.sum(axis=1)
        noise = model.parameters.observation_noise / model.n_patterns * total
        kept = np.einsum("hx,ahx->ah", mass, model.stay)
        unreached = kept * (observed / model.n_aspects) + noise
        arrivals = self._arrivals(mass)
        reached = np.flatnonzero(arrivals)
        targets = Targets(*np.unravel_index(reached, arrivals.shape))
        joint = NextPatternJoint(
            unknown=kept * model.base[:, COLLECTION] * model.unknown_rate + noise,
            unreached=unreached,
            targets=targets,
            reached=unreached[targets.action, targets.hypothesis] + observed * arrivals.ravel()[reached],
        )
        return expected_entropies(model, joint, float(total[-1]))

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
