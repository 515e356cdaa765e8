"""Two memories made one: which objects of the second are those of the first, and which are others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.merging import Merge
from atg_fg.core.sense import Sense
from atg_fg.learning.learner import StructureLearner
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.structured_memory import StructuredMemory


class Union(NamedTuple):
    """What came of two memories.

    Attributes:
        memory: The objects of the first, in their order, then those of the second that are others.
        renamed: Name of each object of the second, and the other name that it has in the union.
        same: Names of objects that both have.
    """

    memory: RobotMemory
    renamed: dict[str, str]
    same: tuple[str, ...]


@dataclass
class _Part:
    """What the union takes from one of the memories.

    Attributes:
        memory: The memory.
        taken: Names of the ATGs that it takes from there.
        called: Their names in the union, and those of the ATGs that were merged into them.
        number_of: The number in the union of each raw trial that it takes from there.
    """

    memory: RobotMemory
    taken: list[str]
    called: dict[str, str] = field(default_factory=dict)
    number_of: dict[int, int] = field(default_factory=dict)

    @property
    def merges(self) -> list[Merge]:
        """Merges that led to what is taken."""
        return [merge for merge in self.memory.merges if _kept_in_the_end(self.memory, merge.kept.name) in self.taken]

    def merge_in_union(self, merge: Merge) -> Merge:
        """Return a merge with the names and numbers that hold in the union."""
        kept, dropped = (_named(graph, self.called[graph.name]) for graph in (merge.kept, merge.dropped))
        trials = tuple(self.number_of[number] for number in merge.trials if number in self.number_of)
        return replace(merge, kept=kept, dropped=dropped, trials=trials)


def unite(first: RobotMemory, second: RobotMemory) -> Union:
    """Return the union of two memories; neither is changed.

    An ATG of the second is one of the first if it has the same name and one of the two holds all that the other one
    does: the same aspects in the same order as far as these go, and each transition at least as often. So a memory and
    a copy of it that went on learning make the latter. All others are different objects, whatever they are called;
    where names clash, that of the second memory gets a new one. Which of them are of one object after all is for
    ``find_duplicates`` to say.

    Merges stay on record, and can be undone. The structures that either memory keeps up are scored on the raw trials of
    both.

    Raises:
        InvalidInputError: The memories were made under different assumptions, or have senses of which neither is the
            other one that went on learning.
    """
    if first.assumptions != second.assumptions:
        raise InvalidInputError(
            f"merge: {first.assumptions} and {second.assumptions}; expected two memories under the same assumptions"
        )
    sense = _united_sense(first.sense, second.sense)
    both = {name: (first[name], second[name]) for name in second.names if name in first.names}
    same = [name for name, (one, other) in both.items() if holds(one, other) or holds(other, one)]
    further = [name for name in same if not holds(first[name], second[name])]
    one = _Part(first, [name for name in first.names if name not in further])
    two = _Part(second, [name for name in second.names if name not in same or name in further])
    _leave_out_merged(one, two)
    _leave_out_merged(two, one)
    _name_all(one, two, further)
    graphs = [
        _named((second if name in further else first)[name], name)
        for name in first.names
        if name in one.taken or name in further
    ]
    graphs += [_named(second[name], two.called[name]) for name in two.taken if name not in further]
    learner = _united_learner(one, two, same)
    merges = [part.merge_in_union(merge) for part in (one, two) for merge in part.merges]
    if learner is None:
        memory = RobotMemory(first.assumptions, graphs, merges, sense)
    else:
        memory = StructuredMemory(first.assumptions, graphs, learner, merges, sense)
    renamed = {old: new for old, new in two.called.items() if old != new}
    return Union(memory, renamed, tuple(same))


def _united_sense(first: Sense | None, second: Sense | None) -> Sense | None:
    """Return the sense of two that knows all that both know.

    Classes that were found apart have numbers of their own, which mean nothing to the other memory.
    """
    if first is None and second is None:
        return None
    features = ["none" if each is None else repr(each.features) for each in (first, second)]
    if first is None or second is None or first.features != second.features:
        raise InvalidInputError(f"merge: features {' and '.join(features)}; expected two memories of the same features")
    less, more = sorted((first, second), key=lambda sense: len(sense.trials))
    if more.trials[: len(less.trials)] != less.trials:
        raise InvalidInputError(
            "merge: classes of appearance that were found apart; expected a memory and a copy that went on learning"
        )
    return more.copy()


def holds(more: AspectTransitionGraph, less: AspectTransitionGraph) -> bool:
    """Return whether an ATG has all that another one has: the same aspects first, and no transition less often."""
    counts = more.counts
    return more.pattern_indices[: less.n_known] == less.pattern_indices and all(
        counts.get(edge, 0) >= number for edge, number in less.counts.items()
    )


def _kept_in_the_end(memory: RobotMemory, name: str) -> str:
    """Return the name of the ATG that one which was perhaps merged away is a part of by now."""
    for merge in memory.merges:
        if merge.dropped.name == name:
            name = merge.kept.name
    return name


def _leave_out_merged(part: _Part, other: _Part) -> None:
    """Leave out what the other memory has merged into an ATG that is taken from there."""
    for merge in other.merges:
        name = merge.dropped.name
        if name in part.taken and holds(merge.dropped, part.memory[name]):
            part.taken.remove(name)


def _name_all(one: _Part, two: _Part, further: Sequence[str]) -> None:
    """Give all that is taken its name in the union; the second memory's give way, unless they are the first's too."""
    one.called = {name: name for name in (*one.taken, *(merge.dropped.name for merge in one.merges))}
    used = {*one.called, *further}
    number = len(used)
    for name in (*two.taken, *(merge.dropped.name for merge in two.merges)):
        new = name
        while new in used and name not in further:
            new = f"object-{number:03d}"
            number += 1
        two.called[name] = new
        used.add(new)


def _named(graph: AspectTransitionGraph, name: str) -> AspectTransitionGraph:
    twin = graph.copy()
    twin.name = name
    return twin


def _united_learner(one: _Part, two: _Part, same: Sequence[str]) -> StructureLearner | None:
    """Return what is learned from the raw trials of both; of an object that both have, from those that are more."""
    learners = [part.memory.learner for part in (one, two) if isinstance(part.memory, StructuredMemory)]
    if not learners:
        return None
    taken: list[tuple[str, RawTrial]] = []
    for part, other in ((one, two), (two, one)):
        if isinstance(part.memory, StructuredMemory):
            for number, (owner, trial) in enumerate(
                zip(part.memory.learner.owners, part.memory.learner.trials, strict=True)
            ):
                name = _name_if_taken(owner, part, other, same)
                if name is not None:
                    part.number_of[number] = len(taken)
                    taken.append((name, trial))
    result = StructureLearner(one.memory.assumptions, learners[0].seed)
    result.n_evaluations = sum(learner.n_evaluations for learner in learners)
    structures = dict.fromkeys(structure for learner in learners for structure in learner.candidates)
    most = max(learners, key=lambda learner: len(learner.trials))
    owners, trials = [name for name, _ in taken], [trial for _, trial in taken]
    result.restore(owners, trials, list(structures), most.rates, most.noise)
    if len(learners) > 1:
        result.settle()
    return result


def _name_if_taken(owner: str, part: _Part, other: _Part, same: Sequence[str]) -> str | None:
    """Return the name in the union of the object of a raw trial; ``None`` if the other memory has as good a trial."""
    if owner not in same:
        return part.called[owner] if owner in part.taken else None
    mine, theirs = _n_trials(part.memory, owner), _n_trials(other.memory, owner)
    name: Mapping[str, str] = {**other.called, **part.called}
    return name[owner] if mine > theirs or (mine == theirs and owner in part.taken) else None


def _n_trials(memory: RobotMemory, name: str) -> int:
    return memory.learner.owners.count(name) if isinstance(memory, StructuredMemory) else 0
