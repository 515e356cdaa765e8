"""Two ATGs that were made from one object become one, on record, so that it can be undone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import Moments
from atg_fg.core.open_alphabets import Relabelling


@dataclass(frozen=True)
class Merge:
    """What two ATGs were before they became one under the name of the first.

    Attributes:
        kept: The ATG whose name stayed.
        dropped: The other one.
        position: Index that the dropped one had in the memory.
        trials: Numbers of the raw trials that were of the dropped one, in a memory that keeps them.
    """

    kept: AspectTransitionGraph
    dropped: AspectTransitionGraph
    position: int
    trials: tuple[int, ...] = ()

    def relabelled(self, assumptions: Assumptions, labels: Relabelling) -> Merge:
        """Return the same merge under assumptions with another alphabet."""
        kept, dropped = (graph.relabelled(assumptions, labels) for graph in (self.kept, self.dropped))
        return replace(self, kept=kept, dropped=dropped)

    def merged(self) -> AspectTransitionGraph:
        """Return what the two made: all aspects, as far as |G| allows, and the sum of their counts."""
        result = self.kept.copy()
        result.absorb(self.dropped)
        return result

    def undone(self, current: AspectTransitionGraph) -> AspectTransitionGraph:
        """Return the kept ATG as it was before, with what ``current`` has learned since the merge."""
        result = self.kept.copy()
        result.absorb(learned_since(current, self.merged()))
        return result


def learned_since(current: AspectTransitionGraph, before: AspectTransitionGraph) -> AspectTransitionGraph:
    """Return what ``current`` has learned beyond ``before``: aspects, counts with both their ends, and readings."""
    shown, known = current.pattern_indices, before.pattern_indices
    old = Counter({(known[x], a, known[y]): count for (x, a, y), count in before.counts.items()})
    new = Counter({(shown[x], a, shown[y]): count for (x, a, y), count in current.counts.items()}) - old
    ends = {pattern for source, _, target in new for pattern in (source, target)}
    since = AspectTransitionGraph(current.name, current.assumptions)
    for pattern in shown:
        if pattern in ends or pattern not in known:
            since.add_aspect(current.assumptions.alphabet.patterns[pattern])
    aspect = {pattern: number for number, pattern in enumerate(since.pattern_indices)}
    for (source, action, target), count in new.items():
        since.add_transition(aspect[source], action, aspect[target], count)
    for name, moments in current.measured.items():
        since.add_moments(name, moments.minus(before.measured.get(name, Moments())))
    return since


def check_merges(merges: Iterable[Merge], names: Iterable[str], place: str) -> None:
    """Check that merges, in their order, lead to ATGs with these names.

    Raises:
        InvalidInputError: One that was kept is not there, or one that was dropped is; the message names ``place``.
    """
    there = set(names)
    for number, merge in reversed(list(enumerate(merges))):
        if merge.kept.name not in there:
            raise InvalidInputError(
                f"{place}[{number}].kept: {merge.kept.name!r}; expected the name of an ATG in this memory"
            )
        if merge.dropped.name in there:
            raise InvalidInputError(
                f"{place}[{number}].dropped: {merge.dropped.name!r}; expected a name that is in the memory no more"
            )
        there.add(merge.dropped.name)
