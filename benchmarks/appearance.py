"""What would simpler means make of boxes without tags? Baselines beside `table1 --world picture-box`.

Run with ``python benchmarks/appearance.py [TESTS [WORLD [METHOD]]]``. Tests of 100 trials, 10 actions, seeds from 0;
95 % Wilson intervals over all trials. The worlds are ``picture-box``; ``look-alikes``, a third of whose boxes look the
same as another one; and ``meshes``. The methods, all of them if none is named:

* ``nearest`` neighbour: an object is the one that a remembered look is nearest to, or new if that is too far; the
  threshold is the one that does best on these very tests. Of the last look, or of all looks of a trial on average;
* a ``bag`` of looks: classes found as usual, preset ``default``, but actions say nothing (α so large that all aspects
  follow alike);
* a ``fixed`` codebook: classes of the looks of other boxes or things, preset ``default``;
* for comparison, classes ``found`` as usual, preset ``default``.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from rich.console import Console
from rich.table import Table

from atg_fg.core.checks import one_of
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import FloatArray
from atg_fg.core.sense import SensedTrial, readings_of
from atg_fg.core.statistics import wilson_interval
from atg_fg.engines import begin_trial
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import RandomPolicy
from atg_fg.senses.appearance import AppearanceSense, AppearanceTrial
from atg_fg.senses.codebook import Codebook
from atg_fg.storage.presets import preset
from atg_fg.worlds.base import World
from atg_fg.worlds.registry import assumptions_of, make_world_with, sense_of

#: Name and options of each world.
WORLDS: Final[dict[str, tuple[str, dict[str, Any]]]] = {
    "picture-box": ("picture-box", {}),
    "look-alikes": ("picture-box", {"look_alikes": 0.33, "differ_in": "weight"}),
    "meshes": ("meshes", {}),
}
METHODS: Final = ("nearest", "bag", "fixed", "found")
N_TRIALS: Final = 100
N_ACTIONS: Final = 10
_THRESHOLDS: Final = 60
#: α of a model in which what follows an action says nothing.
_NO_TRANSITIONS: Final = 1e9
#: Seeds of boxes whose pictures make the fixed codebook: there are more numbers of classes than pictures on the boxes
#: of one world.
_OTHER_WORLDS: Final = (888_888, 999_999)
#: Looks at each of these.
_OTHER_LOOKS: Final = 800


class ClosedCodebook(Codebook):
    """Classes that stay as they are: looks teach them nothing, and none is new."""

    def add(self, look: FloatArray, number: int, times: float = 1.0) -> None:
        """Learn nothing."""

    def copy(self) -> ClosedCodebook:
        """Return this one, which never changes."""
        return self


class ClosedSense(AppearanceSense):
    """A sense whose classes were made beforehand from other pictures."""

    @classmethod
    def of(cls, sense: AppearanceSense, means: FloatArray, n_looks: int) -> ClosedSense:
        """Return a sense that takes each look for one at the nearest of some pictures, of encoded ``means`` [V, D]."""
        closed = cls(sense.space, sense.alphabet, within=sense.codebook.within)
        codebook = ClosedCodebook(sense.space.between, sense.alphabet.n_symbols, within=sense.codebook.within)
        codebook.counts, codebook.sums = np.full(len(means), float(n_looks)), means * n_looks
        closed.codebook = codebook
        return closed

    def learn(self, trial: SensedTrial) -> None:
        """Learn nothing."""

    def copy(self) -> ClosedSense:
        """Return this one, which never changes."""
        return self

    def begin(self) -> AppearanceTrial:
        """Return what reads the looks of a trial."""
        return AppearanceTrial(self.space, self.alphabet, self.codebook)


@dataclass(frozen=True)
class FixedCodebookPlan(TestPlan):
    """A test in which the classes of appearance were made beforehand."""

    def make_world(self, objects_seed: int) -> World:
        """Return the plan's world, with a sense of looks that none of its objects has."""
        world = super().make_world(objects_seed)
        own: Any = world.unwrapped
        own.sense = ClosedSense.of(own.sense, _other_looks(own, self.world), 8)
        return world


def _other_looks(world: Any, name: str) -> FloatArray:
    """Return mean looks, encoded, of as many kinds in another world as there are numbers of classes."""
    looks: dict[tuple[int, int], list[FloatArray]] = {}
    for objects_seed in _OTHER_WORLDS:
        with closing(make_world_with(name, 60, objects_seed)) as other:
            for seed in range(_OTHER_LOOKS // len(world.alphabet.slots)):
                observation, info = other.reset(seed=seed)
                seen: Any = observation
                for features, picture in zip(seen["appearance"], info["pattern"], strict=True):
                    looks.setdefault((objects_seed, picture), []).append(world.sense.space.encode(features))
    return np.array([np.mean(each, axis=0) for each in looks.values()][: world.alphabet.n_symbols])


def random_trials(seed: int, name: str, options: dict[str, Any]) -> list[tuple[int, FloatArray]]:
    """Return the object and all readings, shape [T, slots · D], of each trial of a test with random actions."""
    objects_seed, *trial_seeds = np.random.SeedSequence(seed).spawn(1 + N_TRIALS)
    trials = []
    with closing(make_world_with(name, 100, int(objects_seed.generate_state(1)[0]), **options)) as world:
        memory = RobotMemory(assumptions_of(world, 100), sense=sense_of(world))
        for each in trial_seeds:
            inference = begin_trial("bayes-filter", memory, preset("default"))
            record = run_trial(world, inference, RandomPolicy(), N_ACTIONS, np.random.default_rng(each))
            truths = [step.truth for step in record.steps]
            readings = np.array([[value for slot in look for value in slot or ()] for look in readings_of(truths)])
            trials.append((int(truths[0]["object"]), readings))
    return trials


def nearest_neighbour(tests: Sequence[Sequence[tuple[int, FloatArray]]], *, last: bool) -> int:
    """Return how many trials are right with the threshold that makes most of them right."""
    distances = [_distances(trials, last=last) for trials in tests]
    spread = np.concatenate([each[np.isfinite(each)] for each in distances])
    grid = np.quantile(spread, np.linspace(0.0, 0.2, _THRESHOLDS))
    return max(
        sum(_right(trials, table, float(threshold)) for trials, table in zip(tests, distances, strict=True))
        for threshold in grid
    )


def _distances(trials: Sequence[tuple[int, FloatArray]], *, last: bool) -> FloatArray:
    """Return how far each trial is from each earlier one: looks to the nearest look there, on average, [N, N]."""
    table = np.full((len(trials), len(trials)), np.inf)
    for now, (_, looks) in enumerate(trials):
        seen = looks[-1:] if last else looks
        for before in range(now):
            apart = ((seen[:, None] - trials[before][1][None]) ** 2).sum(axis=-1)
            table[now, before] = float(np.sqrt(apart.min(axis=1)).mean())
    return table


def _right(trials: Sequence[tuple[int, FloatArray]], distances: FloatArray, threshold: float) -> int:
    """Return how many verdicts are right; a trial that is matched is of the same ATG as the one it is nearest to."""
    owner: list[int] = []  # what each trial was taken for
    right, met = 0, set[int]()
    for now, (presented, _) in enumerate(trials):
        nearest = int(distances[now, :now].argmin()) if now else -1
        known = nearest >= 0 and distances[now, nearest] < threshold
        owner.append(owner[nearest] if known else presented)
        right += owner[-1] == presented if known else presented not in met
        met.add(presented)
    return right


def main() -> None:
    """Print the table."""
    n_tests = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    shown = one_of(sys.argv[2], "world", WORLDS) if len(sys.argv) > 2 else "picture-box"
    name, options = WORLDS[shown]
    methods = [one_of(sys.argv[3], "method", METHODS)] if len(sys.argv) > 3 else METHODS
    total = n_tests * N_TRIALS
    rows: list[tuple[str, int]] = []
    if "nearest" in methods:
        tests = [random_trials(seed, name, options) for seed in range(n_tests)]
        rows += [
            ("nearest neighbour, last look", nearest_neighbour(tests, last=True)),
            ("nearest neighbour, all looks", nearest_neighbour(tests, last=False)),
        ]
    usual = TestPlan(world=name, world_options=options, engine="bayes-filter")
    plans = {
        "bag": ("bag of looks", replace(usual, parameters=ModelParameters(_NO_TRANSITIONS, 1e-8))),
        "fixed": (
            "fixed codebook, preset default",
            FixedCodebookPlan(world=name, world_options=options, engine=usual.engine),
        ),
        "found": ("classes found, preset default", usual),
    }
    for told, plan in (plans[method] for method in methods if method in plans):
        rows.append((told, sum(run_test(plan, seed).success[0] for seed in range(n_tests))))
    table = Table(title=f"{n_tests} tests of {N_TRIALS} trials, seeds 0 to {n_tests - 1}", title_justify="left")
    table.add_column(shown)
    table.add_column("success, %", justify="right")
    for name, right in rows:
        low, high = wilson_interval(right, total)
        table.add_row(name, f"{100 * right / total:.1f} ({100 * low:.1f}-{100 * high:.1f})")
    Console(highlight=False, width=120).print(table)


if __name__ == "__main__":
    main()
