"""Plain ATGs whose actions are uncertain, in a trial, beside the plain ATGs whose are not."""

from __future__ import annotations

from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.engines.followed import Followed
from atg_fg.inference.belief_components import BeliefComponent, components_of
from atg_fg.inference.chain import Chain, build_chain, forward_backward
from atg_fg.inference.history import History
from atg_fg.inference.recognition_model import RecognitionModel
from atg_fg.learning.object_kinds import words_of_noise
from atg_fg.learning.plain_evidence import PlainNoise
from atg_fg.learning.plain_filter import PlainFilter


class FollowedPlain(Followed[PlainFilter]):
    """Plain ATGs with an α and δ of their own.

    Args:
        model: The tables when the trial begins.
        log_weights: ln p(O, the object is of this kind), shape [H].
        history: Of the trial, to learn from.

    Attributes:
        filter: Over the aspects of each object and of *unseen*.
    """

    def __init__(self, model: RecognitionModel, log_weights: FloatArray, history: History) -> None:
        self._history, parameters = history, model.parameters
        noise = PlainNoise(parameters.transition_concentration, parameters.observation_noise)
        super().__init__(words_of_noise(noise), log_weights, PlainFilter(model, log_weights))

    def observe(self, evidence: Evidence) -> None:
        """Take in the evidence of a look, the last of the history, and learn from it."""
        self.filter.observe(evidence)
        self.filter.learn_from(self._history, len(self._history.evidence) - 1)

    def components(self, belief: FloatArray) -> list[BeliefComponent]:
        """Return the component of each probable object.

        Args:
            belief: p(O, the object is of this kind | z_0:t, a_1:t), shape [H].
        """
        return components_of(self.filter.model, belief[:, None] * self.filter.aspects)

    def chain(self, hypothesis: int, history: History) -> tuple[Chain, IntArray]:
        """Return the trial under one object, and the pattern of each of its states, −1 of the collection node."""
        model = self.filter.model
        return build_chain(model.memory, model.parameters, history, [hypothesis]), model.pattern_of[hypothesis]

    def smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, all evidence) of every time s, each of shape [W_s]."""
        return forward_backward(self.chain(hypothesis, self._history)[0])
