"""A Bayes filter over the aspects of plain ATGs, in the form of the filters of other kinds."""

from __future__ import annotations

import copy

import numpy as np

from atg_fg.core.actions import AnyAction, mixed
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.log_math import log_of
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.inference.expected_entropy import next_pattern_joint, pattern_table
from atg_fg.inference.history import History
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel, widened
from atg_fg.learning.register_contents import UNIMPORTANT


class PlainFilter:
    """Filters the aspect of H hypotheses, each by itself.

    Args:
        model: The tables when the trial begins; this filter's own.
        log_weights: ln of the weight of each, shape [H].

    Attributes:
        model: The tables in force.
        aspects: p(X_t | O, what was seen), shape [H, W].
        log_evidence: ln p(what was seen | O), shape [H].
    """

    def __init__(self, model: RecognitionModel, log_weights: FloatArray) -> None:
        self.model, self.log_weights = model, log_weights
        self.aspects = model.base_row
        self.log_evidence = np.zeros(model.n_hypotheses)
        self._last: Evidence | None = None

    def copy(self) -> PlainFilter:
        """Return a filter that goes on alone from here."""
        return copy.copy(self)  # all is replaced at each step rather than changed

    def act(self, action: AnyAction) -> None:
        """Take in an action."""
        before = self.aspects
        self.aspects = mixed(action, lambda index: self.model.predict(before, index), before)

    def observe(self, evidence: Evidence) -> None:
        """Take in a look."""
        joint = self.aspects * self.model.pattern_likelihood(evidence)
        given = joint.sum(axis=1)
        self.log_evidence = self.log_evidence + log_of(given)
        self.aspects = np.where(given[:, None] > 0, joint / np.where(given > 0, given, 1.0)[:, None], self.aspects)
        self._last = evidence

    def learn_from(self, history: History, time: int) -> None:
        """Let the tables learn from the look at a time of a trial, the one that was taken in last."""
        revelation = self.model.learn_from(history, time)
        if revelation is not None:
            aspects = widened(self.aspects, self.model.n_states)
            revelation.move(aspects)
            self.aspects = aspects

    def observe_pattern(self, symbols: IntArray) -> None:
        """Take in a complete look that is only imagined, and teaches nothing."""
        pattern = self.model.memory.assumptions.alphabet.index(symbols.tolist())
        self.observe(Evidence((np.arange(self.model.n_patterns) == pattern).astype(np.float64), pattern))

    def predicted_patterns(self) -> tuple[IntArray, FloatArray]:
        """Return the hypotheses that matter, [I], and p(next pattern | hypothesis, action), shape [A, I, |𝒵|]."""
        owners = self._important()
        return owners, pattern_table(self.model, next_pattern_joint(self.model, self.aspects), owners)

    def shown_patterns(self) -> tuple[IntArray, FloatArray]:
        """Return the hypotheses that matter, [I], and p(pattern shown now | hypothesis), shape [I, |𝒵|]."""
        owners, model = self._important(), self.model
        if self._last is None:
            raise InvalidInputError("shown patterns: nothing observed yet; expected a first observation")
        shown = np.zeros((len(owners), model.n_patterns))
        rows, states = np.nonzero(model.pattern_of[owners] >= 0)
        shown[rows, model.pattern_of[owners[rows], states]] = self.aspects[owners[rows], states]
        # An aspect in the collection node shows one of the patterns that the object is not known to show.
        noise = model.parameters.observation_noise
        agrees = (1.0 - noise) * self._last.likelihood + noise * self._last.likelihood.mean()
        unknown = model.lacks[owners] * agrees
        total = unknown.sum(axis=1)
        share = np.divide(self.aspects[owners, COLLECTION], total, out=np.zeros_like(total), where=total > 0)
        return owners, shown + share[:, None] * unknown

    def _important(self) -> IntArray:
        """Return the hypotheses that are not negligible beside the others."""
        logarithms = self.log_weights + self.log_evidence
        return np.flatnonzero(logarithms > logarithms.max() + np.log(UNIMPORTANT))
