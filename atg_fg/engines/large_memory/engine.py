"""Recognition among a hundred thousand remembered objects: exact where a pattern matched, bounded elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction, UncertainAction
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.checks import whole_number
from atg_fg.core.compact.compact_memory import CompactMemory, GraphArrays
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.log_math import log_sum_exp
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.engines.large_memory.aspect_filter import AspectFilter
from atg_fg.engines.large_memory.decision import by_class, entropy_bound, expected_entropies, is_decided
from atg_fg.engines.large_memory.never_matched import ClassMasses, NeverMatched
from atg_fg.engines.tables_on_demand import MAX_CELLS, TablesOnDemand
from atg_fg.inference.chain import build_chain, forward_backward
from atg_fg.inference.history import History
from atg_fg.inference.interface import Inference, TrialSetup

if TYPE_CHECKING:
    from atg_fg.engines.large_memory.matched_rows import MatchedRows


class Decision(NamedTuple):
    """Expected entropies [A] in nats, how far each may be off, and whether they had to be computed of all objects."""

    expected: FloatArray
    bound: float
    fell_back: bool


class LargeMemory(Inference):
    """Filters the objects that know a pattern seen so far one by one, and all others in classes of equal size.

    An object that matches for the first time is taken through the trial again, by its own edges; from there on its
    belief is exact. Of the others only bounds of their weights are known, which differ by the order of δ. So a step
    costs what the matches cost. ``total_variation_bound`` says how far p(O) may be from exact; where the bound leaves
    open which action is the best one, expected entropy is computed of all objects. ``docs/large_memories.md`` has the
    derivation.

    Tables over all objects and patterns are not made. What needs them (components of the belief, the belief tree, the
    whole chain) raises ``TooLargeError`` where they would be too large.

    Args:
        memory: The robot memory when the trial begins; it must not change while the trial goes on. Any but a
            ``CompactMemory`` is made into one first, which takes time.
        parameters: α, δ and whether to learn within the trial.
        prior: p(O) when the trial begins; the memory's if not given. If it is not the same for all remembered objects,
            all are filtered one by one.
        n_exact: Up to so many objects are all filtered one by one, which is exact.

    Raises:
        InvalidInputError: An option has a value that it cannot take, the prior is no distribution over the objects, or
            there are senses of the object: what is felt would tell those of a class apart.
    """

    name: ClassVar[str] = "large-memory"
    exact: ClassVar[bool] = False
    takes_uncertain_actions: ClassVar[bool] = False

    def __init__(self, setup: TrialSetup, *, n_exact: int = 100) -> None:
        super().__init__(setup)
        for sense in self.memory.assumptions.object_senses:
            raise InvalidInputError(f"engine 'large-memory': senses of the object, {sense.name!r}; expected none")
        few = len(self.memory) <= whole_number(n_exact, "n_exact", 0)
        of_objects = self.model.prior[:-1]
        self._compact = CompactMemory.of(self.memory)
        self._log_total = 0.0
        self._decision: Decision | None = None
        self._all: MatchedRows | None = None
        self._n_followed = 0
        self._classes: NeverMatched | None = None
        #: index of the object in each row of ``_matched`` but the first, which is *unseen*
        self._objects: IntArray = np.arange(len(self.memory))
        if few or not (of_objects > 0).all() or (of_objects != of_objects[0]).any():
            self._matched = self._filter_of(self._objects, unseen=True)
            return
        self._objects = self._objects[:0]
        self._matched = self._filter_of(self._objects, unseen=True)
        self._classes = NeverMatched(self._compact, self.parameters, float(np.log(of_objects[0])))
        self._is_matched = np.zeros(len(self.memory), dtype=bool)
        self._class_of = self._classes.rows_of(self._compact.n_known).astype(np.int32)

    def make_tables(self) -> TablesOnDemand:
        """Return the tables in force when the trial begins."""
        return TablesOnDemand(self.memory, self.parameters, self.prior, max_cells=MAX_CELLS)

    def _filter_of(self, objects: IntArray, *, unseen: bool = False) -> MatchedRows:
        """Return a filter of some objects, and of *unseen* before them, at the beginning of the trial."""
        graphs = self._compact.arrays(objects)
        chosen = objects
        if unseen:
            chosen = np.append(len(self._compact), objects)
            n_known, n_edges = (np.append(0, part).astype(np.int64) for part in (graphs.n_known, graphs.n_edges))
            graphs = GraphArrays(n_known, graphs.patterns, n_edges, *graphs[3:])
        prior = self.model.prior[chosen]
        from atg_fg.engines.large_memory.matched_rows import MatchedRows  # it loads Numba

        return MatchedRows(self.memory.assumptions, self.parameters, graphs, prior)

    def _filters(self) -> list[MatchedRows | AspectFilter]:
        return [self._matched] if self._classes is None else [self._matched, self._classes.filter]

    def update(self, evidence: Evidence) -> None:
        """Condition on a look, the last of ``history``, and learn from it."""
        time = len(self.history.evidence) - 1
        seen = self.history.step(time)
        objects = self._first_matches(evidence)
        filters = [self._matched]
        if len(objects):
            joining = self._filter_of(objects)
            _follow(joining, self.history, until=time)
            filters.append(joining)
        log_weights, classes = np.zeros(0), self._classes
        if classes is not None:
            members = classes.members - np.bincount(self._class_of[objects], minlength=classes.n_classes)
            of_classes = classes.filter.looked(evidence)
            log_weights = classes.log_of_classes(of_classes.log_weight, members)
        log_totals = [each.take_in(evidence, seen) for each in filters]
        log_total = log_sum_exp(np.append(log_weights, log_totals))
        if not np.isfinite(log_total):
            raise self.impossible_evidence()  # which has left the filters as they were
        for each, own in zip(filters, log_totals, strict=True):
            if not np.isfinite(own):
                each.rule_out()
        if classes is not None:
            classes.filter.accept(of_classes)
            if len(objects):
                classes.remove(self._compact.arrays(objects))
                self._is_matched[objects] = True
                self._objects = np.append(self._objects, objects)
                self._matched.absorb(joining)
            classes.filter.learn(*seen)
        self._log_total = log_total
        self._decision = None
        self.learn_from_look()

    def _first_matches(self, evidence: Evidence) -> IntArray:
        """Return the objects that know a pattern which this look allows, and none of those before, shape [M]."""
        if self._classes is None:
            return np.zeros(0, dtype=np.int64)
        allowed = np.flatnonzero(evidence.likelihood)
        if len(allowed) == self.model.n_patterns:
            return np.flatnonzero(~self._is_matched)
        objects = self._compact.index.showing_any(allowed)
        first: IntArray = objects[~self._is_matched[objects]]
        return first

    def predict(self, action: AnyAction) -> None:
        """Predict the effect of an action, the last of ``history``."""
        if isinstance(action, UncertainAction):
            if action.chances:
                raise InvalidInputError("engine 'large-memory': an action that is not sure; expected one that is")
            return  # nothing happened
        for each in self._filters():
            each.predict(action)

    def _masses(self) -> ClassMasses:
        """Return the weights of one object of each class, on the scale on which all weights sum to one."""
        assert self._classes is not None
        return self._classes.masses(self._log_total)

    def identity(self) -> IdentityBelief:
        """Return p(O | z_0:t, a_1:t) (eq. 1 and 2), off by at most ``total_variation_bound``."""
        if not self.history.evidence:
            return IdentityBelief.of(self.model.prior, self.model.n_unseen)
        weights = np.exp(self._matched.log_weight - self._log_total)
        objects = np.zeros(len(self._compact)) if self._classes is None else self._masses().total[self._class_of]
        objects[self._objects] = weights[1:]
        return IdentityBelief(objects, float(weights[0]), self.model.n_unseen)

    @property
    def total_variation_bound(self) -> float:
        """How far p(O) may be from exact: a bound of ½ Σ |p(O) − q(O)|, up to rounding."""
        if self._classes is None or not self.history.evidence:
            return 0.0
        return min(1.0, float(self._classes.members @ self._masses().unsure))

    @property
    def fell_back(self) -> bool:
        """Whether the bounds left the best action open, so that expected entropies were computed of all objects.

        Raises:
            InvalidInputError: Asked before a look or between an action and its look.
        """
        self._check_looked("expected entropy")
        return self._decide().fell_back

    @property
    def scaled_log_evidence(self) -> float:
        """Return ln p(z_0:t | a_1:t); the other objects' part of p(z) is off by at most ``total_variation_bound``."""
        return self._log_total

    def compute_expected_entropies(self) -> FloatArray:
        """Return E[H(O | z_{t+1}, a, …)] of each action (eq. 3), nats, shape [A]."""
        return self._decide().expected.copy()

    def _decide(self) -> Decision:
        """Return the expected entropies after the last look: of all objects one by one where they have to be."""
        if self._decision is None:
            self._decision = self._decide_anew()
        return self._decision

    def _decide_anew(self) -> Decision:
        weights = np.exp(self._matched.log_weight - self._log_total)
        classes, n_unseen = self._classes, self.model.n_unseen
        unseen = float(weights[0])
        if classes is None:
            parts = [self._matched.next_looks(weights)]
            return Decision(expected_entropies(parts, unseen, n_unseen), 0.0, fell_back=False)
        parts = [self._matched.next_looks(weights), by_class(classes, self._masses())]
        expected = expected_entropies(parts, unseen, n_unseen)
        bound = entropy_bound(sum(part.unsure for part in parts), len(self._compact) + n_unseen)
        if is_decided(expected, bound):
            return Decision(expected, bound, fell_back=False)
        everything = self._filter_of_all()
        weights = np.exp(everything.log_weight - log_sum_exp(everything.log_weight))
        parts = [everything.next_looks(weights)]
        return Decision(expected_entropies(parts, float(weights[0]), n_unseen), 0.0, fell_back=True)

    def _filter_of_all(self) -> MatchedRows:
        """Return the exact filter of all objects after the last look; it is kept, and goes on from where it was."""
        if self._all is None:
            self._all = self._filter_of(np.arange(len(self._compact)), unseen=True)
        _follow(self._all, self.history, self._n_followed)
        self._n_followed = len(self.history.evidence)
        return self._all

    @property
    def aspect_belief(self) -> FloatArray:
        """p(O, X_t | z_0:t, a_1:t), shape [H, W]; after an action X_t is the aspect that it leads to.

        Raises:
            TooLargeError: There are too many objects for the model's tables.
        """
        joint = np.zeros((self.model.n_hypotheses, self.model.n_states))
        matched = self._matched
        weights = np.exp(matched.log_weight - self._log_total)
        mass = matched.mass[:, : joint.shape[1]] * weights[:, None]
        joint[np.append(len(self._compact), self._objects), : mass.shape[1]] = mass
        if self._classes is not None:
            masses = self._masses()
            for number in np.flatnonzero(~self._is_matched):
                row = self._class_of[number]
                aspects = masses.total[row] * self._classes.aspects_of_one(masses, row)
                joint[number, : len(aspects)] = aspects[: joint.shape[1]]
        return joint

    def compute_smoothed_aspects(self, hypothesis: int) -> list[FloatArray]:
        """Return p(X_s | O = hypothesis, z_0:t, a_1:t) for every time s by forward-backward on that object alone."""
        known = hypothesis < len(self._compact)
        alone = RobotMemory(self.memory.assumptions, [self._compact.graph(hypothesis)] if known else [])
        return forward_backward(build_chain(alone, self.parameters, self.history, [0]))


def _follow(rows: MatchedRows, history: History, since: int = 0, until: int | None = None) -> None:
    """Take a filter through a trial from after its first ``since`` looks to its end, or to before a look."""
    end = len(history.evidence) if until is None else until
    for time in range(since, end):
        if time:
            rows.predict(history.actions[time - 1])
        if rows.take_in(history.evidence[time], history.step(time)) == -np.inf:
            rows.rule_out()
    if 0 < end <= len(history.actions):
        rows.predict(history.actions[end - 1])
