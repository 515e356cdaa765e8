"""What objects of a kind share: registers, modes, and the map that each action makes of what the registers hold.

The first registers are the visible slots, the others are hidden. After action a register c holds what register
``sources[a][c]`` held before. If that is no permutation, some content comes into two registers and another is lost: the
action cannot be undone. Which symbols an object has in its registers is its own.

What an action does may depend on how the object stands: then there are modes, with a map for each action in each of
them, and with the mode that it leads to. A pose is a mode and an arrangement of the registers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError, TooLargeError
from atg_fg.core.patterns import FloatArray, IntArray

if TYPE_CHECKING:
    import networkx

#: A structure with more poses than this is not believed.
MAX_POSES: Final = 200
#: ι, the probability beforehand that an action is no permutation.
IRREVERSIBLE: Final = 0.1
#: Probability beforehand of each mode beyond the first, and of an action to make the same map as in the first mode.
FURTHER_MODE: Final = 0.2
TIED: Final = 0.5


@dataclass(frozen=True, eq=False)
class Poses:
    """What the actions generate, G poses; in pose 0, of the first mode, each place holds its own register.

    Of one mode it is a monoid, and a group if each action is a permutation. Poses that an invertible pose, as a
    renaming of registers, turns into each other are all the same to an object of which nothing is known: from any of
    them it shows the same, and has the same aspects by other names. A group is one such class; a box with its lid on
    is one, without it another.

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

    def __iter__(self) -> Iterator[NDArray[Any]]:
        return iter((self.registers, self.successors, self.first, self.first_weights))


class PosesInView(NamedTuple):
    """Poses as compiled loops take them: all arrays lie in order, and none is read-only, which they are compiled for.

    Attributes:
        successors: The pose that each action leads to, shape [G, A].
        registers: The register in each slot in each pose, shape [G, J].
        possible: 1 where these are different, else 0, shape [G].
        first: As ``Poses`` has it, shape [F].
        first_weights: As ``Poses`` has it, shape [F].
    """

    successors: IntArray
    registers: IntArray
    possible: FloatArray
    first: IntArray
    first_weights: FloatArray


@lru_cache(maxsize=256)
def poses_in_view(poses: Poses, n_slots: int) -> PosesInView:
    """Return what is in view in some poses, made once for each that are kept."""
    registers, successors, first, first_weights = (np.array(table, order="C") for table in poses)
    in_view = np.array(registers[:, :n_slots], order="C")
    return PosesInView(successors, in_view, poses.possible(n_slots), first, first_weights)


@dataclass(frozen=True)
class SharedStructure:
    """P registers, of which the first J are visible, and one map of them to themselves for each action in each mode.

    Attributes:
        n_slots: J, the number of slots.
        sources: For each mode, and in it each action, the register that each register takes its content from.
        next_modes: For each mode, the mode that each action leads to; empty if there is one mode.

    Raises:
        InvalidInputError: No slot, no action, not a source for each of at least J registers for each action in each
            mode, or a next mode that there is not.
    """

    n_slots: int
    sources: tuple[tuple[int, ...], ...]
    next_modes: tuple[tuple[int, ...], ...] = ()

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
        lengths = {len(each) * self.n_modes for each in self.next_modes}
        named = {mode for each in self.next_modes for mode in each}
        if lengths - {len(self.sources)} or not named <= set(range(self.n_modes)) or len(self.next_modes) == 1:
            raise InvalidInputError(
                f"structure: next modes {list(map(list, self.next_modes))}, {len(self.sources)} maps; expected none, "
                "or of two modes or more the next one of each action, and a map of each"
            )

    @property
    def n_registers(self) -> int:
        """P, visible and hidden."""
        return len(self.sources[0])

    @property
    def n_modes(self) -> int:
        """M."""
        return max(len(self.next_modes), 1)

    @property
    def n_actions(self) -> int:
        """A."""
        return len(self.sources) // self.n_modes

    def step(self, mode: int, action: int) -> tuple[int, tuple[int, ...]]:
        """Return the mode that an action leads to from a mode, and the sources of the registers."""
        sources = self.sources[mode * self.n_actions + action]
        return (self.next_modes[mode][action] if self.next_modes else 0), sources

    @cached_property
    def log_prior(self) -> float:
        """The prior ln p(S), by any names of modes and hidden registers.

        2^-(P - J) for the hidden registers, ``FURTHER_MODE`` for each mode beyond the first, 1 / M for each next mode,
        and p of each map. In a further mode an action makes the map of the first one with probability ``TIED``.
        """
        hidden, n_modes, n_actions = self.n_registers - self.n_slots, self.n_modes, self.n_actions
        permutation, other = log_map_priors(self.n_registers)
        each = [permutation if is_permutation(sources) else other for sources in self.sources]
        total = math.lgamma(hidden + 1) + sum(each[:n_actions]) - hidden * math.log(2)
        if n_modes == 1:
            return total
        total += math.lgamma(n_modes + 1) + (n_modes - 1) * math.log(FURTHER_MODE)
        total -= n_modes * n_actions * math.log(n_modes)
        for mode in range(1, n_modes):
            own = range(mode * n_actions, (mode + 1) * n_actions)
            tied = [self.sources[number] == self.sources[number % n_actions] for number in own]
            for number, is_tied in zip(own, tied, strict=True):
                total += math.log(TIED * is_tied + (1.0 - TIED) * math.exp(each[number]))
            if not any(tied):  # by other names of the hidden registers of this mode it would be as probable
                total += math.lgamma(hidden + 1)
        return total

    def canonical(self) -> SharedStructure:
        """Return this structure without registers that never come into view, the hidden ones named in a fixed order.

        Two structures that differ in the names of hidden registers alone, or of modes, have the same canonical form.
        """
        if self.n_modes > 1:
            return _canonical_modes(self)
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
        closure = _closure(self, limit)
        if closure is None:
            raise TooLargeError(f"structure: more than {limit} poses; expected at most that many")
        return closure

    @property
    def is_believable(self) -> bool:
        """Whether it has no more poses than a structure may have."""
        try:
            self.poses()
        except TooLargeError:
            return False
        return True

    def to_networkx(self) -> networkx.MultiDiGraph[int]:
        """Return the poses as nodes with ``registers``, those at each place, and an edge with ``action`` an action."""
        poses = self.poses()
        import networkx  # it takes a tenth of a second

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


def _canonical_modes(structure: SharedStructure) -> SharedStructure:
    """Return the canonical form of a structure with modes, the least of those that begin with each mode.

    Modes that lead to the first one, or that it leads to, are of the structure; others are not.
    """
    walks = [walk for mode in range(structure.n_modes) if 0 in (walk := _modes_from(structure, mode))]
    longest = max(map(len, walks))
    forms = [_renamed(structure, walk) for walk in walks if len(walk) == longest]
    return min(forms, key=lambda form: (form.next_modes, form.sources))


def _modes_from(structure: SharedStructure, first: int) -> list[int]:
    """Return the modes that are reached from one, breadth first."""
    reached = [first]
    for mode in reached:  # grows while it is walked
        for action in range(structure.n_actions):
            target, _ = structure.step(mode, action)
            if target not in reached:
                reached.append(target)
    return reached


def _renamed(structure: SharedStructure, modes: Sequence[int]) -> SharedStructure:
    """Return what there is in these modes, in this order, with registers named as they come into view."""
    n_slots, actions = structure.n_slots, range(structure.n_actions)
    order = {mode: list(range(n_slots)) for mode in modes}
    grown = True
    while grown:
        grown = False
        for mode in modes:
            for action in actions:
                target, sources = structure.step(mode, action)
                new = [sources[c] for c in order[target] if sources[c] not in order[mode]]
                order[mode] += dict.fromkeys(new)
                grown = grown or bool(new)
    n_registers = max(map(len, order.values()))
    for registers in order.values():  # what never comes into view from some mode alone still has a place there
        registers += [each for each in range(structure.n_registers) if each not in registers]
        del registers[n_registers:]
    maps = []
    for mode in modes:
        name = {register: number for number, register in enumerate(order[mode])}
        for action in actions:
            target, sources = structure.step(mode, action)
            row = [name.get(sources[register], -1) for register in order[target]]
            left = iter([number for number in range(n_registers) if number not in row])
            maps.append(tuple(number if number >= 0 else next(left) for number in row))
    if len(modes) == 1:
        return SharedStructure(n_slots, tuple(maps)).canonical()
    next_modes = tuple(tuple(modes.index(structure.step(mode, action)[0]) for action in actions) for mode in modes)
    return SharedStructure(n_slots, tuple(maps), next_modes)


@lru_cache(maxsize=256)
def _closure(structure: SharedStructure, limit: int) -> Poses | None:
    """Return the closure of the actions, ``None`` if it has more poses than ``limit``: that is kept as well."""
    # Registers out of all view may make more poses, which look alike for ever.
    at_most = limit if structure.n_modes == 1 else 4 * limit
    upright = (0, tuple(range(structure.n_registers)))
    number, poses, successors = {upright: 0}, [upright], []
    turns: list[list[tuple[int, Callable[[tuple[int, ...]], tuple[int, ...]]]]] = []
    for mode in range(structure.n_modes):
        steps = [structure.step(mode, action) for action in range(structure.n_actions)]
        turns.append([(target, itemgetter(*of) if len(of) > 1 else tuple) for target, of in steps])
    for mode, pose in poses:  # grows while it is walked: breadth first
        row = []
        for target, turn in turns[mode]:
            turned = target, turn(pose)
            found = number.setdefault(turned, len(poses))
            if found == len(poses):
                if found >= at_most:
                    return None
                poses.append(turned)
            row.append(found)
        successors.append(row)
    classes = _classes(poses, number)
    registers = np.array([pose for _, pose in poses], dtype=np.int64)
    result = Poses(registers, np.array(successors, dtype=np.int64), *_shares(classes))
    if structure.n_modes > 1:
        result = _minimal(result, classes, structure.n_slots)
        if len(result.registers) > limit:
            return None
    for table in result:
        table.flags.writeable = False  # it is shared by all who ask
    return result


def _classes(
    poses: Sequence[tuple[int, tuple[int, ...]]], number: Mapping[tuple[int, tuple[int, ...]], int]
) -> IntArray:
    """Return the first pose of the class of each pose, those that are the same by other names of the registers."""
    renamings = [pose for mode, pose in poses if mode == 0 and is_permutation(pose)]
    first = np.full(len(poses), -1)
    for index, (mode, pose) in enumerate(poses):
        if first[index] < 0:
            for renaming in renamings:
                first[number[mode, tuple(renaming[register] for register in pose)]] = index
    return first


def _shares(classes: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the first pose of each class, and its share of all poses."""
    first, sizes = np.unique(classes, return_counts=True)
    return first, sizes / len(classes)


def _minimal(poses: Poses, classes: IntArray, n_slots: int) -> Poses:
    """Return the poses with those as one that show the same registers whatever is done."""
    successors = poses.successors
    _, alike = np.unique(poses.registers[:, :n_slots], axis=0, return_inverse=True)
    alike = alike.reshape(-1)
    while True:
        _, finer = np.unique(np.column_stack((alike, alike[successors])), axis=0, return_inverse=True)
        finer = finer.reshape(-1)
        if finer.max() == alike.max():
            break
        alike = finer
    _, kept, name = np.unique(alike, return_index=True, return_inverse=True)
    order = np.argsort(kept)  # breadth first, as before
    name = np.argsort(order)[name.reshape(-1)]
    kept = kept[order]
    # Poses are of one class if they were, or if poses that look alike for ever were.
    import networkx  # it takes a tenth of a second

    joined: networkx.Graph[int] = networkx.Graph(list(zip(name.tolist(), name[classes].tolist(), strict=True)))
    by_class = np.zeros(len(kept), dtype=np.int64)
    for members in networkx.connected_components(joined):
        by_class[list(members)] = min(members)
    return Poses(poses.registers[kept], name[successors[kept]], *_shares(by_class))
