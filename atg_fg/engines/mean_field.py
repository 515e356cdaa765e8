"""Mean field: a filter whose belief is a product q(O) q(X_t), as in many active-inference packages.

Each step takes q(O) q(X_{t-1}) for its prior and pushes it through the transition, so its joint weights are

    J(o, x) = q(o) Σ_x' q(x') p(x | x', a_t, o) · p(z_t | x, o)

and the new q(O) q(X_t) minimises the variational free energy F = Σ q(o) q(x) ln (q(o) q(x) / J(o, x)) by coordinate
ascent on −F. What O and X_t tell of each other is lost in every step: states have the same number in all objects and
not the same meaning. The engine is here to show this bias.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.checks import number, whole_number
from atg_fg.core.log_math import log_sum_exp, x_log_x
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.engines.support import SupportedInference
from atg_fg.inference.interface import TrialSetup


class MeanFieldReport(NamedTuple):
    """How the last look was taken in.

    Attributes:
        iterations: Sweeps over q(O) and q(X_t).
        converged: Whether the last sweep lowered the free energy by no more than the tolerance.
        free_energies: F before the first sweep and after each, in nats; it never rises.
        surprise: −ln Σ J, which F would come down to if O and X_t were independent.
    """

    iterations: int
    converged: bool
    free_energies: tuple[float, ...]
    surprise: float

    @property
    def free_energy(self) -> float:
        """F at the end, in nats."""
        return self.free_energies[-1]


class MeanField(SupportedInference):
    """Coordinate ascent on q(O) q(X_t), look by look.

    The evidence is that of the evidence lower bound, −Σ F over the looks. After the first look it is a lower bound of
    ln p(z_0); later it bounds the evidence of a model that takes each q(O) q(X_t) for its prior, and so nothing of the
    true one. The logarithm of J has a floor: what is less than ``floor`` times the greatest J, zeros too, counts as so
    much. So an object that is ruled out keeps a probability above zero. Where learning within the trial divides a
    collection node's belief, q(X_t) becomes the marginal of what results. Smoothed aspects are exact, by
    forward-backward given O, since a filter has none.

    Args:
        setup: What the trial begins with.
        floor: Least J that a logarithm is taken of, relative to the greatest.
        max_iterations: Most sweeps a look.
        tolerance: Fall of the free energy in nats that counts as none.

    Attributes:
        objects: q(O), shape [H].
        aspects: q(X_t), shape [W]; before the first look p(X_0) with O summed out.
        report: How the last look was taken in; ``None`` before the first.

    Raises:
        InvalidInputError: An option has a value that it cannot take.
    """

    name: ClassVar[str] = "mean-field"
    exact: ClassVar[bool] = False
    scaled_log_evidence: float = 0.0

    def __init__(
        self, setup: TrialSetup, *, floor: float = 1e-16, max_iterations: int = 200, tolerance: float = 1e-10
    ) -> None:
        super().__init__(setup)
        self.floor = number(floor, "floor", 1e-300, below=1e-3)
        self.max_iterations = whole_number(max_iterations, "max_iterations", 1)
        self.tolerance = number(tolerance, "tolerance", 0.0, below=1.0)
        self.objects: FloatArray = self.model.prior
        self.aspects: FloatArray = self.model.prior @ self.model.base_row
        self.report: MeanFieldReport | None = None
        # p(O, X_t) as the next look finds it, shape [H, W]
        self._predicted: FloatArray = self.model.prior[:, None] * self.model.base_row

    def identity(self) -> IdentityBelief:
        """Return q(O)."""
        return IdentityBelief.of(self.objects, self.model.n_unseen)

    @property
    def aspect_belief(self) -> FloatArray:
        """q(O) q(X_t), shape [H, W]; after an action, what the next look finds."""
        return self._predicted.copy() if self.history.awaits_evidence else np.outer(self.objects, self.aspects)

    def update(self, evidence: Evidence) -> None:
        """Condition on a look, the last of ``history``, and learn from it."""
        likelihood = self.model.likelihood(evidence)
        self._check_possible(likelihood)
        # Only the greatest weight matters for the floor, so evidence on any scale is brought to one.
        scale = float(likelihood.max())
        weights = self._predicted * (likelihood / scale)
        self.objects, self.aspects, self.report = factorised(
            weights, self.floor, max_iterations=self.max_iterations, tolerance=self.tolerance
        )
        self.scaled_log_evidence += float(np.log(scale)) - self.report.free_energy
        revelation = self.learn_from_look()
        if revelation is not None:
            mass = np.outer(self.objects, self.aspects)
            mass = np.pad(mass, ((0, 0), (0, self.model.n_states - mass.shape[1])))
            revelation.move(mass)
            self.aspects = mass.sum(axis=0)

    def predict(self, action: AnyAction) -> None:
        """Predict the effect of an action, the last of ``history``."""
        self._predicted = self.objects[:, None] * (self.aspects @ self._predict_support(action))


def factorised(
    weights: FloatArray, floor: float, *, max_iterations: int, tolerance: float
) -> tuple[FloatArray, FloatArray, MeanFieldReport]:
    """Return the product q(O) q(X) that is nearest to joint weights in free energy, and how it was found.

    Coordinate ascent begins at the marginals of the weights, so it finds the optimum nearest to these.

    Args:
        weights: J, not all zero, shape [H, W].
        floor: Least J that a logarithm is taken of, relative to the greatest.
        max_iterations: Most sweeps.
        tolerance: Fall of the free energy in nats that ends the sweeps.
    """
    total = weights.sum()
    logarithms = np.log(np.maximum(weights, floor * weights.max()))
    objects, aspects = weights.sum(axis=1) / total, weights.sum(axis=0) / total
    energies = [_free_energy(objects, aspects, logarithms)]
    converged = False
    while not converged and len(energies) <= max_iterations:
        objects = _softmax(logarithms @ aspects)
        aspects = _softmax(objects @ logarithms)
        energies.append(_free_energy(objects, aspects, logarithms))
        converged = energies[-2] - energies[-1] <= tolerance
    report = MeanFieldReport(len(energies) - 1, converged, tuple(energies), surprise=-float(np.log(total)))
    return objects, aspects, report


def _free_energy(objects: FloatArray, aspects: FloatArray, logarithms: FloatArray) -> float:
    return float(x_log_x(objects).sum() + x_log_x(aspects).sum() - objects @ logarithms @ aspects)


def _softmax(logarithms: FloatArray) -> FloatArray:
    probabilities: FloatArray = np.exp(logarithms - log_sum_exp(logarithms))
    return probabilities
