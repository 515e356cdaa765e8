"""The paper's experiments (section 5): tests of 100 trials from an empty memory, and Table 1."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from atg_fg.core.checks import GREATEST_SEED, MANY, brief, instance, plain_text, sequence, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.records import Mended, TrialRecord, TrialSummary
from atg_fg.engines import begin_trial, engine_for
from atg_fg.experiments.executors.base import is_cluster, run_pieces
from atg_fg.experiments.executors.steps import step_done
from atg_fg.experiments.scores import Score, TestResult
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.inference.interface import Inference
from atg_fg.inference.smoothing import smoothed_patterns
from atg_fg.learning.duplicates import merge_duplicates
from atg_fg.learning.structured_memory import StructuredMemory, memory_for
from atg_fg.policies import Policy, as_policy, check_entropy_threshold, make_policy
from atg_fg.storage.crop_folder import CropFolder
from atg_fg.storage.database.trial_log import DatabaseTrialLog, check_not_in_database
from atg_fg.storage.growing_file import check_not_begun
from atg_fg.storage.memory_files import goes_to_database, path_of, save_memory
from atg_fg.storage.plain_files import make_folder
from atg_fg.storage.trial_log import TrialLog
from atg_fg.worlds.base import World
from atg_fg.worlds.registry import assumptions_of, make_world_with, sense_of

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def unusual(plan: DataclassInstance) -> dict[str, Any]:
    """Return what a plan has other than usual: a plan may get more to say, and old records still be gone on with."""
    usual = _described(type(plan)())
    return {name: value for name, value in _described(plan).items() if value != usual[name]}


def _described(plan: DataclassInstance) -> dict[str, Any]:
    description = asdict(plan)
    if not description["parameters"]["learn_structure"]:
        del description["parameters"]["learn_structure"]
    return description


@dataclass(frozen=True)
class TestPlan:
    """What one test of the paper is made of.

    Attributes:
        world: Name of the world.
        world_options: Passed on to the world, such as ``slip``.
        engine: Name of the inference engine.
        policy: Name of the policy, or ``module:object`` of a user's own.
        parameters: α, δ and whether to learn within the trial.
        smoothed_learning: Whether the memory learns the patterns that are probable given all evidence of a trial,
            rather than those that were seen whole.
        merge_duplicates: Whether the memory looks after each trial for ATGs of one object, and merges them.
        n_actions: Actions a trial; the most, if trials end when the verdict is settled.
        n_trials: Trials a test.
        n_objects: |O|, unless a user's own world says another in its assumptions.
        settled: Entropy of the verdict in nats at which a trial ends; ``None`` if no trial ends early.
    """

    __test__ = False  # the paper calls it a test; pytest should not collect it

    world: str = "ideal"
    world_options: dict[str, Any] = field(default_factory=dict)
    engine: str = "gtsam"
    policy: str = "entropy"
    parameters: ModelParameters = field(default_factory=ModelParameters)
    smoothed_learning: bool = False
    merge_duplicates: bool = False
    n_actions: int = 10
    n_trials: int = 100
    n_objects: int = 100
    settled: float | None = None

    def __post_init__(self) -> None:
        for name in ("n_actions", "n_trials", "n_objects"):
            whole_number(getattr(self, name), name, 1, MANY)
        instance(self.parameters, "parameters", ModelParameters)
        for name in instance(self.world_options, "world_options", dict):
            plain_text(name, "name of an option of the world")
        engine_for(self.engine, self.parameters)
        if self.settled is not None:
            check_entropy_threshold(self.settled, "settled")
        make_policy(self.policy, self.settled)

    def make_world(self, objects_seed: int) -> World:
        """Return this plan's world, with objects drawn by ``objects_seed`` unless it is a user's own."""
        return make_world_with(self.world, self.n_objects, objects_seed, **self.world_options)


def run_test(
    plan: TestPlan,
    seed: int,
    records: Path | str | None = None,
    resume: bool = False,
    on_trial: Callable[[int, TrialRecord], None] | None = None,
    memories: Path | str | None = None,
    policy: Policy | None = None,
    crops: bool = False,
) -> TestResult:
    """Run a test from an empty memory and score it.

    Each trial has one generator, spawned from ``SeedSequence(seed)``; the first child draws the objects.

    Args:
        plan: World, engine, policy and sizes.
        seed: Seed of the test.
        records: Folder, or database, in which every trial is saved as it ends.
        resume: Go on after the trials that are already there; the result is the same as of a test in one go.
        on_trial: Called with the number and the record of each trial that is run.
        memories: Folder in which the memory is saved at the end, or a database for the memory of one test.
        policy: Chooses the actions, and ends trials, in place of what the plan names, such as an ``AgentPolicy``.
        crops: Keep beside the records what was cut out for each symbol of each trial (``CropFolder``).

    Raises:
        InvalidInputError: The records are of another test, or already there while ``resume`` is false; there are
            records of a policy that the plan does not name; or there are to be crops without a folder of records, or
            of a world that has none.
    """
    if policy is not None and records is not None:
        raise InvalidInputError("records: of a policy that the plan does not name; expected none, or its name in it")
    instance(plan, "plan", TestPlan)
    records, memories = _path(records, "records"), _path(memories, "memories")
    if crops:
        check_crops(records)
    objects_seed, *trial_seeds = np.random.SeedSequence(whole_number(seed, "seed", 0, GREATEST_SEED)).spawn(
        1 + plan.n_trials
    )
    policy = make_policy(plan.policy, plan.settled) if policy is None else as_policy(policy)
    score = Score()
    with closing(plan.make_world(int(objects_seed.generate_state(1)[0]))) as world:
        empty = RobotMemory(assumptions_of(world, plan.n_objects), sense=sense_of(world))
        memory = memory_for(plan.parameters, empty)
        log = _open_log(plan, seed, records, memory)
        if log is not None:
            for trial in log.resume() if resume else log.begin():
                _learn_and_score(trial, memory, plan, score)
                step_done()
        camera = CropFolder(_log_path(records, seed), world) if crops and records is not None else None
        first = score.n_trials
        for number in range(first, plan.n_trials):
            inference = begin_trial(plan.engine, memory, plan.parameters)
            rng = np.random.default_rng(trial_seeds[number])
            on_step = None if camera is None else camera.take
            record = run_trial(
                world, inference, policy, plan.n_actions, rng, on_step=on_step, is_checked=number > first
            )
            smoothed = _smoothed(inference, record) if plan.smoothed_learning else None
            trial = TrialSummary.of(record, learned_patterns=smoothed)
            trial = replace(trial, mended=_learn_and_score(trial, memory, plan, score))
            if camera is not None:
                trial = camera.save(number, trial)
            if log is not None:
                log.append(trial)
            if on_trial is not None:
                on_trial(number, record)
            step_done()
    if memories is not None:
        in_folder = not goes_to_database(memories)
        save_memory(memory, make_folder(memories) / f"memory-{seed:04}.json" if in_folder else memories)
    return score.result(seed, merging=plan.merge_duplicates)


def _path(given: Path | str | None, place: str) -> Path | None:
    return None if given is None else path_of(given, place)


def check_crops(records: Path | None) -> None:
    """Raise ``InvalidInputError`` unless there is a folder of records that crops can be kept in."""
    if records is None or goes_to_database(records):
        raise InvalidInputError(f"crops: records {records}; expected a folder of records to keep them in")


def _learn_and_score(trial: TrialSummary, memory: RobotMemory, plan: TestPlan, score: Score) -> tuple[Mended, ...]:
    """Learn from a trial, score it, and return which earlier trials turned out to be of other objects."""
    before = memory.reassignments if isinstance(memory, StructuredMemory) else ()
    learned = learn_from(trial, memory)
    score.add(trial, learned, memory)
    score.mend(memory)
    if plan.merge_duplicates and learned is not None:
        score.add_merges(merge_duplicates(memory, plan.parameters, learned))
    after = memory.reassignments[len(before) :] if isinstance(memory, StructuredMemory) else ()
    return tuple(Mended(each.trial, each.old, each.new) for each in after)


def _open_log(
    plan: TestPlan, seed: int, records: Path | None, memory: RobotMemory
) -> TrialLog | DatabaseTrialLog | None:
    if records is None:
        return None
    if goes_to_database(records):
        return DatabaseTrialLog(records, _header(plan, seed), memory.assumptions)
    make_folder(records)
    return TrialLog(_log_path(records, seed), _header(plan, seed), memory.assumptions)


def _check_not_begun(plan: TestPlan, seed: int, records: Path) -> None:
    if goes_to_database(records):
        check_not_in_database(records, _header(plan, seed))
    else:
        check_not_begun(_log_path(records, seed))


def _header(plan: TestPlan, seed: int) -> dict[str, Any]:
    return {"seed": seed, **unusual(plan)}


def _log_path(records: Path, seed: int) -> Path:
    return records / f"test-{seed:04}.jsonl.gz"


def _smoothed(inference: Inference, record: TrialRecord) -> list[int | None] | None:
    """Return the patterns that are probable given all evidence and the verdict, ``None`` if there is no verdict."""
    if record.verdict not in ("known", "novel"):
        return None
    names = record.names
    return smoothed_patterns(inference, len(names) if record.matched is None else names.index(record.matched))


def run_tests(
    plans: Sequence[tuple[TestPlan, int]],
    jobs: int = 1,
    records: Path | str | None = None,
    resume: bool = False,
    memories: Path | str | None = None,
    executor: str = "process",
    on_result: Callable[[int, TestResult], None] | None = None,
    on_trials: Callable[[int], None] | None = None,
    crops: bool = False,
) -> list[TestResult]:
    """Run each (plan, seed), beginning in this order, and return the results in this order.

    The results are the same for any executor and any number of jobs; see ``executors.run_pieces`` for these and for
    ``on_result``. ``records``, ``resume``, ``memories`` and ``crops`` are as for ``run_test``; all workers must have
    the folders. ``on_trials`` is called in this thread with the number of trials that were done since the last call.

    Raises:
        InvalidInputError: As for ``run_test`` and ``run_pieces``.
    """
    for number, piece in enumerate(sequence(plans, "plans")):
        if not (isinstance(piece, tuple) and len(piece) == 2 and isinstance(piece[0], TestPlan)):
            raise InvalidInputError(f"plans[{number}]: {brief(piece)}; expected a TestPlan and a seed")
    records, memories = _path(records, "records"), _path(memories, "memories")
    if records is not None:
        records = Path(os.path.realpath(records if goes_to_database(records) else make_folder(records)))
        for plan, seed in plans if not resume else ():
            _check_not_begun(plan, seed, records)
    # A worker always resumes: a worker that died has left a part of the test to it.
    resolved = None if memories is None else Path(os.path.realpath(memories))
    run = partial(_run_one_of, records=records, memories=resolved, crops=crops)

    def keep(number: int, result: TestResult) -> None:
        if on_result is not None:
            on_result(number, result)
        if on_trials is not None and is_cluster(executor):
            on_trials(plans[number][0].n_trials)

    return run_pieces(run, plans, executor, jobs, keep, on_trials)


def _run_one_of(piece: tuple[TestPlan, int], records: Path | None, memories: Path | None, crops: bool) -> TestResult:
    return run_test(*piece, records, resume=True, memories=memories, crops=crops)
