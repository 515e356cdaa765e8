"""Recognition as a factor graph: O, X_0 … X_t, and a factor for all that is known of them.

    p(O) · p(X_0 | O) · Π_s p(X_s | X_{s-1}, a_s, O) · Π_s p(z_s | X_s, O)

and, where the robot feels something of the object as a whole, such as its weight, a factor on O alone for each reading.
What the paper calls the Bayes filter is a marginal of this graph, and its expected entropy (eq. 3) is that of the graph
with one more action and one more observation added as factors.
"""

from __future__ import annotations

import contextlib
from dataclasses import replace
from typing import Any

import gtsam
import numpy as np

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.checks import instance, whole_number
from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.log_math import log_sum_exp
from atg_fg.core.patterns import FloatArray
from atg_fg.inference import gtsam_factors as factors
from atg_fg.inference.chain import LN_LEAST, Chain, forward_pass
from atg_fg.inference.factor_graph_svg import recognition_svg
from atg_fg.inference.gtsam_factors import FactorGraph, key_name


class RecognitionGraph:
    """The factor graph of one trial.

    Args:
        chain: The trial's tables.
        n_unseen: U, how many objects the state *unseen* stands for.
        number: Number of the object if it is one of several, from 1; it goes into the names of the variables.
        log_scale: ln of what the likelihoods were divided by.

    Attributes:
        graph: The ``gtsam.DiscreteFactorGraph``.
        chain: The tables of its factors.
    """

    def __init__(self, chain: Chain, n_unseen: int, number: int = 0, log_scale: float = 0.0) -> None:
        self.chain = instance(chain, "chain", Chain)
        self.n_unseen = whole_number(n_unseen, "n_unseen")
        self.number = number
        self.log_scale = log_scale
        self.graph: FactorGraph = gtsam.DiscreteFactorGraph()
        self._add([self.object_key], chain.prior)
        self._add([self.object_key, self.aspect_key(0)], chain.initial)
        for time, transition in enumerate(chain.transitions, start=1):
            self._add([self.object_key, self.aspect_key(time - 1), self.aspect_key(time)], transition)
        for time, likelihood in enumerate(chain.likelihoods):
            self._add([self.object_key, self.aspect_key(time)], likelihood)
        for _, table in chain.objects:
            self._add([self.object_key], table)

    def _add(self, keys: list[int], table: FloatArray) -> None:
        self.graph.push_back(factors.factor(keys, table))

    @property
    def object_key(self) -> int:
        """Key of the object variable."""
        return factors.object_key(self.number)

    def aspect_key(self, time: int) -> int:
        """Key of the aspect variable X_time."""
        return factors.aspect_key(time, self.number)

    @property
    def last(self) -> int:
        """Time t of the last aspect variable."""
        return len(self.chain.transitions)

    def act(self, transition: FloatArray) -> None:
        """Add X_{t+1} and the action's factor p(X_{t+1} | X_t, a, O), shape [H, W_t, W_{t+1}]."""
        self._add([self.object_key, self.aspect_key(self.last), self.aspect_key(self.last + 1)], transition)
        self.chain = replace(self.chain, transitions=(*self.chain.transitions, transition))

    def observe(self, likelihood: FloatArray, felt: FloatArray | None = None) -> None:
        """Add the factor p(z_t | X_t, O), shape [H, W_t], of evidence about the last aspect.

        Args:
            likelihood: The factor.
            felt: p(what was felt of the object | O, what was felt before), shape [H]: a factor on O alone.

        Raises:
            InvalidInputError: There is evidence about it already.
        """
        if len(self.chain.likelihoods) > self.last:
            raise InvalidInputError(f"factor graph: X{self.last} is observed already; expected an action first")
        self._add([self.object_key, self.aspect_key(self.last)], likelihood)
        self.chain = replace(self.chain, likelihoods=(*self.chain.likelihoods, likelihood))
        if felt is not None:
            self._add([self.object_key], felt)
            self.chain = replace(self.chain, objects=(*self.chain.objects, (self.last, felt)))

    def copy(self) -> RecognitionGraph:
        """Return a graph that shares these factors and can be added to alone."""
        twin = RecognitionGraph.__new__(RecognitionGraph)
        twin.chain, twin.n_unseen, twin.number, twin.log_scale = self.chain, self.n_unseen, self.number, self.log_scale
        twin.graph = gtsam.DiscreteFactorGraph()
        twin.graph.push_back(self.graph)
        return twin

    def given(self, hypothesis: int) -> RecognitionGraph:
        """Return the graph under one state of O alone; its evidence is p(O = hypothesis, z_0:t | a_1:t).

        Its likelihoods are scaled where their product would be too small a number (``Chain.balanced``).
        """
        alone, log_scale = self.chain.given(hypothesis).balanced()
        return RecognitionGraph(alone, self.n_unseen, self.number, self.log_scale + log_scale)

    @property
    def is_held(self) -> bool:
        """Whether plain numbers hold the weight of some object; if not, each object is asked alone."""
        return bool(forward_pass(self.chain).log_joint.max() > LN_LEAST)

    def eliminate(self) -> Any:
        """Return the Bayes net p(O) Π p(X_s | X_{s+1}, O) left by eliminating X_0, …, X_t and then O.

        Raises:
            ImpossibleEvidenceError: The evidence has probability zero.
        """
        # O is eliminated last: earlier it would couple all aspect variables, in a table that grows with every step.
        order = factors.ordering([*map(self.aspect_key, range(self.last + 1)), self.object_key])
        try:
            return self.graph.sumProduct(order)
        except RuntimeError as error:
            raise impossible() from error

    def identity(self) -> IdentityBelief:
        """p(O | z_0:t, a_1:t) (eq. 1 and 2): the marginal of O, which elimination leaves for last."""
        weights = np.zeros(len(self.chain.prior))
        if self.is_held:
            net = self.eliminate()
            marginal = net.at(net.size() - 1)
            weights = np.array([marginal(factors.assigned({self.object_key: state})) for state in range(len(weights))])
        if not weights.all():
            logarithms = self.log_joint()
            weights = np.exp(logarithms - logarithms.max())
        return IdentityBelief.of(weights / weights.sum(), self.n_unseen)

    def log_joint(self) -> FloatArray:
        """Return ln p(O, z_0:t | a_1:t), shape [H]; −∞ where an object is ruled out.

        GTSAM multiplies plain numbers. In a long trial the weight of an object can fall below the least of them and
        be zero from there on, however well the object explains what comes after. So where elimination of the whole
        graph leaves a zero, each object is eliminated alone, and their evidence is compared as logarithms.

        Raises:
            ImpossibleEvidenceError: The evidence has probability zero.
        """
        logarithms = np.full(len(self.chain.prior), -np.inf)
        for hypothesis in range(len(logarithms)):
            with contextlib.suppress(ImpossibleEvidenceError):
                alone = self.given(hypothesis)
                logarithms[hypothesis] = alone._log_evidence_of(alone.eliminate())
        if not np.isfinite(logarithms.max()):
            raise impossible()
        return logarithms

    def novelty(self) -> float:
        """p(O unseen | z_0:t, a_1:t) (eq. 1)."""
        return self.identity().unseen

    def log_evidence(self) -> float:
        """Return ln p(z_0:t | a_1:t).

        Raises:
            ImpossibleEvidenceError: The evidence has probability zero.
        """
        return log_sum_exp(self.log_joint())

    def _log_evidence_of(self, net: Any) -> float:
        """Return ln p(z) by the chain rule: any explanation's ln joint less its ln posterior in ``net``."""
        explanation = net.sample(gtsam.MT19937(0))
        log_joint = sum(np.log(self.graph.at(index)(explanation)) for index in range(self.graph.size()))
        return float(log_joint - net.logProbability(explanation)) + self.log_scale

    def aspect_marginal(self, time: int) -> FloatArray:
        """p(O, X_time | z_0:t, a_1:t), shape [H, W_time]: filtered for the last time, smoothed before it.

        Raises:
            InvalidInputError: There is no such time in this trial.
            ImpossibleEvidenceError: The evidence has probability zero.
        """
        if not 0 <= time <= self.last:
            raise InvalidInputError(f"time: {time!r}; expected 0 to {self.last}")
        joint = self._aspect(time) if self.is_held else np.zeros((len(self.chain.prior), self.chain.widths[time]))
        if not joint.any(axis=1).all():
            # As in ``identity``, a zero may be a number that is too small; so each object is asked alone.
            weights = self.identity().probabilities
            for hypothesis in np.flatnonzero(weights):
                alone = self.given(int(hypothesis))._aspect(time)[0]
                joint[hypothesis] = weights[hypothesis] * alone / alone.sum()
        marginal: FloatArray = joint / joint.sum()
        return marginal

    def _aspect(self, time: int) -> FloatArray:
        """Return p(O, X_time, z_0:t | a_1:t) up to a factor, shape [H, W_time], by elimination alone."""
        # The order goes inwards from both ends of the chain, so no table holds more than O and two aspects.
        inwards = [*range(time), *range(self.last, time, -1)]
        sizes = {self.object_key: len(self.chain.prior), self.aspect_key(time): self.chain.widths[time]}
        try:
            _, left = self.graph.eliminatePartialSequential(factors.ordering(map(self.aspect_key, inwards)))
            return factors.table(left.product(), sizes)
        except RuntimeError as error:
            raise impossible() from error

    def marginals(self) -> Any:
        """Return GTSAM's own ``DiscreteMarginals`` of this graph; ask it with ``variable``."""
        return gtsam.DiscreteMarginals(self.graph)

    def variable(self, key: int) -> tuple[int, int]:
        """Return a variable's (key, cardinality), which is what GTSAM calls a discrete key."""
        if key == self.object_key:
            return key, factors.cardinality(len(self.chain.prior))
        return key, factors.cardinality(self.chain.widths[self.aspect_key(0) - key])

    def expected_entropy_by_elimination(self, transition: FloatArray, observations: FloatArray) -> float:
        """Expected entropy (eq. 3) of one action the straightforward way: a graph for every pattern, each eliminated.

        Args:
            transition: The hypothetical action's p(X_{t+1} | X_t, a, O), shape [H, W, W].
            observations: p(z | X_{t+1}, O) of every pattern, shape [|𝒵|, H, W].
        """
        acted = self.copy()
        acted.act(transition)
        log_evidence = self.log_evidence()
        expected = 0.0
        for observation in observations:
            hypothetical = acted.copy()
            hypothetical.observe(observation)
            try:
                probability = np.exp(hypothetical.log_evidence() - log_evidence)
            except ImpossibleEvidenceError:
                continue
            expected += probability * hypothetical.identity().entropy
        return float(expected)

    def dot(self) -> str:
        """Return the graph in DOT, with its variables named O, X0, X1 and so on."""
        return str(self.graph.dot(key_name))

    def _repr_html_(self) -> str:
        return recognition_svg([self.row_names()], [self.names_of(index) for index in range(self.graph.size())])

    def names_of(self, index: int) -> tuple[str, ...]:
        """Return the names of the variables of the factor with this index."""
        return factors.names_in(self.graph.at(index))

    def row_names(self) -> list[str]:
        """Return the names of all variables: O, X0 … Xt."""
        return [key_name(self.object_key), *(key_name(self.aspect_key(time)) for time in range(self.last + 1))]

    def __repr__(self) -> str:
        names = self.row_names()
        return f"RecognitionGraph({names[0]}, {names[1]} … {names[-1]}; {self.graph.size()} factors)"


def impossible() -> ImpossibleEvidenceError:
    """Return the error for evidence that a factor graph gives probability zero."""
    return ImpossibleEvidenceError("factor graph: the evidence has probability zero under the model")
