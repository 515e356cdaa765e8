"""A particle filter over (O, X_t), with the locally optimal proposal and systematic resampling."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from atg_fg.core.actions import AnyAction
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.checks import whole_number
from atg_fg.core.log_math import log_of, log_sum_exp
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.engines.sampling import drawn
from atg_fg.engines.support import SupportedInference
from atg_fg.inference.chain import build_chain, forward_pass
from atg_fg.inference.history import History
from atg_fg.inference.interface import TrialSetup
from atg_fg.inference.recognition_model import COLLECTION, Revelation


class ParticleFilter(SupportedInference):
    """Particles (o, x_t) with weights.

    A particle moves when the look that follows an action is taken in: to an aspect drawn from p(x_t | x_{t-1}, a_t,
    z_t, o), and its weight is multiplied by p(z_t | x_{t-1}, a_t, o). The first particles are drawn from p(O, X_0 |
    z_0). When the effective sample size falls under half the particles, they are resampled systematically. O never
    changes in a particle, so an object that has lost all of its particles is gone. If no particle is left that could
    show what the model can, all are drawn anew from the exact p(O, X_t | z_0:t), found from the whole trial, and
    ``rejuvenations`` counts it.

    The evidence is the usual estimate, the product of the mean weights, which is unbiased but for rejuvenation.
    Smoothed aspects are exact, by forward-backward given O: ancestral lines of a particle filter are too few.

    Args:
        setup: What the trial begins with.
        n_particles: Number of particles.
        seed: Seed of the filter's own generator.

    Attributes:
        objects: o of each particle, shape [n]; empty before the first look.
        aspects: x_t of each particle, shape [n].
        weights: Weight of each particle, summing to one, shape [n].
        rejuvenations: How often all particles were drawn anew.

    Raises:
        InvalidInputError: An option has a value that it cannot take.
    """

    name: ClassVar[str] = "particle"
    exact: ClassVar[bool] = False
    scaled_log_evidence: float = 0.0

    def __init__(self, setup: TrialSetup, *, n_particles: int = 2000, seed: int = 0) -> None:
        super().__init__(setup)
        self.n_particles = whole_number(n_particles, "n_particles", 1)
        self._rng = np.random.default_rng(whole_number(seed, "seed", 0))
        self.objects: IntArray = np.zeros(0, dtype=np.int64)
        self.aspects: IntArray = np.zeros(0, dtype=np.int64)
        self.weights: FloatArray = np.zeros(0)
        self.rejuvenations = 0
        self._transition: FloatArray | None = None

    @property
    def effective_sample_size(self) -> float:
        """1 / Σ w², the number of equal weights that would estimate as well; n before the first look."""
        return float(1.0 / np.square(self.weights).sum()) if len(self.weights) else float(self.n_particles)

    def identity(self) -> IdentityBelief:
        """Return the weight of each object's particles; before the first look the prior."""
        probabilities: FloatArray = self.model.prior
        if len(self.weights):
            probabilities = np.bincount(self.objects, self.weights, self.model.n_hypotheses).astype(np.float64)
        return IdentityBelief.of(probabilities, self.model.n_unseen)

    @property
    def aspect_belief(self) -> FloatArray:
        """The weight of the particles at each (O, X_t), shape [H, W]; after an action, where they are about to go."""
        if not len(self.weights):
            return super().aspect_belief
        mass = np.zeros((self.model.n_hypotheses, self.model.n_states))
        np.add.at(mass, (self.objects, self.aspects), self.weights)
        if self._transition is None or not self.history.awaits_evidence:
            return mass
        predicted: FloatArray = np.matmul(mass[:, None, :], self._transition)[:, 0, :]
        return predicted

    def update(self, evidence: Evidence) -> None:
        """Condition on a look, the last of ``history``, and learn from it."""
        likelihood = self.model.likelihood(evidence)
        self._check_possible(likelihood)
        self._condition(likelihood)
        revelation = self.learn_from_look()
        if revelation is not None:
            self._divide(revelation)

    def _condition(self, likelihood: FloatArray) -> None:
        if self._transition is None:
            self._draw(self.model.prior[:, None] * self.model.base_row * (likelihood / likelihood.max()))
            self.scaled_log_evidence += float(np.log(likelihood.max()))
            return
        # p(x_t, z_t | x_{t-1}, a_t, o) of every state, shape [H, W, W]
        greatest = likelihood.max()
        proposal = self._transition * (likelihood / greatest)[:, None, :]
        weights = self.weights * proposal.sum(axis=2)[self.objects, self.aspects]
        total = weights.sum()
        if not total > 0:
            self._rejuvenate(likelihood)
            return
        self.scaled_log_evidence += float(np.log(total) + np.log(greatest))
        alive = weights > 0
        rows = proposal[self.objects[alive], self.aspects[alive]]
        aspects = self.aspects.copy()
        aspects[alive] = drawn(rows, self._rng)
        self.aspects = aspects
        self.weights = weights / total
        if self.effective_sample_size < self.n_particles / 2:
            self._resample()

    def _divide(self, revelation: Revelation) -> None:
        """Move each particle at a collection node to the aspect just found with the probability of its share."""
        share = np.zeros(self.model.n_hypotheses)
        state = np.zeros(self.model.n_hypotheses, dtype=np.int64)
        share[revelation.hypotheses], state[revelation.hypotheses] = revelation.shares, revelation.states
        chance = self._rng.random(self.n_particles)
        moves = (self.aspects == COLLECTION) & (chance < share[self.objects])
        self.aspects = np.where(moves, state[self.objects], self.aspects)

    def predict(self, action: AnyAction) -> None:
        """Predict the effect of an action, the last of ``history``."""
        self._transition = self._predict_support(action)

    def _draw(self, mass: FloatArray) -> None:
        """Draw all particles from weights of (O, X_t), shape [H, W], and count their sum as evidence."""
        total = mass.sum()
        cells = self._rng.choice(mass.size, self.n_particles, p=mass.ravel() / total)
        self.objects, self.aspects = (index.astype(np.int64) for index in np.unravel_index(cells, mass.shape))
        self.weights = np.full(self.n_particles, 1.0 / self.n_particles)
        self.scaled_log_evidence += float(np.log(total))

    def _rejuvenate(self, likelihood: FloatArray) -> None:
        """Draw all particles anew from the exact one-step prior times the likelihood."""
        before = History(self.history.evidence[:-1], self.history.actions)
        chain, _ = build_chain(self.memory, self.parameters, before, prior=self.prior).scaled()
        past = forward_pass(chain)
        # Only differences count, and those of an object below the least float would not be drawn anyway; with the
        # likelihood inside the logarithm the greatest of them is 1.
        log_prior = past.log_joint - log_sum_exp(past.log_joint)
        given = past.filtered[-1] * likelihood
        total = given.sum(axis=1)
        logarithms = log_prior + log_of(total)
        log_probability = log_sum_exp(logarithms)
        self._draw(np.exp(logarithms - log_probability)[:, None] * given / np.where(total > 0, total, 1.0)[:, None])
        self.scaled_log_evidence += log_probability
        self.rejuvenations += 1

    def _resample(self) -> None:
        """Draw the particles anew with one random number: systematic resampling."""
        positions = (np.arange(self.n_particles) + self._rng.random()) / self.n_particles
        cumulative = np.cumsum(self.weights)
        chosen = np.searchsorted(cumulative / cumulative[-1], positions, side="right")
        self.objects, self.aspects = self.objects[chosen], self.aspects[chosen]
        self.weights = np.full(self.n_particles, 1.0 / self.n_particles)
