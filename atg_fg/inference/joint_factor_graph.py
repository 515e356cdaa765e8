"""Recognition of several objects as one factor graph: a trial's graph for each, and one factor that says they differ.

    Π_k [ p(O_k) · p(X_k,0 | O_k) · Π_s p(X_k,s | X_k,s-1, a_k,s, O_k) · Π_s p(z_k,s | X_k,s, O_k) ] · ψ(O_1, …, O_n)

ψ is zero if two objects are the same remembered one, and the share of different choices out of the unseen objects where
several are unseen, so that p(O_1) … p(O_n) ψ is uniform over the ways to be different objects (``docs/model.md``).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any, Final

import gtsam
import numpy as np

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.log_math import log_of, log_sum_exp
from atg_fg.core.patterns import FloatArray
from atg_fg.inference import gtsam_factors as factors
from atg_fg.inference.all_different import all_different_table
from atg_fg.inference.chain import Chain
from atg_fg.inference.factor_graph import RecognitionGraph, impossible
from atg_fg.inference.factor_graph_svg import recognition_svg
from atg_fg.inference.gtsam_factors import FactorGraph, key_name

#: Least product of probabilities of the objects that GTSAM's plain numbers still hold, with the factor, as a logarithm.
_LEAST_LOG_PRODUCT: Final = -600.0


class JointRecognitionGraph:
    """The factor graph of the trials of n objects that are all different.

    Object ``which`` of the arguments has the variable O_{which + 1}.

    Args:
        chains: The tables of each object's trial; all from the same memory.
        n_unseen: U, how many objects the state *unseen* stands for.

    Attributes:
        graph: The ``gtsam.DiscreteFactorGraph``.
        trials: The part of it that is about each object.

    Raises:
        InvalidInputError: There is no chain, or they are of different memories.
        TooLargeError: The factor on all objects would have too many entries (``all_different_table``).
    """

    def __init__(self, chains: Sequence[Chain], n_unseen: int) -> None:
        n_states = {len(chain.prior) for chain in chains}
        if len(n_states) != 1 or n_unseen < 1:
            raise InvalidInputError(
                f"factor graph: {len(chains)} chains with states of O {sorted(n_states)}, {n_unseen} unseen objects; "
                "expected at least one of each, and one number of states"
            )
        self.n_unseen = n_unseen
        self.trials = [RecognitionGraph(chain, n_unseen, number) for number, chain in enumerate(chains, start=1)]
        self.graph: FactorGraph = gtsam.DiscreteFactorGraph()
        for trial in self.trials:
            self.graph.push_back(trial.graph)
        self._different = all_different_table(len(chains), n_states.pop() - 1, n_unseen)
        self.graph.push_back(factors.factor(self._object_keys, self._different))

    @property
    def _object_keys(self) -> list[int]:
        return [trial.object_key for trial in self.trials]

    def identities(self) -> list[IdentityBelief]:
        """p(O_k | all evidence) of each object.

        Raises:
            ImpossibleEvidenceError: The evidence of an object, or of all of them together, has probability zero.
        """
        alone = [trial.identity() for trial in self.trials]
        # If all objects are almost certainly the same one, the other assignments may be too small for GTSAM's numbers.
        least = sum(float(log_of(belief.probabilities).min()) for belief in alone)
        marginals = self._marginals_by_elimination() if least > _LEAST_LOG_PRODUCT else self._marginals_of_logarithms()
        return [IdentityBelief.of(marginal, self.n_unseen) for marginal in marginals]

    def _marginals_by_elimination(self) -> list[FloatArray]:
        """Return p(O_k), each of shape [H]: the aspects are eliminated first, and O_k last."""
        aspects = [trial.aspect_key(time) for trial in self.trials for time in range(trial.last + 1)]
        _, left = self.graph.eliminatePartialSequential(factors.ordering(aspects))
        marginals = []
        for trial in self.trials:
            key, n_states = trial.object_key, len(trial.chain.prior)
            others = [other for other in self._object_keys if other != key]
            try:
                net = left.sumProduct(factors.ordering([*others, key]))
            except RuntimeError as error:
                raise impossible() from error
            marginal = net.at(net.size() - 1)
            weights = np.array([marginal(factors.assigned({key: state})) for state in range(n_states)])
            marginals.append(weights / weights.sum())
        return marginals

    def _marginals_of_logarithms(self) -> list[FloatArray]:
        """Return p(O_k), each of shape [H], from ``_log_joint``."""
        logarithms = self._log_joint([trial.log_joint() for trial in self.trials])
        if not np.isfinite(logarithms.max()):
            raise impossible()
        weights = np.exp(logarithms - log_sum_exp(logarithms))
        axes = range(weights.ndim)
        return [weights.sum(axis=tuple(other for other in axes if other != axis)) for axis in axes]

    def _log_joint(self, log_weights: list[FloatArray]) -> FloatArray:
        """Return the logarithm of the factor times weights of each object, shape [H] · n."""
        together: FloatArray = reduce(np.add.outer, log_weights) + log_of(self._different)
        return together

    def log_evidence(self) -> float:
        """Return ln p(z of all objects | a), given that they are all different.

        Raises:
            ImpossibleEvidenceError: The evidence of an object, or of all of them together, has probability zero.
        """
        log_joints = [trial.log_joint() for trial in self.trials]
        log_evidence = log_sum_exp(self._log_joint(log_joints))
        if not np.isfinite(log_evidence):
            raise impossible()
        return log_evidence - log_sum_exp(self._log_joint([log_of(trial.chain.prior) for trial in self.trials]))

    def aspect_marginal(self, which: int, time: int) -> FloatArray:
        """p(O, X_time | all evidence) of object ``which``, shape [H, W_time].

        Its aspects have to do with the other objects through O alone, so this is p(O | all evidence) p(X_time | O).

        Raises:
            InvalidInputError: There is no such object, or no such time in its trial.
            ImpossibleEvidenceError: The evidence of an object, or of all of them together, has probability zero.
        """
        if not 0 <= which < len(self.trials):
            raise InvalidInputError(f"object: {which!r}; expected 0 to {len(self.trials) - 1}")
        trial = self.trials[which]
        if not 0 <= time <= trial.last:
            raise InvalidInputError(f"time: {time!r}; expected 0 to {trial.last}")
        identity = self.identities()[which].probabilities
        joint = np.zeros((len(identity), trial.chain.widths[time]))
        for hypothesis in np.flatnonzero(identity):
            joint[hypothesis] = identity[hypothesis] * trial.given(int(hypothesis)).aspect_marginal(time)[0]
        return joint

    def marginals(self) -> Any:
        """Return GTSAM's own ``DiscreteMarginals`` of this graph; ask it with ``variable`` of a trial in ``trials``."""
        return gtsam.DiscreteMarginals(self.graph)

    def dot(self) -> str:
        """Return the graph in DOT, with its variables named O1, X1,0, X1,1, …, O2 and so on."""
        return str(self.graph.dot(key_name))

    def _repr_html_(self) -> str:
        names = [factors.names_in(self.graph.at(index)) for index in range(self.graph.size())]
        return recognition_svg([trial.row_names() for trial in self.trials], names)

    def __repr__(self) -> str:
        names = ", ".join(key_name(key) for key in self._object_keys)
        n_aspects = sum(trial.last + 1 for trial in self.trials)
        return f"JointRecognitionGraph({names}; {n_aspects} aspects; {self.graph.size()} factors)"
