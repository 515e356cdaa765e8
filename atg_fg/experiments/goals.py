"""The paper's goal experiment (section 5): a memory is learned, then objects at stations are driven to goal aspects."""

from __future__ import annotations

import gzip
import json
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.checks import MANY, whole_number
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.goals import Goal
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.records import TrialRecord, TrialSummary
from atg_fg.engines import begin_trial, engine_for
from atg_fg.experiments.executors.base import run_pieces
from atg_fg.experiments.exploration import complete_memory, learned_memory
from atg_fg.experiments.goal_scores import ServedObject, score, table_of_goals
from atg_fg.experiments.table1 import unusual
from atg_fg.experiments.trial import run_trial
from atg_fg.inference.all_different import identity_given_others
from atg_fg.policies import POLICIES, GoalPolicy, check_entropy_threshold, make_policy
from atg_fg.policies.goal import ENTROPY_THRESHOLD, PLANNERS, UNREACHABLE
from atg_fg.storage.checked_json import parse_json, plain_json
from atg_fg.storage.growing_file import check_not_begun
from atg_fg.storage.plain_files import make_folder, read_gzipped_text, write_bytes_atomically
from atg_fg.storage.trial_log import to_line
from atg_fg.worlds.arcube import ORIENTATIONS, make_arcubes, shown_pattern
from atg_fg.worlds.base import World
from atg_fg.worlds.registry import check_arcube_world
from atg_fg.worlds.stations import AtStation, make_stations

#: As ``learning_actions``: the memory knows all that there is to know.
COMPLETE: Final = 0


@dataclass(frozen=True)
class GoalPlan:
    """What one run of the goal experiment is made of.

    Attributes:
        world: Name of the world in which the goals are to be reached.
        world_options: Passed on to it.
        engine: Name of the inference engine.
        parameters: α, δ and whether to learn within the trial.
        planner: Name of the planner.
        unreachable: What to do about a goal that no known path leads to.
        settled: Entropy of O below which an object is recognised, nats.
        n_stations: Objects before the robot, all different.
        n_remembered: Cubes that the memory is learned from.
        n_objects: |O|.
        learning_world: Name of the world in which the memory is learned; the ideal one, since it takes many actions.
        learning_policy: Policy that explores while the memory is learned.
        learning_actions: Actions on each cube while the memory is learned; ``COMPLETE`` gives it complete ATGs.
        n_actions: Actions on each object before the robot, at most.
    """

    world: str = "ideal"
    world_options: dict[str, Any] = field(default_factory=dict)
    engine: str = "gtsam"
    parameters: ModelParameters = field(default_factory=ModelParameters)
    planner: str = "attempts"
    unreachable: str = "declare"
    settled: float = ENTROPY_THRESHOLD
    n_stations: int = 3
    n_remembered: int = 20
    n_objects: int = 100
    learning_world: str = "ideal"
    learning_policy: str = "explore"
    learning_actions: int = 20
    n_actions: int = 40

    def __post_init__(self) -> None:
        for name in ("n_stations", "n_remembered", "n_objects", "n_actions"):
            whole_number(getattr(self, name), name, 1, MANY)
        whole_number(self.learning_actions, "learning_actions", 0, MANY)
        for name, larger in (("n_stations", "n_remembered"), ("n_remembered", "n_objects")):
            if getattr(self, name) > getattr(self, larger):
                raise InvalidInputError(
                    f"{name}: {getattr(self, name)}; expected at most {larger} = {getattr(self, larger)}"
                )
        check_entropy_threshold(self.settled, "settled")
        engine_for(self.engine, self.parameters)
        for role, name, known in (
            ("planner", self.planner, PLANNERS),
            ("policy", self.learning_policy, POLICIES),
            ("unreachable", self.unreachable, UNREACHABLE),
        ):
            if name not in known:
                raise unknown_name(role, name, known)
        check_arcube_world("world", self.world)
        check_arcube_world("learning_world", self.learning_world)


@dataclass(frozen=True, eq=False)
class GoalRun:
    """One run: what came of each goal, and the record of the trial at each station."""

    served: tuple[ServedObject, ...]
    records: tuple[TrialRecord, ...]

    def _repr_html_(self) -> str:
        return table_of_goals(self.served)._repr_html_()


def run_goals(plan: GoalPlan, seed: np.random.SeedSequence, on_look: Callable[[World], None] | None = None) -> GoalRun:
    """Learn a memory, set up the objects with random goals, and serve one after the other.

    Args:
        plan: Worlds, engine, planner and sizes.
        seed: Of the run; all of its generators are spawned from it.
        on_look: Called with the world after every look, such as to film it.
    """
    cubes_seed, learning_seed, setup_seed, *station_seeds = seed.spawn(3 + plan.n_stations)
    cubes = make_arcubes(plan.n_remembered, int(cubes_seed.generate_state(1)[0]))
    assumptions = arcube_assumptions(plan.n_objects)
    if plan.learning_actions == COMPLETE:
        memory = complete_memory(assumptions, cubes)
    else:
        policy = make_policy(plan.learning_policy)
        rng = np.random.default_rng(learning_seed)
        memory = learned_memory(
            assumptions, cubes, policy, plan.learning_actions, rng, plan.learning_world, plan.parameters
        )
    setup = np.random.default_rng(setup_seed)
    objects = setup.permutation(len(cubes))[: plan.n_stations].tolist()
    served, records = [], []
    memory_prior = IdentityBelief.uniform(len(memory), memory.n_unseen)
    beliefs: list[IdentityBelief] = []
    with closing(make_stations(plan.world, plan.n_stations, cubes=cubes, **plan.world_options)) as world:
        world.reset(seed=int(setup.integers(2**31)), options={"objects": objects})
        for station, (number, station_seed) in enumerate(zip(objects, station_seeds, strict=True)):
            wanted = shown_pattern(cubes[number], int(setup.integers(len(ORIENTATIONS))))
            goal_policy = GoalPolicy(Goal(assumptions.alphabet, wanted), plan.planner, plan.unreachable, plan.settled)
            # All objects are different: this one is none of those that were served before.
            prior = identity_given_others(memory_prior, beliefs)
            inference = begin_trial(plan.engine, memory, plan.parameters, prior=prior)
            there, rng = AtStation(world, station), np.random.default_rng(station_seed)
            on_step = None if on_look is None else lambda _: on_look(world)
            record = run_trial(there, inference, goal_policy, plan.n_actions, rng, on_step=on_step)
            beliefs.append(record.belief.with_prior(memory_prior, instead_of=prior))
            reached = record.lost_truth is None and goal_policy.is_reached(inference)
            learns = plan.parameters.learn_in_trial
            served.append(score(record, goal_policy.goal, reached, memory, cubes[number], learns))
            records.append(record)
    return GoalRun(tuple(served), tuple(records))


def run_many(
    plan: GoalPlan,
    seed: int,
    n_runs: int,
    jobs: int = 1,
    records: Path | None = None,
    resume: bool = False,
    executor: str = "process",
    on_run: Callable[[], None] | None = None,
) -> list[tuple[ServedObject, ...]]:
    """Run the experiment ``n_runs`` times and return what came of each run, in order.

    Each run has a seed of its own, spawned from ``SeedSequence(seed)``; any executor and any number of jobs give the
    same results.

    Args:
        plan: What each run is made of.
        seed: Of all runs.
        n_runs: How many.
        jobs: As for ``executors.run_pieces``.
        records: Folder in which every run is saved as it ends; all workers must have it.
        resume: Leave out the runs that are already there.
        executor: As for ``executors.run_pieces``.
        on_run: Called after each run.

    Raises:
        InvalidInputError: The records are there already, or of another experiment.
    """
    whole_number(n_runs, "runs", least=1)
    if records is not None:
        records = make_folder(records).resolve()
        for number in range(n_runs) if not resume else ():
            check_not_begun(_run_path(records, number))

    tell = None if on_run is None else lambda _number, _served: on_run()
    return run_pieces(partial(_run_and_save, plan, seed, records), range(n_runs), executor, jobs, tell)


def run_seed(seed: int, number: int) -> np.random.SeedSequence:
    """Return the seed of the run with this number."""
    return np.random.SeedSequence(seed, spawn_key=(number,))


def _run_path(records: Path, number: int) -> Path:
    return records / f"run-{number:04}.json.gz"


def _run_and_save(plan: GoalPlan, seed: int, records: Path | None, number: int) -> tuple[ServedObject, ...]:
    """Run once. A run that is saved already is only read: a worker may have died right after it saved the run."""
    if records is None:
        return run_goals(plan, run_seed(seed, number)).served
    file = GoalRunFile(_run_path(records, number), {"seed": seed, "run": number, **unusual(plan)})
    if os.path.exists(file.path):
        return file.read()
    run = run_goals(plan, run_seed(seed, number))
    file.write(run.served, run.records)
    return run.served


_FORMAT: Final = {"format": "atg-fg/goal-run", "version": 1}


class GoalRunFile:
    """The file of one run.

    Args:
        path: ``….json.gz``.
        header: What run this is; a file of another one is refused.
    """

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        self.path = path
        self._header = json.loads(json.dumps({**_FORMAT, **header}, default=plain_json))

    def write(self, served: Sequence[ServedObject], records: Sequence[TrialRecord]) -> None:
        """Save what came of each goal, with what was seen and done."""
        entries = [
            {**asdict(each), "trial": to_line(TrialSummary.of(record))}
            for each, record in zip(served, records, strict=True)
        ]
        document = {**self._header, "served": entries}
        text = json.dumps(document, default=plain_json, allow_nan=False, separators=(",", ":"))
        write_bytes_atomically(self.path, gzip.compress(text.encode(), mtime=0))

    def read(self) -> tuple[ServedObject, ...]:
        """Return what came of each goal.

        Raises:
            InvalidInputError: The file cannot be read, or it is of another run.
        """
        text = read_gzipped_text(self.path, "expected a run that --records wrote")
        try:
            document = parse_json(text, "JSON")
            served = tuple(_served(each) for each in document.pop("served"))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise InvalidInputError(
                f"{self.path}: cannot be read: {error!r}; expected a run that --records wrote"
            ) from error
        if document.get("parameters", {}).get("learn_structure") is False:  # as older versions wrote it
            del document["parameters"]["learn_structure"]
        if document != self._header:
            raise InvalidInputError(
                f"{self.path}: holds {json.dumps(document)}; expected the run of {json.dumps(self._header)}"
            )
        return served


def _served(entry: dict[str, Any]) -> ServedObject:
    del entry["trial"]
    for name in ("goal", "nearest"):
        entry[name] = None if entry[name] is None else tuple(entry[name])
    return ServedObject(**entry)
