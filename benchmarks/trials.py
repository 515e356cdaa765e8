"""All contestants follow one trial at each size of the memory, in rounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from atg_fg.core.errors import AtgError
from atg_fg.core.memory import RobotMemory
from atg_fg.engines import ENGINES
from atg_fg.storage.presets import preset
from benchmarks.contestants import (
    LARGE_MEMORY,
    REFERENCE,
    Contestant,
    EngineContestant,
    NaiveGraphs,
    agreement,
    follow,
    large_memory,
)
from benchmarks.dense_tables import dense_model, table_bytes
from benchmarks.measuring import Clock, Sample, alternate, median_of, ratios, repeats_for, spread
from benchmarks.memories import Course, course_for, remembered, with_learned_structure
from benchmarks.peers import PEERS, PRESET, make_peer

#: Engines in the order of the tables, with their presets; one that is not registered is no contestant.
ENGINE_PRESETS: Final = (
    (REFERENCE, ("paper", "default")),
    ("gtsam", ("paper", "default")),
    (LARGE_MEMORY, ("paper", "default")),
    ("learned-structure", ("learned",)),
)
#: Learning the structure of more objects takes long.
MOST_LEARNED: Final = 100
#: A decision by the naive graphs takes a minute and more at this size already.
MOST_NAIVE: Final = 100
#: How long a trial takes grows with the memory from about this size on; below, calls cost more than objects.
GROWING: Final = 100
#: From this size on there are fewer rounds.
LARGE: Final = 10_000
LARGE_ROUNDS: Final = 3
#: Seconds that a round of one contestant should take at the least, and how often it follows the trial for that.
ROUND_SECONDS: Final = 0.2
MOST_REPEATS: Final = 20


@dataclass(frozen=True)
class TrialPlan:
    """What is measured at each size.

    Attributes:
        n_rounds: Rounds of all contestants.
        n_actions: Actions of the trial.
        most_seconds: A trial that is expected to take longer is left out, if it is not the reference's.
        most_bytes: Dense tables that take more are left out.
    """

    n_rounds: int = 7
    n_actions: int = 10
    most_seconds: float = 20.0
    most_bytes: float = 2.5e9


class Sizes:
    """The contestants at growing sizes; remembers how long each took, to say which will take too long."""

    def __init__(self, plan: TrialPlan, clock: Clock) -> None:
        self._plan, self._clock = plan, clock
        self._took: dict[tuple[str, str], tuple[int, float]] = {}

    def measure(self, memory: RobotMemory, n_rounds: int) -> dict[str, Any]:
        """Return what each contestant took at the size of this memory, and how it compares."""
        course = course_for(memory, self._plan.n_actions)
        rows: dict[tuple[str, str], dict[str, Any]] = {}
        ready: dict[tuple[str, str], Callable[[], Sample]] = {}
        for name, preset_name, make in contestants(memory, self._plan.most_bytes):
            key = (name, preset_name)
            rows[key] = {"name": name, "preset": preset_name}
            try:
                self._check_time(key, len(memory))
                contestant = make()
                rows[key] |= {"remark": contestant.remark, "agreement": self._agreement(contestant, memory, course)}
            except (AtgError, LeftOutError) as reason:
                rows[key]["left_out"] = str(reason)
            else:
                ready[key] = self._round_of(contestant, course)
        if len(memory) <= MOST_NAIVE:
            naive = NaiveGraphs(memory, course)
            rows[naive.name, naive.preset] = {"name": naive.name, "preset": naive.preset, "remark": naive.remark}
            ready[naive.name, naive.preset] = partial(naive.sample, self._clock)
        by_name = {"/".join(key): take for key, take in ready.items()}
        taken = alternate(by_name, n_rounds)
        for key in ready:
            rows[key] |= _compared(taken["/".join(key)], taken["/".join(reference_of(key[1]))])
            if "trial" in rows[key]["rounds"] and len(memory) >= GROWING:
                # The least, for a slow moment of the machine is no reason to leave something out.
                self._took[key] = (len(memory), min(rows[key]["rounds"]["trial"]))
        return {"remembered": len(memory), "n_rounds": n_rounds, "contestants": list(rows.values())}

    def _check_time(self, key: tuple[str, str], n_objects: int) -> None:
        if key not in self._took or key == reference_of(key[1]):
            return
        size, seconds = self._took[key]
        expected = seconds * n_objects / size
        if expected > self._plan.most_seconds:
            raise LeftOutError(
                f"a trial would take {expected:,.0f} s, as it took {seconds:.2g} s at {size:,}; "
                f"the limit is {self._plan.most_seconds:g} s"
            )

    def _agreement(self, contestant: Contestant, memory: RobotMemory, course: Course) -> dict[str, Any] | None:
        if not contestant.same_model or (contestant.name, contestant.preset) == reference_of(contestant.preset):
            return None
        return agreement(contestant, EngineContestant(REFERENCE, contestant.preset, memory), course)

    def _round_of(self, contestant: Contestant, course: Course) -> Callable[[], Sample]:
        # The first is not counted: libraries compile and load then.
        seconds = follow(contestant, course, self._clock)["trial"]
        repeats = repeats_for(seconds, ROUND_SECONDS, MOST_REPEATS)
        return lambda: median_of([follow(contestant, course, self._clock) for _ in range(repeats)])


class LeftOutError(Exception):
    """Why a contestant was not measured at a size."""


def reference_of(preset_name: str) -> tuple[str, str]:
    """Return name and preset of what a contestant with this preset is held against."""
    return REFERENCE, "default" if preset(preset_name).learn_in_trial else "paper"


def contestants(memory: RobotMemory, most_bytes: float) -> Iterator[tuple[str, str, Callable[[], Contestant]]]:
    """Yield name, preset and maker of each contestant for a memory; one that cannot be made raises when it is."""
    for name, presets in ENGINE_PRESETS:
        for preset_name in presets if name in ENGINES else ():
            yield name, preset_name, partial(_engine, name, preset_name, memory)
    for name in PEERS:
        yield name, PRESET, partial(_peer, name, memory, most_bytes)


def _engine(name: str, preset_name: str, memory: RobotMemory) -> Contestant:
    if name == LARGE_MEMORY:
        return large_memory(preset_name, memory)
    if not preset(preset_name).learn_structure:
        return EngineContestant(name, preset_name, memory)
    if len(memory) > MOST_LEARNED:
        raise LeftOutError(f"learning the structure of {len(memory):,} objects takes long; at most {MOST_LEARNED}")
    return EngineContestant(name, preset_name, with_learned_structure(len(memory)))


def _peer(name: str, memory: RobotMemory, most_bytes: float) -> Contestant:
    needed = table_bytes(memory)
    if name == "pymdp":
        n_states = sum(graph.n_known + 1 for graph in memory) + 1
        needed += 8 * len(memory.assumptions.actions) * n_states**2
    if needed > most_bytes:
        raise LeftOutError(f"its dense tables take {needed / 1e9:,.1f} GB; the limit is {most_bytes / 1e9:g} GB")
    return make_peer(name, dense_model(memory, preset(PRESET)))


def _compared(seconds: dict[str, list[float]], reference: dict[str, list[float]]) -> dict[str, Any]:
    """Return the rounds of a contestant, their spread, and the ratios to the reference."""
    return {
        "rounds": seconds,
        "milliseconds": {name: spread([1e3 * each for each in values]) for name, values in seconds.items()},
        "ratio": {name: spread(ratios(values, reference[name])) for name, values in seconds.items()},
    }


def measure_all(sizes: list[int], plan: TrialPlan, clock: Clock) -> Iterator[tuple[RobotMemory, dict[str, Any]]]:
    """Yield the memory of each size, from the smallest, and what was measured on it.

    Sizes from ``LARGE`` on take ``LARGE_ROUNDS`` rounds at the most.
    """
    measured = Sizes(plan, clock)
    for size in sorted(sizes):
        memory = remembered(size)
        yield memory, measured.measure(memory, plan.n_rounds if size < LARGE else min(plan.n_rounds, LARGE_ROUNDS))
