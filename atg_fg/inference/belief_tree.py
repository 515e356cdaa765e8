"""The belief tree of a policy that looks ahead: the belief after an action and each look that it may lead to.

``BeliefNode`` and ``Observations`` say what is asked; ``TableBeliefNode`` and ``TableObservations`` answer from the
model's tables. After action a and pattern z the belief is, up to a factor,

    p(O = i, X' = y | z, a) ∝ p(i, y | a) · δ/|𝒵| + e_i(z) · [y = y_i(z)]

with y_i(z) the known aspect that shows z, or else the collection node, and e_i(z) = p(i, y_i(z) | a) times the rate
without noise at which y_i(z) shows z. So all beliefs of an action share the first term, and each has one entry an
object of its own: no table over patterns and states is needed.
"""

from __future__ import annotations

from typing import Final, Protocol

import numpy as np

from atg_fg.core.log_math import x_log_x
from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.expected_entropy import NextPatternJoint, arrivals, expected_entropies, expected_entropies_of
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel

#: Hypotheses less probable than this, given the path from the root, are left out. What they add to an expected entropy,
#: p ln p in all, is less than rounding does.
_NEGLIGIBLE: Final = 1e-18


class BeliefNode(Protocol):
    """A belief over identity and present aspect that a trial may lead to; nothing more is learned on the way."""

    def expected_entropies(self) -> FloatArray:
        """Return the expected entropy of identity after one more action (eq. 3) in nats, shape [A]."""

    def after(self, action: int) -> Observations:
        """Return what may be seen after an action."""


class Observations(Protocol):
    """The looks that an action may lead to; patterns that lead to the same belief may count as one look."""

    @property
    def probabilities(self) -> FloatArray:
        """Return p(look | a), shape [L]; they sum to one."""

    @property
    def entropies(self) -> FloatArray:
        """Return H(O | look, a) in nats, shape [L]."""

    def expected_entropies(self, looks: IntArray) -> FloatArray:
        """Return ``BeliefNode.expected_entropies`` after each of some looks [N] of probability above 0, [N, A]."""

    def belief(self, look: int) -> BeliefNode:
        """Return the belief after a look of probability above 0."""


class TableBeliefNode:
    """A belief on the tables in force.

    Args:
        model: The tables.
        mass: p(O, X_t), shape [H, W].
    """

    def __init__(self, model: RecognitionModel, mass: FloatArray) -> None:
        given_object = mass.sum(axis=1)
        possible = given_object > _NEGLIGIBLE * given_object.sum()
        possible[-1] = True  # the tables end with *unseen*
        if not possible.all():
            hypotheses = np.flatnonzero(possible)
            model, mass = model.restricted(hypotheses), mass[hypotheses]
        self._model = model
        self._mass = mass

    def expected_entropies(self) -> FloatArray:
        """Return the expected entropy of identity after one more action (eq. 3) in nats, shape [A]."""
        return expected_entropies_of(self._model, self._mass)

    def after(self, action: int) -> TableObservations:
        """Return what may be seen after an action."""
        return TableObservations(self._model, self._model.predict(self._mass, action))


class TableObservations:
    """Looks on the tables in force: one for each pattern that some object knows, and one for all others.

    Args:
        model: The tables.
        predicted: p(O, X_{t+1} | a), shape [H, W].
    """

    def __init__(self, model: RecognitionModel, predicted: FloatArray) -> None:
        self._model = model
        known = np.any(model.knows > 0, axis=0)
        patterns = np.flatnonzero(known)
        #: the look that each pattern is, shape [|𝒵|]
        self._look_of = np.where(known, np.cumsum(known) - 1, len(patterns))
        n_patterns = np.ones(len(patterns))
        if not known.all():
            patterns = np.append(patterns, np.flatnonzero(~known)[0])
            n_patterns = np.append(n_patterns, np.count_nonzero(~known))
        rows = np.arange(model.n_hypotheses)[:, None]
        #: y_i(z), shape [H, L]
        self._states = model.aspect_of[:, patterns]
        observed = 1.0 - model.parameters.observation_noise
        rates = np.where(self._states == COLLECTION, model.collection_rate[:, None], observed)
        #: the part of p(O, X', look | a) that is an entry of the look's own, shape [H, L] …
        self._own = n_patterns * rates * predicted[rows, self._states]
        #: … and that which is the same for all looks but for this factor, shapes [H, W] and [L]
        self._shared = predicted
        self._share = n_patterns * (model.parameters.observation_noise / model.n_patterns)
        #: p(O, look | a), shape [L, H]
        self._joint = (predicted.sum(axis=1)[:, None] * self._share + self._own).T

    @property
    def probabilities(self) -> FloatArray:
        """Return p(look | a), shape [L]."""
        probabilities: FloatArray = self._joint.sum(axis=1)
        return probabilities

    @property
    def entropies(self) -> FloatArray:
        """Return H(O | look, a) in nats, shape [L]; 0 of an impossible look."""
        p = self.probabilities
        weighted = x_log_x(p) - x_log_x(self._joint).sum(axis=1) + self._joint[:, -1] * np.log(self._model.n_unseen)
        entropies: FloatArray = np.divide(np.maximum(weighted, 0.0), p, out=np.zeros_like(p), where=p > 0)
        return entropies

    def expected_entropies(self, looks: IntArray) -> FloatArray:
        """Return the expected entropies after each of some looks [N] and one more action, in nats, shape [N, A]."""
        model = self._model
        joint = NextPatternJoint.of(model, self._joint[looks][:, None, :], self._kept(looks), self._arrivals(looks))
        # Both sides are weighted by p(look | a): no belief is normalised.
        return expected_entropies(model, joint, self._joint[looks, -1][:, None]) / self.probabilities[looks][:, None]

    def belief(self, look: int) -> TableBeliefNode:
        """Return the belief after a look of probability above 0."""
        mass = self._share[look] * self._shared
        mass[np.arange(self._model.n_hypotheses), self._states[:, look]] += self._own[:, look]
        return TableBeliefNode(self._model, mass / mass.sum())

    def _kept(self, looks: IntArray) -> FloatArray:
        """Return the mass, with each look, that the next action's rows leave to their base, shape [N, A, H]."""
        model = self._model
        shared = np.einsum("hx,ahx->ah", self._shared, model.prior_weight)
        of_own = model.prior_weight[:, np.arange(model.n_hypotheses)[:, None], self._states[:, looks]]
        own = (of_own * self._own[:, looks]).transpose(2, 0, 1)
        kept: FloatArray = self._share[looks][:, None, None] * shared + own
        return kept

    def _arrivals(self, looks: IntArray) -> FloatArray:
        """Return the mass, with each look, that the next action's counted edges carry to each target, [N, R]."""
        model, edges = self._model, self._model.edges
        arrived: FloatArray = self._share[looks][:, None] * arrivals(model, self._shared)
        # A look's own mass is on the aspect that shows its pattern: only edges that leave this aspect carry it.
        position = np.full(len(self._share), -1)
        position[looks] = np.arange(len(looks))
        look = self._look_of[model.pattern_of[edges.hypothesis, edges.source]]
        own = self._own[edges.hypothesis, look] * model.edge_probability
        asked = position[look] >= 0
        np.add.at(arrived, (position[look[asked]], model.edge_target[asked]), own[asked])
        return arrived
