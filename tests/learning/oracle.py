"""An object that follows a structure, in exact fractions and plain loops, to be read beside ``docs/model.md``.

Nothing is imported from ``atg_fg``. An object's contents are a tuple, the symbol in each register; its registers hold
different symbols. An arrangement says which register is at each place.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

Arrangement = tuple[int, ...]
Contents = tuple[int, ...]
Detection = tuple[int | None, ...]


@dataclass(frozen=True)
class Structure:
    """Each action's sources, and how often things go otherwise."""

    n_slots: int
    sources: tuple[tuple[int, ...], ...]
    n_symbols: int
    slip: Fraction
    wrong: Fraction
    slip_again: Fraction

    @cached_property
    def patterns(self) -> list[tuple[int, ...]]:
        return list(itertools.permutations(range(self.n_symbols), self.n_slots))

    @cached_property
    def arrangements(self) -> list[Arrangement]:
        """All that the actions lead to."""
        there = [tuple(range(len(self.sources[0])))]
        for arrangement in there:
            there += [turned for turned in self._neighbours(arrangement) if turned not in there]
        return there

    def _neighbours(self, arrangement: Arrangement) -> Iterable[Arrangement]:
        return dict.fromkeys(self.turned(arrangement, action) for action in range(len(self.sources)))

    def turned(self, arrangement: Arrangement, action: int) -> Arrangement:
        return tuple(arrangement[source] for source in self.sources[action])

    def all_contents(self) -> list[Contents]:
        return list(itertools.permutations(range(self.n_symbols), len(self.sources[0])))

    def probability(self, contents: Contents, looks: Sequence[Detection], actions: Sequence[int]) -> Fraction:
        """p(looks | actions, contents), the pose at first being any.

        An action that failed when it was last done fails more often.
        """
        everywhere = self.arrangements
        belief = {(arrangement, frozenset[int]()): Fraction(1, len(everywhere)) for arrangement in everywhere}
        for time, look in enumerate(looks):
            if time:
                action, moved = actions[time - 1], defaultdict[tuple[Arrangement, frozenset[int]], Fraction](Fraction)
                for (arrangement, failed), weight in belief.items():
                    slip = self.slip_again if action in failed else self.slip
                    moved[self.turned(arrangement, action), failed - {action}] += weight * (1 - slip)
                    moved[arrangement, failed | {action}] += weight * slip
                belief = moved
            belief = {
                (arrangement, failed): weight * self.look(contents, arrangement, look)
                for (arrangement, failed), weight in belief.items()
            }
        return sum(belief.values(), Fraction(0))

    def look(self, contents: Contents, arrangement: Arrangement, look: Detection) -> Fraction:
        """p(look | contents, arrangement)."""
        shown = tuple(contents[register] for register in arrangement[: self.n_slots])
        if not agrees(look, shown) and None not in look:
            return self.wrong / len(self.patterns)
        anything = sum(agrees(look, pattern) for pattern in self.patterns)
        return (1 - self.wrong) * agrees(look, shown) + self.wrong * Fraction(anything, len(self.patterns))

    def fresh(self, looks: Sequence[Detection], actions: Sequence[int]) -> Fraction:
        """p(looks | actions) for an object of which nothing is known."""
        return self.again([], looks, actions)

    def again(
        self,
        before: Sequence[tuple[Sequence[Detection], Sequence[int]]],
        looks: Sequence[Detection],
        actions: Sequence[int],
    ) -> Fraction:
        """p(looks | actions, these looks and actions before) for one object."""
        total, explained = Fraction(0), Fraction(0)
        for contents in self.all_contents():
            weight = Fraction(1)
            for each in before:
                weight *= self.probability(contents, *each)
            total += weight
            explained += weight * self.probability(contents, looks, actions) if weight else 0
        return explained / total


def agrees(look: Detection, pattern: Sequence[int]) -> bool:
    return all(seen in (None, shown) for seen, shown in zip(look, pattern, strict=True))
