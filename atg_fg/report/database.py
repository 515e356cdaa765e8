"""The trials in a robot memory database as a page: those of tests as in their logs, others from their own records."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Final

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Experiment, StoredTrial
from atg_fg.report import checked
from atg_fg.report.content import Report, TrialPage, shown_parameters
from atg_fg.report.graphs import TrialGraphs
from atg_fg.report.summaries import read_looks, told_verdict
from atg_fg.report.test_log import test_report
from atg_fg.storage.database.memory_reading import database_holds_memory
from atg_fg.storage.database.trial_log import TEST_KIND, read_stored_experiments, read_stored_trials
from atg_fg.storage.memory_files import load_memory

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
    experiments = {each.number: each for each in read_stored_experiments(path)}
    by_experiment: defaultdict[int | None, list[StoredTrial]] = defaultdict(list)
    for trial in read_stored_trials(path):
        by_experiment[trial.experiment].append(trial)
    if not by_experiment:
        raise InvalidInputError(f"{path}: no trials; expected at least one")
    if memory is None and database_holds_memory(path):
        memory = load_memory(path)
    reports = [
        _experiment_report(experiments.get(number or 0), trials, memory, path)
        for number, trials in by_experiment.items()
    ]
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


def _experiment_report(
    experiment: Experiment | None, trials: list[StoredTrial], memory: RobotMemory | None, path: Path
) -> Report:
    if experiment is not None and experiment.kind == TEST_KIND:
        header = {"seed": experiment.seed, **experiment.parameters}
        return test_report(header, [trial.line() for trial in trials], path, memory)
    assumptions = arcube_assumptions() if memory is None else memory.assumptions
    pages = [_page(trial, memory, assumptions, f"{path}: trial {trial.number}") for trial in trials]
    kind = "trial" if experiment is None else experiment.kind
    parameters = {} if experiment is None else {"seed": experiment.seed, **experiment.parameters}
    title = f"{kind}, {len(pages)} of them" if len(pages) > 1 else f"A {kind}, look by look"
    return Report(title, shown_parameters(parameters), (_NOTE,), assumptions, tuple(pages))


def _page(trial: StoredTrial, memory: RobotMemory | None, assumptions: Assumptions, place: str) -> TrialPage:
    looks = [
        replace(look, expected=_expected(step.expected_entropy, assumptions))
        for look, step in zip(read_looks(trial.line(), assumptions, place), trial.steps, strict=True)
    ]
    actions = [look.action for look in looks if look.action is not None]
    graphs = TrialGraphs(memory, assumptions, [look.seen for look in looks], actions)
    index = graphs.index_of(trial.learned)
    return TrialPage(
        title=f"trial {trial.number}",
        verdict=told_verdict(trial.verdict, trial.matched),
        truth=checked.told_truth(trial.line()["truth"][-1]),
        right=None,
        looks=tuple(replace(look, graph=index) for look in looks),
        graphs=graphs.graphs,
    )


def _expected(entropies: dict[str, float] | None, assumptions: Assumptions) -> tuple[tuple[str, float], ...]:
    return tuple((name, entropies[name]) for name in assumptions.actions) if entropies else ()
