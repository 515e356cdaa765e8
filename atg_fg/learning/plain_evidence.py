"""Raw trials as those of plain ATGs, whose actions may be uncertain: their evidence for each α and δ of a grid.

What an action does is uncertain if the same action in the same aspect does not always lead to the same one. That shows
where an object is met again, so the identity of each trial's object is summed out: which ATG a trial was taken for
depends on what was thought of α.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray, IntArray
from atg_fg.learning.likelihood import BEFORE
from atg_fg.learning.raw_trials import RawTrial


class PlainNoise(NamedTuple):
    """α, the Dirichlet concentration beside the counted transitions, and δ, the probability of a wrong look."""

    concentration: float
    noise: float

    @property
    def parameters(self) -> ModelParameters:
        """These of a model that learns within the trial."""
        return ModelParameters(transition_concentration=self.concentration, observation_noise=self.noise)


#: Of objects whose actions are sure.
SURE: Final = PlainNoise(1e-6, 1e-6)
#: What is possible where they are uncertain, with what each costs beforehand in nats: α near one and no noise are
#: nearest at hand.
UNCERTAIN: Final = tuple(
    PlainNoise(alpha, delta) for alpha in (0.03, 0.1, 0.3, 0.6, 1.0, 1.5, 2.5, 4.0) for delta in (1e-8, 1e-3, 1e-2)
)
_COSTS: Final = np.array(
    [0.02 * abs(math.log(alpha)) + {1e-8: 0.0, 1e-3: 0.1, 1e-2: 0.2}[delta] for alpha, delta in UNCERTAIN]
)
#: Where nothing says otherwise.
USUAL: Final = PlainNoise(1.0, 1e-8)
#: ATGs that one trial may be of, those that share most patterns with it, and the least number of these.
MOST_RIVALS: Final = 8
LEAST_SHARED: Final = 2


class PlainEvidence:
    """What each raw trial says of plain ATGs, given those before it.

    Args:
        assumptions: |O|, |G|, actions and alphabet.

    Attributes:
        log_evidence: ln p(trial) given ``NEW``, ``FILED`` and ``BEFORE``, sure first, then each of ``UNCERTAIN``, shape
            [3, n, 1 + N].
    """

    def __init__(self, assumptions: Assumptions) -> None:
        self._assumptions = assumptions
        self.forget()

    def forget(self) -> None:
        """Know no trial."""
        self._graphs: dict[str, AspectTransitionGraph] = {}
        #: Names of the ATGs that show a pattern
        self._showing: defaultdict[int, set[str]] = defaultdict(set)
        self.log_evidence: FloatArray = np.zeros((3, 0, 1 + len(UNCERTAIN)))

    def catch_up(self, trials: Sequence[RawTrial], owners: Sequence[str]) -> None:
        """Take in those of all raw trials that are not known yet."""
        n_before = self.log_evidence.shape[1]
        rows = [self._taken_in(*each) for each in zip(trials[n_before:], owners[n_before:], strict=True)]
        if rows:
            self.log_evidence = np.concatenate((self.log_evidence, np.stack(rows, axis=1)), axis=1)

    def _taken_in(self, trial: RawTrial, owner: str) -> FloatArray:
        alphabet = self._assumptions.alphabet
        looks = [Evidence.of_detection(alphabet, detection) for detection in trial.detections]
        patterns = [look.pattern for look in looks]
        rivals = self._rivals({pattern for pattern in patterns if pattern is not None}, owner)
        of_each = self._of_each([self._graphs[name] for name in rivals], looks, trial.actions)
        fresh = of_each[:, -1]
        n_objects = max(self._assumptions.n_objects, len(self._graphs) + 1)
        weights = np.append(np.zeros(len(rivals)), math.log(n_objects - len(self._graphs))) - math.log(n_objects)
        before = np.logaddexp.reduce(of_each + weights, axis=1)
        filed = of_each[:, rivals.index(owner)] if owner in rivals else fresh
        if owner not in self._graphs:
            self._graphs[owner] = AspectTransitionGraph(owner, self._assumptions)
        self._graphs[owner].learn(patterns, trial.actions)
        for pattern in self._graphs[owner].pattern_indices:
            self._showing[pattern].add(owner)
        return np.array([fresh, filed, before])

    def _rivals(self, patterns: set[int], owner: str) -> list[str]:
        """Return the names of the ATGs that a trial may be of; with others it shares next to nothing."""
        shared = Counter(itertools.chain.from_iterable(self._showing[pattern] for pattern in patterns))
        enough = (name for name in self._graphs if shared.get(name, 0) >= LEAST_SHARED)
        likely = sorted(enough, key=lambda name: -shared[name])
        return list(dict.fromkeys([*([owner] if owner in self._graphs else []), *likely[:MOST_RIVALS]]))

    def _of_each(
        self, graphs: Sequence[AspectTransitionGraph], looks: Sequence[Evidence], actions: Sequence[int]
    ) -> FloatArray:
        """Return ln p(trial | ATG), and last of an object never met, shape [1 + N, len(graphs) + 1]."""
        from atg_fg.inference.kernels.memory_tables import tables_of
        from atg_fg.learning import kind_kernels  # they load Numba

        n_known: IntArray = np.array([*(graph.n_known for graph in graphs), 0])
        n_counted: IntArray = np.array([*(graph.n_counted for graph in graphs), 0])
        known: IntArray = np.array([pattern for graph in graphs for pattern in graph.pattern_indices], dtype=np.int64)
        counts = np.concatenate((*(graph.count_table for graph in graphs), np.zeros((0, 4), dtype=np.int64)))
        tables = tables_of(self._assumptions, (n_known, known, n_counted, counts), len(looks) + 1, 1.0)
        patterns: IntArray = np.array([-1 if look.pattern is None else look.pattern for look in looks])
        result: FloatArray = kind_kernels.log_evidence_of_each(
            tuple(tables),
            (self._assumptions.n_aspects, len(self._assumptions.alphabet)),
            np.array([SURE, *UNCERTAIN]),
            np.array([look.likelihood for look in looks]),
            np.array(actions, dtype=np.int64),
            patterns,
        )
        return result

    def of_kinds(self, noise: PlainNoise, given: int = BEFORE) -> FloatArray:
        """Return ln p(trial | sure), ln p(trial | uncertain), shape [n, 2].

        Args:
            noise: Of objects whose actions are uncertain.
            given: What the evidence is given: ``NEW``, ``FILED`` or ``BEFORE``.
        """
        table: FloatArray = self.log_evidence[given][:, [0, 1 + UNCERTAIN.index(noise)]]
        return table

    def best_noise(self, uncertain: FloatArray) -> PlainNoise:
        """Return what α and δ most probably are where actions are uncertain.

        Args:
            uncertain: Probability of each trial to be of such an object, shape [n].
        """
        return UNCERTAIN[int((uncertain @ self.log_evidence[BEFORE][:, 1:] - _COSTS).argmax())]
