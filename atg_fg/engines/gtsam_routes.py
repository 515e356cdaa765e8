"""GTSAM's own ways to marginals: a Bayes net, a Bayes tree, and ``DiscreteMarginals``.

Each question after a step makes the factor graph of the whole trial anew and eliminates it, in an ordering that can be
chosen. The cost of an ordering is the size of the largest table that it makes, ``elimination_cost``.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence
from math import prod
from typing import ClassVar, Final

import gtsam
import numpy as np

from atg_fg.core.checks import one_of
from atg_fg.core.errors import TooLargeError
from atg_fg.core.patterns import FloatArray
from atg_fg.engines.whole_trial import Posterior, WholeTrialInference, joint_of
from atg_fg.inference import gtsam_factors as factors
from atg_fg.inference.chain import Chain
from atg_fg.inference.factor_graph import RecognitionGraph
from atg_fg.inference.gtsam_factors import Ordering, aspect_key, object_key
from atg_fg.inference.interface import TrialSetup

#: Most values of an intermediate table.
MAX_TABLE: Final = 5_000_000


def _keys(order: Ordering) -> list[int]:
    return [order.at(index) for index in range(order.size())]


def _aspect_keys(graph: RecognitionGraph) -> list[int]:
    return [aspect_key(time) for time in range(graph.last + 1)]


#: Elimination orderings by name: GTSAM's two; as the variables come about, O first; and that with O last.
ORDERINGS: Final[dict[str, Callable[[RecognitionGraph], list[int]]]] = {
    "colamd": lambda graph: _keys(gtsam.Ordering.ColamdDiscreteFactorGraph(graph.graph)),
    "metis": lambda graph: _keys(gtsam.Ordering.MetisDiscreteFactorGraph(graph.graph)),
    "chronological": lambda graph: [object_key(), *_aspect_keys(graph)],
    "objects-last": lambda graph: [*_aspect_keys(graph), object_key()],
}


def elimination_cost(graph: RecognitionGraph, order: Iterable[int]) -> int:
    """Return the number of values of the largest table that eliminating variables in this order makes."""
    neighbours: dict[int, set[int]] = {}
    for index in range(graph.graph.size()):
        scope = set(graph.graph.at(index).keys())
        for key in scope:
            neighbours.setdefault(key, set()).update(scope - {key})
    largest = 0
    for key in order:
        beside = neighbours.pop(key)
        largest = max(largest, prod(graph.variable(other)[1] for other in (key, *beside)))
        for other in beside:
            neighbours[other] |= beside
            neighbours[other] -= {key, other}
    return largest


class GtsamRoute(WholeTrialInference):
    """What the routes share; a subclass says how it gets the marginals of a graph.

    GTSAM multiplies plain numbers, so in a long trial an object's weight can underflow. Where the whole graph leaves an
    object the weight zero, identity comes from each object's graph alone (``RecognitionGraph``), and its aspects from
    this route given the object. The evidence is that of ``RecognitionGraph``, object by object.
    """

    exact: ClassVar[bool] = True

    def __init__(self, setup: TrialSetup) -> None:
        super().__init__(setup)
        self.ordering = "colamd"

    @property
    def elimination_cost(self) -> int:
        """Values of the largest table that the ordering makes in the graph of the trial so far."""
        graph = self.graph()
        return elimination_cost(graph, self._order(graph))

    def graph(self) -> RecognitionGraph:
        """Return the factor graph of the trial so far, with O, X0 … Xt."""
        return RecognitionGraph(self.chain().scaled()[0], self.model.n_unseen)

    def _order(self, graph: RecognitionGraph) -> list[int]:
        return ORDERINGS[self.ordering](graph)

    def _checked_order(self, graph: RecognitionGraph, order: Sequence[int]) -> Ordering:
        cost = elimination_cost(graph, order)
        if cost > MAX_TABLE:
            raise TooLargeError(
                f"engine {self.name!r}: ordering {self.ordering!r} makes a table of {cost} values; expected at most "
                f"{MAX_TABLE}, so use another ordering"
            )
        return factors.ordering(order)

    def solve(self, chain: Chain) -> Posterior:
        """Return the posterior of a chain whose likelihoods are at most one."""
        graph = RecognitionGraph(chain, self.model.n_unseen)
        identity = np.zeros(len(chain.prior))
        if graph.is_held:
            identity, joint = self._marginals(graph)
        if not identity.all():
            identity = graph.identity().probabilities
            joint = np.zeros((len(identity), chain.widths[-1]))
            for hypothesis in np.flatnonzero(identity):
                joint[hypothesis] = self._aspects(graph.given(int(hypothesis)), [graph.last])[0]
        identity = identity / identity.sum()
        return Posterior(identity, joint_of(identity, joint), graph.log_evidence())

    def compute_smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s, from the graph given O."""
        chain = self.chain(hypothesis).scaled()[0].balanced()[0]
        graph = RecognitionGraph(chain, n_unseen=1)
        try:
            return self._aspects(graph, range(graph.last + 1))
        except RuntimeError:  # GTSAM's only sign of a product that is zero
            return [np.zeros(width) for width in chain.widths]

    @abstractmethod
    def _marginals(self, graph: RecognitionGraph) -> tuple[FloatArray, FloatArray]:
        """Return p(O), shape [H], and weights of p(X_t | O), shape [H, W_t]."""

    @abstractmethod
    def _aspects(self, graph: RecognitionGraph, times: Iterable[int]) -> list[FloatArray]:
        """Return p(X_s) for some times s in a graph with one object, each of shape [W_s]."""


class _OrderedRoute(GtsamRoute):
    """Routes that take an ordering.

    Args:
        setup: What the trial begins with.
        ordering: A name in ``ORDERINGS``.

    Raises:
        InvalidInputError: There is no such ordering.
    """

    def __init__(self, setup: TrialSetup, *, ordering: str = "objects-last") -> None:
        super().__init__(setup)
        self.ordering = one_of(ordering, "ordering", ORDERINGS)


class GtsamSequential(_OrderedRoute):
    """``eliminateSequential`` to a Bayes net, whose last conditional is p(O) and the one before it p(X_t | O).

    For that X_t and O are moved to the end of the ordering.
    """

    name: ClassVar[str] = "gtsam-sequential"

    def _order(self, graph: RecognitionGraph) -> list[int]:
        return self._with_last(graph, graph.last)

    def _with_last(self, graph: RecognitionGraph, time: int) -> list[int]:
        last = [aspect_key(time), object_key()]
        return [key for key in super()._order(graph) if key not in last] + last

    def _marginals(self, graph: RecognitionGraph) -> tuple[FloatArray, FloatArray]:
        return self._with_aspect(graph, graph.last)

    def _with_aspect(self, graph: RecognitionGraph, time: int) -> tuple[FloatArray, FloatArray]:
        net = graph.graph.eliminateSequential(self._checked_order(graph, self._with_last(graph, time)))
        size = net.size()
        objects = {object_key(): len(graph.chain.prior)}
        aspects = {**objects, aspect_key(time): graph.chain.widths[time]}
        return factors.table(net.at(size - 1), objects), factors.table(net.at(size - 2), aspects)

    def _aspects(self, graph: RecognitionGraph, times: Iterable[int]) -> list[FloatArray]:
        return [self._with_aspect(graph, time)[1][0] for time in times]


class GtsamMultifrontal(_OrderedRoute):
    """``eliminateMultifrontal`` to a Bayes tree, which gives marginals of one variable or of two."""

    name: ClassVar[str] = "gtsam-multifrontal"

    def _marginals(self, graph: RecognitionGraph) -> tuple[FloatArray, FloatArray]:
        tree = graph.graph.eliminateMultifrontal(self._checked_order(graph, self._order(graph)))
        objects, last = object_key(), aspect_key(graph.last)
        sizes = {objects: len(graph.chain.prior), last: graph.chain.widths[-1]}
        identity = factors.table(tree.marginalFactor(objects), {objects: sizes[objects]})
        return identity, factors.table(tree.joint(objects, last).product(), sizes)

    def _aspects(self, graph: RecognitionGraph, times: Iterable[int]) -> list[FloatArray]:
        tree = graph.graph.eliminateMultifrontal(self._checked_order(graph, self._order(graph)))
        sizes = {time: {aspect_key(time): graph.chain.widths[time]} for time in times}
        return [factors.table(tree.marginalFactor(aspect_key(time)), size) for time, size in sizes.items()]


class GtsamMarginals(GtsamRoute):
    """``DiscreteMarginals``, which takes no ordering (it uses COLAMD) and gives marginals of one variable alone.

    So p(X_t | O) comes from each object's graph.
    """

    name: ClassVar[str] = "gtsam-marginals"

    def _marginals(self, graph: RecognitionGraph) -> tuple[FloatArray, FloatArray]:
        marginals = graph.marginals()
        size = len(graph.chain.prior)
        identity = np.array(marginals.marginalProbabilities(graph.variable(object_key())))[:size]
        aspects = np.zeros((size, graph.chain.widths[-1]))
        for hypothesis in np.flatnonzero(identity):
            aspects[hypothesis] = self._aspects(graph.given(int(hypothesis)), [graph.last])[0]
        return identity, aspects

    def _aspects(self, graph: RecognitionGraph, times: Iterable[int]) -> list[FloatArray]:
        marginals, widths = graph.marginals(), graph.chain.widths
        variables = {time: graph.variable(aspect_key(time)) for time in times}
        found = {time: marginals.marginalProbabilities(variable) for time, variable in variables.items()}
        return [np.array(probabilities)[: widths[time]] for time, probabilities in found.items()]
