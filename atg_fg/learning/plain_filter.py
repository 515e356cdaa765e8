"""A Bayes filter over the aspects of plain ATGs, in the form of the filters of other kinds."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Final

import numpy as np

from atg_fg.core.actions import AnyAction
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel
from atg_fg.learning.register_contents import UNIMPORTANT

if TYPE_CHECKING:
    from atg_fg.inference.kernels.compiled_filter import LookedAt

#: What there is to learn from a look that is only imagined.
TEACHES_NOTHING: Final = (None, None, None)


class PlainFilter:
    """Filters the aspect of H hypotheses, each by itself.

    Args:
        model: The tables when the trial begins, for what is asked of them; this filter's own.
        log_weights: ln of the weight of each, shape [H].

    Attributes:
        model: The tables in force.
    """

    def __init__(self, model: RecognitionModel, log_weights: FloatArray) -> None:
        from atg_fg.inference.kernels.compiled_filter import CompiledFilter  # it loads Numba

        self.model, self.log_weights = model, log_weights
        self._own = CompiledFilter(model.memory, model.parameters, np.ones(model.n_hypotheses))
        self._log_total = 0.0
        self._last: Evidence | None = None

    def copy(self) -> PlainFilter:
        """Return a filter that goes on alone from here, and learns nothing more."""
        twin = copy.copy(self)
        twin._own = copy.deepcopy(self._own)
        return twin

    @property
    def aspects(self) -> FloatArray:
        """p(X_t | O, what was seen), shape [H, W]."""
        return self._own.state()[1]

    @property
    def log_evidence(self) -> FloatArray:
        """Ln p(what was seen | O), shape [H]."""
        return self._own.log_identity + self._log_total

    def act(self, action: AnyAction) -> None:
        """Take in an action."""
        self._own.act(action)

    def observe(self, evidence: Evidence, seen: LookedAt = TEACHES_NOTHING) -> None:
        """Take in a look, and learn from it.

        Args:
            evidence: Of the look.
            seen: What there is to learn: the pattern before, the action since then, the pattern seen.
        """
        self._log_total += self._own.look(evidence.likelihood, seen)
        if seen != TEACHES_NOTHING:
            self.model.learn(*seen)
        self._last = evidence

    def observe_pattern(self, symbols: IntArray) -> None:
        """Take in a complete look that is only imagined, and teaches nothing."""
        pattern = self.model.memory.assumptions.alphabet.index(symbols.tolist())
        self.observe(Evidence((np.arange(self.model.n_patterns) == pattern).astype(np.float64), pattern))

    def predicted_patterns(self) -> tuple[IntArray, FloatArray]:
        """Return the hypotheses that matter, [I], and p(next pattern | hypothesis, action), shape [A, I, |𝒵|]."""
        owners = self._important()
        return owners, self._own.next_patterns(np.ones(self.model.n_hypotheses), owners)

    def shown_patterns(self) -> tuple[IntArray, FloatArray]:
        """Return the hypotheses that matter, [I], and p(pattern shown now | hypothesis), shape [I, |𝒵|]."""
        owners, model, aspects = self._important(), self.model, self.aspects
        if self._last is None:
            raise InvalidInputError("shown patterns: nothing observed yet; expected a first observation")
        shown = np.zeros((len(owners), model.n_patterns))
        rows, states = np.nonzero(model.pattern_of[owners] >= 0)
        shown[rows, model.pattern_of[owners[rows], states]] = aspects[owners[rows], states]
        # An aspect in the collection node shows one of the patterns that the object is not known to show.
        noise = model.parameters.observation_noise
        agrees = (1.0 - noise) * self._last.likelihood + noise * self._last.likelihood.mean()
        unknown = model.lacks[owners] * agrees
        total = unknown.sum(axis=1)
        share = np.divide(aspects[owners, COLLECTION], total, out=np.zeros_like(total), where=total > 0)
        return owners, shown + share[:, None] * unknown

    def _important(self) -> IntArray:
        """Return the hypotheses that are not negligible beside the others."""
        logarithms = self.log_weights + self.log_evidence
        return np.flatnonzero(logarithms > logarithms.max() + np.log(UNIMPORTANT))
