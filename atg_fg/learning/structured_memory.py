"""A robot memory that also learns what all its objects share."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.merging import Merge
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Detection
from atg_fg.core.transactions import one_transaction
from atg_fg.learning.learner import StructureLearner
from atg_fg.learning.raw_trials import RawTrial


class StructuredMemory(RobotMemory):
    """ATGs by name, and beside them the raw trials they were made from and the structure learned from all of these.

    Args:
        assumptions: |O|, |G|, actions and alphabet.
        graphs: ATGs under the same assumptions, with unique names.
        learner: Its trials are of these ATGs; one that knows nothing yet if not given.
        merges: Those that led to these graphs, in their order.

    Raises:
        InvalidInputError: A repeated name, a graph made under other assumptions, merges that lead to others, or that
            name trials which are not there.

    Attributes:
        learner: The raw trials and the structures learned from them.
    """

    def __init__(
        self,
        assumptions: Assumptions,
        graphs: Iterable[AspectTransitionGraph] = (),
        learner: StructureLearner | None = None,
        merges: Iterable[Merge] = (),
    ) -> None:
        super().__init__(assumptions, graphs, merges)
        self.learner = learner or StructureLearner(assumptions)
        n_trials = len(self.learner.trials)
        for number, merge in enumerate(self.merges):
            for trial in merge.trials:
                if not 0 <= trial < n_trials:
                    raise InvalidInputError(f"merges[{number}].trials: {trial}; expected less than {n_trials}")

    @one_transaction
    def learn_shared(self, name: str, detections: Sequence[Detection], actions: Sequence[int]) -> None:
        """Keep a raw trial, and learn from it what all objects share.

        Args:
            name: Name of the ATG that the trial went to.
            detections: The symbol in each slot at each look, ``None`` where nothing was seen, length t + 1.
            actions: Index of the action between each two, length t.

        Raises:
            UnknownNameError: There is no such ATG.
            InvalidInputError: It is no trial under these assumptions.
        """
        trial = RawTrial(tuple(detections), tuple(actions))
        trial.check(self.assumptions)
        self.learner.learn(self[name].name, trial)

    def _merge_shared(self, keep: str, drop: str) -> tuple[int, ...]:
        trials = tuple(number for number, owner in enumerate(self.learner.owners) if owner == drop)
        self.learner.hand_over(trials, keep)
        return trials

    def _unmerge_shared(self, merge: Merge) -> None:
        self.learner.hand_over(merge.trials, merge.dropped.name)

    def become(self, other: RobotMemory) -> None:
        """Have what another memory has, under the same assumptions; if that has no structure, none is learned yet."""
        super().become(other)
        known = other.learner if isinstance(other, StructuredMemory) else None
        self.learner = known or StructureLearner(self.assumptions)

    def copy(self) -> StructuredMemory:
        """Return a memory that can learn without touching this one."""
        graphs = (graph.copy() for graph in self)
        return StructuredMemory(self.assumptions, graphs, copy.deepcopy(self.learner), self.merges)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RobotMemory):
            return NotImplemented
        if not isinstance(other, StructuredMemory):
            return False
        return super().__eq__(other) is True and self.learner.same_as(other.learner)

    __hash__ = None

    def _more_to_say(self) -> str:
        believed = self.learner.believed(self.names)
        weights = f"with weights {', '.join(f'{each.weight:.2f}' for each in believed)}" if believed else "none"
        return f"; {len(self.learner.trials)} raw trials; structures believed in: {weights}"

    def __repr__(self) -> str:
        return (
            f"StructuredMemory({len(self)} of {self.assumptions.n_objects} objects, {len(self.learner.trials)} trials)"
        )


def memory_for(parameters: ModelParameters, memory: RobotMemory) -> RobotMemory:
    """Return a memory with the ATGs of ``memory`` that learns what the parameters say is to be learned.

    If ``memory`` is kept in a file, it is the new one that is kept there from here on.
    """
    if parameters.learn_structure and not isinstance(memory, StructuredMemory):
        structured = StructuredMemory(memory.assumptions, memory, merges=memory.merges)
        structured._keeper, memory._keeper = memory._keeper, None
        return structured
    return memory
