"""What all objects share: registers, and the permutation that each action makes of what they hold.

The first registers are the visible slots, the others are hidden. After action a register c holds what register
``sources[a][c]`` held before. Which symbols an object has in its registers is its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, NamedTuple

import networkx
import numpy as np

from atg_fg.assumptions import Assumptions
from atg_fg.errors import InvalidInputError, TooLargeError
from atg_fg.json_format import read_integer, read_list, read_object
from atg_fg.patterns import IntArray

#: A structure with more poses than this is not believed.
MAX_POSES: Final = 200
#: Hidden registers that a file may name; far above what can be learned.
MAX_REGISTERS: Final = 64


class Poses(NamedTuple):
    """The group that the actions generate, G poses; pose 0 is the one in which every place holds its own register.

    Attributes:
        registers: Which register is at each place in each pose, shape [G, P]; the first J places are visible.
        successors: The pose that each action leads to, shape [G, A].
    """

    registers: IntArray
    successors: IntArray


@dataclass(frozen=True)
class SharedStructure:
    """P registers, of which the first J are visible, and one permutation of them an action.

    Attributes:
        n_slots: J, the number of slots.
        sources: For each action, the register that each register takes its content from.

    Raises:
        InvalidInputError: No slot, no action, or not a permutation of at least J registers for each action.
    """

    n_slots: int
    sources: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        if self.n_slots < 1 or not self.sources:
            raise InvalidInputError(
                f"structure: {self.n_slots} slots, {len(self.sources)} actions; expected at least one of each"
            )
        for action, sources in enumerate(self.sources):
            if sorted(sources) != list(range(self.n_registers)) or self.n_registers < self.n_slots:
                raise InvalidInputError(
                    f"structure: sources[{action}]: {list(sources)}; expected a permutation of the same registers as "
                    f"for every action, at least {self.n_slots} of them"
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
        """The prior ln p(S): 2^-(P - J) for the hidden registers, and each labelled choice of permutations alike."""
        hidden = self.n_registers - self.n_slots
        labelled = math.lgamma(hidden + 1) - self.n_actions * math.lgamma(self.n_registers + 1)
        return labelled - hidden * math.log(2)

    def canonical(self) -> SharedStructure:
        """Return this structure without registers that never come into view, the hidden ones named in a fixed order.

        Two structures that differ in the names of hidden registers alone have the same canonical form.
        """
        origins = [[sources.index(register) for register in range(self.n_registers)] for sources in self.sources]
        order = list(range(self.n_slots))
        for register in order:  # grows while it is walked: breadth first from the visible ones
            for sources, reversed_sources in zip(self.sources, origins, strict=True):
                for neighbour in (reversed_sources[register], sources[register]):
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
    result = Poses(np.array(poses, dtype=np.int64), np.array(successors, dtype=np.int64))
    for table in result:
        table.flags.writeable = False  # it is shared by all who ask
    return result


def write_structure(structure: SharedStructure, assumptions: Assumptions) -> dict[str, Any]:
    """Return a structure as JSON knows it."""
    sources = {name: list(each) for name, each in zip(assumptions.actions, structure.sources, strict=True)}
    return {"registers": structure.n_registers, "sources": sources}


def read_structure(value: Any, assumptions: Assumptions, place: str) -> SharedStructure:
    """Return the structure at ``place``, in canonical form.

    Raises:
        InvalidInputError: It is none for these slots and actions; the message names the place.
    """
    fields = read_object(value, place, ("registers", "sources"))
    n_registers = read_integer(fields["registers"], f"{place}.registers", least=len(assumptions.alphabet.slots))
    if n_registers > MAX_REGISTERS:
        raise InvalidInputError(f"{place}.registers: {n_registers}; expected at most {MAX_REGISTERS}")
    by_action = read_object(fields["sources"], f"{place}.sources", assumptions.actions)
    sources = [_read_sources(by_action[name], n_registers, f"{place}.sources.{name}") for name in assumptions.actions]
    structure = SharedStructure(len(assumptions.alphabet.slots), tuple(sources)).canonical()
    try:
        structure.poses()
    except TooLargeError as error:
        raise InvalidInputError(f"{place}: {error}") from error
    return structure


def _read_sources(value: Any, n_registers: int, place: str) -> tuple[int, ...]:
    entries: Sequence[Any] = read_list(value, place)
    sources = tuple(read_integer(entry, f"{place}[{index}]", least=0) for index, entry in enumerate(entries))
    if sorted(sources) != list(range(n_registers)):
        raise InvalidInputError(f"{place}: {list(sources)}; expected a permutation of 0 to {n_registers - 1}")
    return sources
