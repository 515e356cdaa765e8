"""What all objects share: registers, and the map that each action makes of what they hold.

The first registers are the visible slots, the others are hidden. After action a register c holds what register
``sources[a][c]`` held before. If that is no permutation, some content comes into two registers and another is lost: the
action cannot be undone. Which symbols an object has in its registers is its own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import networkx
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError, TooLargeError
from atg_fg.core.patterns import FloatArray, IntArray

#: A structure with more poses than this is not believed.
MAX_POSES: Final = 200


#: ι, the probability beforehand that an action is no permutation.
IRREVERSIBLE: Final = 0.1


class Poses(NamedTuple):
    """The monoid that the actions generate, G poses; pose 0 is the one in which every place holds its own register.

    It is a group if each action is a permutation. Poses that an invertible pose, as a renaming of registers, turns into
    each other are all the same to an object of which nothing is known: from any of them it shows the same, and has the
    same aspects by other names. A group is one such class; a box with its lid on is one, without it another.

    Attributes:
        registers: Which register is at each place in each pose, shape [G, P]; the first J places are visible.
        successors: The pose that each action leads to, shape [G, A].
        first: The first pose of each such class, shape [F].
        first_weights: The share of all poses that is in the class, shape [F]; they sum to one.
    """

    registers: IntArray
    successors: IntArray
    first: IntArray
    first_weights: FloatArray

    def possible(self, n_slots: int) -> FloatArray:
        """Return 1 for poses with different registers in all slots in view, else 0, shape [G].

        Slots never show the same symbol, so that an irreversible action cannot have brought one register into two.
        """
        in_view = np.sort(self.registers[:, :n_slots], axis=1)
        is_possible: NDArray[np.bool_] = np.all(np.diff(in_view, axis=1) > 0, axis=1)
        return is_possible.astype(np.float64)


@dataclass(frozen=True)
class SharedStructure:
    """P registers, of which the first J are visible, and one map of them to themselves an action.

    Attributes:
        n_slots: J, the number of slots.
        sources: For each action, the register that each register takes its content from.

    Raises:
        InvalidInputError: No slot, no action, or not a source for each of at least J registers for each action.
    """

    n_slots: int
    sources: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        if self.n_slots < 1 or not self.sources:
            raise InvalidInputError(
                f"structure: {self.n_slots} slots, {len(self.sources)} actions; expected at least one of each"
            )
        for action, sources in enumerate(self.sources):
            is_map = len(sources) == self.n_registers and set(sources) <= set(range(self.n_registers))
            if not is_map or self.n_registers < self.n_slots:
                raise InvalidInputError(
                    f"structure: sources[{action}]: {list(sources)}; expected for each register one of the same "
                    f"registers as for every action, at least {self.n_slots} of them"
                )

    @property
    def n_registers(self) -> int:
        """P, visible and hidden."""
        return len(self.sources[0])

    @property
    def n_actions(self) -> int:
        """A."""
        return len(self.sources)

    @property
    def log_prior(self) -> float:
        """The prior ln p(S): 2^-(P - J) for the hidden registers, and p of each action, by any names of these."""
        hidden = self.n_registers - self.n_slots
        permutation, other = log_map_priors(self.n_registers)
        each = (permutation if is_permutation(sources) else other for sources in self.sources)
        return math.lgamma(hidden + 1) + sum(each) - hidden * math.log(2)

    def canonical(self) -> SharedStructure:
        """Return this structure without registers that never come into view, the hidden ones named in a fixed order.

        Two structures that differ in the names of hidden registers alone have the same canonical form.
        """
        shown = list(range(self.n_slots))  # registers whose content can come into view
        for register in shown:  # grows while it is walked
            shown += dict.fromkeys(sources[register] for sources in self.sources if sources[register] not in shown)
        origins = [{sources[register]: register for register in shown} for sources in self.sources]
        order = list(range(self.n_slots))
        for register in order:  # breadth first from the visible ones
            for sources, origin in zip(self.sources, origins, strict=True):
                # Where the content goes to says which is next only if it goes to one register alone.
                goes_to = origin[register] if len(origin) == len(shown) else register
                for neighbour in (goes_to, sources[register]):
                    if neighbour not in order:
                        order.append(neighbour)
        name = {register: number for number, register in enumerate(order)}
        return SharedStructure(
            self.n_slots, tuple(tuple(name[sources[register]] for register in order) for sources in self.sources)
        )

    def poses(self, limit: int = MAX_POSES) -> Poses:
        """Return the closure of the actions.

        Raises:
            TooLargeError: It has more than ``limit`` poses.
        """
        return _closure(self, limit)

    def to_networkx(self) -> networkx.MultiDiGraph[int]:
        """Return the poses as nodes with ``registers``, those at each place, and an edge with ``action`` an action."""
        poses = self.poses()
        graph: networkx.MultiDiGraph[int] = networkx.MultiDiGraph()
        for pose, registers in enumerate(poses.registers.tolist()):
            graph.add_node(pose, registers=tuple(registers))
        for pose, successors in enumerate(poses.successors.tolist()):
            for action, successor in enumerate(successors):
                graph.add_edge(pose, successor, key=action, action=action)
        return graph


def is_permutation(sources: Sequence[int]) -> bool:
    """Return whether no content is lost."""
    return len(set(sources)) == len(sources)


def log_map_priors(n_registers: int) -> tuple[float, float]:
    """Return ln p(action) beforehand of one that is a certain permutation, and of one that is a certain other map.

    An action is a permutation with probability 1 − ι, and each of P! is as probable; else it is one of P^P − P! others.
    """
    n_permutations = math.factorial(n_registers)
    n_others = max(n_registers**n_registers - n_permutations, 1)  # of one register there is no other map
    return math.log1p(-IRREVERSIBLE) - math.log(n_permutations), math.log(IRREVERSIBLE) - math.log(n_others)


@lru_cache(maxsize=256)
def _closure(structure: SharedStructure, limit: int) -> Poses:
    upright = tuple(range(structure.n_registers))
    number, poses, successors = {upright: 0}, [upright], []
    for pose in poses:  # grows while it is walked: breadth first
        row = []
        for sources in structure.sources:
            turned = tuple(pose[source] for source in sources)
            if turned not in number:
                if len(poses) >= limit:
                    raise TooLargeError(f"structure: more than {limit} poses; expected at most that many")
                number[turned] = len(poses)
                poses.append(turned)
            row.append(number[turned])
        successors.append(row)
    first, sizes = _classes(poses, number)
    result = Poses(
        np.array(poses, dtype=np.int64),
        np.array(successors, dtype=np.int64),
        np.array(first, dtype=np.int64),
        np.array(sizes) / len(poses),
    )
    for table in result:
        table.flags.writeable = False  # it is shared by all who ask
    return result


def _classes(poses: Sequence[tuple[int, ...]], number: Mapping[tuple[int, ...], int]) -> tuple[list[int], list[int]]:
    """Return the first pose, and the number of poses, of each class of poses that are the same by other names."""
    renamings = [pose for pose in poses if is_permutation(pose)]
    left = dict.fromkeys(range(len(poses)))
    first, sizes = [], []
    while left:
        pose = poses[next(iter(left))]
        members = {number[tuple(renaming[register] for register in pose)] for renaming in renamings}
        first.append(min(members))
        sizes.append(len(members))
        for member in members:
            del left[member]
    return first, sizes
