"""The trials in a robot memory database as a page: those of tests as in their logs, others from their own records."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.report.content import Report, TrialPage, shown_parameters
from atg_fg.report.graphs import TrialGraphs
from atg_fg.report.summaries import looks_of, told_truth, told_verdict
from atg_fg.report.test_log import test_report
from atg_fg.storage.database.memory_reading import database_holds_memory
from atg_fg.storage.database.trial_log import TEST_KIND, read_stored_experiments, read_stored_trials
from atg_fg.storage.memory_files import load_memory
from atg_fg.storage.recorded_test import read_header, stored_test
from atg_fg.worlds.registry import WORLDS

_NOTE: Final = (
    "A database keeps no belief over single objects: what is shown of it is the probability that the object was never "
    "met. The graph is the ATG that the trial was learned into, as it is now."
)


def read_database(path: Path, memory: RobotMemory | None) -> Report:
    """Return the page of all trials in a database.

    Args:
        path: The database.
        memory: Says what was taken for granted, where the database holds no memory and a test's world is a user's own.

    Raises:
        InvalidInputError: It cannot be read, holds no trial, or anything in it is not as it should be.
    """
    if memory is None and database_holds_memory(path):
        memory = load_memory(path)
    experiments: list[Experiment | None] = [*read_stored_experiments(path), None]
    reports = [report for each in experiments if (report := _experiment_report(each, memory, path)) is not None]
    if not reports:
        raise InvalidInputError(f"{path}: no trials; expected at least one")
    return reports[0] if len(reports) == 1 else _joined(reports, path)


def _joined(reports: list[Report], path: Path) -> Report:
    """Return one page of several experiments under the same assumptions."""
    assumptions = reports[0].assumptions
    if any(report.assumptions != assumptions for report in reports):
        raise InvalidInputError(f"{path}: tests in different worlds; expected one kind of objects in a page")
    trials = [
        replace(page, title=f"{number}: {page.title}")
        for number, report in enumerate(reports, 1)
        for page in report.trials
    ]
    notes = tuple(dict.fromkeys(note for report in reports for note in report.notes))
    title = f"{len(trials)} trials of {len(reports)} experiments"
    return Report(title, shown_parameters({"file": path.name}), notes, assumptions, tuple(trials))


def _experiment_report(experiment: Experiment | None, memory: RobotMemory | None, path: Path) -> Report | None:
    """Return the page of an experiment, or of the trials that belong to none; ``None`` if there are no trials."""
    stated = None if memory is None else memory.assumptions
    if experiment is not None and experiment.kind == TEST_KIND:
        test = stored_test(path, experiment, stated)
        return test_report(test) if test.trials else None
    assumptions = stated or arcube_assumptions()
    if experiment is None:
        trials = list(read_stored_trials(path, assumptions=assumptions, alone=True))
    else:
        # The memory that is there now may be of another world than the one that the trials were run in.
        if experiment.parameters.get("world") in list(WORLDS):
            assumptions = (
                read_header(experiment.parameters, f"{path}: experiment {experiment.number}")[1] or assumptions
            )
        trials = list(read_stored_trials(path, experiment.number, assumptions))
    if not trials:
        return None
    if memory is not None and replace(assumptions, n_objects=memory.assumptions.n_objects) != memory.assumptions:
        memory = None
    pages = [_page(trial, memory, assumptions) for trial in trials]
    kind = "trial" if experiment is None else experiment.kind
    parameters = {} if experiment is None else {"seed": experiment.seed, **experiment.parameters}
    title = f"{kind}, {len(pages)} of them" if len(pages) > 1 else f"A {kind}, look by look"
    return Report(title, shown_parameters(parameters), (_NOTE,), assumptions, tuple(pages))


def _page(trial: TrialSummary, memory: RobotMemory | None, assumptions: Assumptions) -> TrialPage:
    graphs = TrialGraphs(memory, assumptions, trial.detections, trial.actions)
    index = graphs.index_of(trial.learned)
    return TrialPage(
        title=f"trial {trial.number}",
        verdict=told_verdict(trial.verdict, trial.matched),
        truth=told_truth(trial.truths[-1]),
        right=None,
        looks=tuple(replace(look, graph=index) for look in looks_of(trial)),
        graphs=graphs.graphs,
    )
