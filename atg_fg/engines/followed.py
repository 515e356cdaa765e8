"""What the filters of all kinds of objects have in common in a trial: a weight of each object, and what was seen."""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from typing import Generic, Self, TypeVar

from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.inference.belief_components import BeliefComponent
from atg_fg.learning.path_filter import PathFilter
from atg_fg.learning.plain_filter import PlainFilter
from atg_fg.learning.pose_filter import PoseFilter

FilterT = TypeVar("FilterT", bound=PoseFilter | PathFilter | PlainFilter)


class Followed(ABC, Generic[FilterT]):
    """Objects of one kind in a trial.

    Args:
        words: What such objects are like.
        log_weights: ln p(O, the object is of this kind), shape [H].
        own: The filter below.

    Attributes:
        words: What such objects are like.
        filter: Over all that is not known of each object of this kind and of *unseen*.
    """

    def __init__(self, words: str, log_weights: FloatArray, own: FilterT) -> None:
        self.words, self.filter, self._log_weights = words, own, log_weights

    def weighted(self, log_weight: float) -> Self:
        """Return the same kind, a factor less probable."""
        twin = copy.copy(self)
        twin._log_weights = self._log_weights + log_weight
        return twin

    def weigh(self, log_likelihood: FloatArray) -> None:
        """Take in what was felt of the object as a whole: ln p(reading | O), shape [H]."""
        self._log_weights = self.filter.log_weights = self._log_weights + log_likelihood

    @property
    def log_joint(self) -> FloatArray:
        """Ln p(O, the object is of this kind, z_0:t | a_1:t), shape [H]."""
        return self._log_weights + self.filter.log_evidence

    @abstractmethod
    def observe(self, evidence: Evidence) -> None:
        """Take in the evidence of a look, the last of the history."""

    @abstractmethod
    def components(self, belief: FloatArray) -> list[BeliefComponent]:
        """Return the component of each probable object.

        Args:
            belief: p(O, the object is of this kind | z_0:t, a_1:t), shape [H].
        """
