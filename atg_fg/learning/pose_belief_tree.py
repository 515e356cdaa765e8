"""The belief tree where objects may follow structures: the belief after an action and each look.

It answers as ``atg_fg.inference.belief_tree`` does for plain ATGs, from the same filters that follow the trial. What a
look would reveal of an object's contents is taken into account; nothing is counted into ATGs any more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from atg_fg.core.log_math import x_log_x
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.inference.expected_entropy import (
    counting_readings,
    next_pattern_joint,
    pattern_table,
)
from atg_fg.inference.recognition_model import RecognitionModel
from atg_fg.learning.path_filter import PathFilter
from atg_fg.learning.plain_filter import PlainFilter
from atg_fg.learning.pose_filter import PoseFilter
from atg_fg.learning.register_contents import UNIMPORTANT

if TYPE_CHECKING:
    from atg_fg.inference.kernels.compiled_filter import CompiledFilter


class Following(NamedTuple):
    """Objects of one kind.

    Attributes:
        filter: Over pose and contents, or the aspect, of each object and of *unseen*.
        belief: p(O, the object is of this kind | …), shape [H].
    """

    filter: PoseFilter | PathFilter | PlainFilter
    belief: FloatArray


class StructureBelief:
    """A belief over identity, type, present aspect or pose, and contents.

    Args:
        model: The tables in force for plain ATGs.
        plain: p(O, X_t, plain), shape [H, W].
        following: Of each structure.
        symbols: Symbols of every pattern, shape [|𝒵|, J].
    """

    def __init__(
        self, model: RecognitionModel, plain: FloatArray, following: Sequence[Following], symbols: IntArray
    ) -> None:
        self.model, self.plain, self.following, self.symbols = model, plain, following, symbols

    @property
    def _plain_identity(self) -> FloatArray:
        """p(O, plain), shape [H]."""
        total: FloatArray = self.plain.sum(axis=1)
        return total

    def _plain_joint(self, hypotheses: IntArray) -> FloatArray:
        """Return p(O = i, plain, z | a) for the next look, shape [A, I, |𝒵|]."""
        return pattern_table(self.model, next_pattern_joint(self.model, self.plain), hypotheses)

    @cached_property
    def identity(self) -> FloatArray:
        """p(O), shape [H]."""
        total = self._plain_identity
        return total + sum((each.belief for each in self.following), np.zeros(len(total)))

    @cached_property
    def _matters(self) -> IntArray:
        """Objects that are not too improbable, and last *unseen*, shape [I]."""
        matters = self.identity > UNIMPORTANT
        matters[-1] = True
        return np.flatnonzero(matters)

    @cached_property
    def joint(self) -> FloatArray:
        """J = p(O = i, z | a) for the next look, shape [A, I, |𝒵|], of objects that matter and last of *unseen*."""
        model, matters = self.model, self._matters
        if self._plain_identity.sum() > UNIMPORTANT:
            table = self._plain_joint(matters)
        else:
            table = np.zeros((model.n_actions, len(matters), model.n_patterns))
        from atg_fg.learning import prediction_kernels  # they load Numba

        for each in self.following:
            prediction_kernels.add_joint(table, matters, each.belief, *each.filter.predicted_patterns())
        return table

    def expected_entropies(self) -> FloatArray:
        """Return the expected entropy of identity after one more action (eq. 3) in nats, shape [A]."""
        from atg_fg.inference.kernels import decision_kernels  # they load Numba

        entropies: FloatArray = decision_kernels.expected_entropies_of_table(
            self.joint, float(self.identity[-1]), math.log(self.model.n_unseen)
        )
        if not self.model.objects.senses:
            return entropies
        return counting_readings(self.model, entropies, self.joint, np.ones(self.joint.shape[2]), self._matters)

    def after(self, action: int) -> StructureLooks:
        """Return what may be seen after an action."""
        return StructureLooks(self, action)


class FilteredBelief(StructureBelief):
    """The belief at present in a trial whose plain ATGs a compiled filter follows, which says what may be seen next.

    Args:
        model: The tables in force for plain ATGs.
        own: Their filter.
        belief: p(O, plain), shape [H].
        following: Of each structure.
        symbols: Symbols of every pattern, shape [|𝒵|, J].
    """

    def __init__(
        self,
        model: RecognitionModel,
        own: CompiledFilter,
        belief: FloatArray,
        following: Sequence[Following],
        symbols: IntArray,
    ) -> None:
        self.model, self.following, self.symbols = model, following, symbols
        self._own, self._belief = own, belief

    @cached_property
    def plain(self) -> FloatArray:  # type: ignore[override]
        """p(O, X_t, plain), shape [H, W]: asked for only by what looks further ahead."""
        return self._belief[:, None] * self._own.state()[1]

    @property
    def _plain_identity(self) -> FloatArray:
        return self._belief

    def _plain_joint(self, hypotheses: IntArray) -> FloatArray:
        return self._own.next_patterns(self._belief, hypotheses)


class StructureLooks:
    """The looks that an action may lead to, one a pattern.

    Args:
        before: The belief before the action.
        action: Its index.
    """

    def __init__(self, before: StructureBelief, action: int) -> None:
        self._before, self._action = before, action
        self._joint = before.joint[action]

    @property
    def probabilities(self) -> FloatArray:
        """Return p(z | a), shape [|𝒵|]."""
        probabilities: FloatArray = self._joint.sum(axis=0) / self._joint.sum()
        return probabilities

    @property
    def entropies(self) -> FloatArray:
        """Return H(O | z, a) in nats, shape [|𝒵|]; 0 of an impossible look."""
        total = self._joint.sum(axis=0)
        weighted = x_log_x(total) - x_log_x(self._joint).sum(axis=0)
        weighted += self._joint[-1] * np.log(self._before.model.n_unseen)
        entropies: FloatArray = np.divide(np.maximum(weighted, 0.0), total, out=np.zeros_like(total), where=total > 0)
        return entropies

    def expected_entropies(self, looks: IntArray) -> FloatArray:
        """Return the expected entropies after each of some looks [N] and one more action, in nats, shape [N, A]."""
        return np.array([self.belief(int(look)).expected_entropies() for look in looks])

    def belief(self, look: int) -> StructureBelief:
        """Return the belief after a look of probability above 0."""
        before, model = self._before, self._before.model
        seen = Evidence((np.arange(model.n_patterns) == look).astype(np.float64), look)
        plain = model.predict(before.plain, self._action) * model.likelihood(seen)
        following = [self._followed(each, look) for each in before.following]
        total = plain.sum() + sum(each.belief.sum() for each in following)
        return StructureBelief(
            model, plain / total, [Following(each.filter, each.belief / total) for each in following], before.symbols
        )

    def _followed(self, following: Following, look: int) -> Following:
        imagined = following.filter.copy()
        imagined.act(self._action)
        imagined.observe_pattern(self._before.symbols[look])
        possible = np.isfinite(imagined.log_evidence)  # what has been ruled out stays so
        gained = np.full(len(possible), -np.inf)
        np.subtract(imagined.log_evidence, following.filter.log_evidence, out=gained, where=possible)
        return Following(imagined, following.belief * np.exp(gained))
