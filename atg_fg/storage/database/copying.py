"""Records of trials taken from one file into a database."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from atg_fg.core.checks import whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.core.version import __version__
from atg_fg.storage.database import trial_rows
from atg_fg.storage.database.checking import assumptions_of_tests
from atg_fg.storage.database.trial_log import TEST_KIND, read_stored_experiments, read_stored_trials
from atg_fg.storage.recorded_header import read_header
from atg_fg.storage.trial_log import from_line, read_log, to_line


def records_in(
    path: Path | str, renamed: Mapping[str, str] | None = None
) -> Iterator[tuple[Experiment | None, list[TrialSummary]]]:
    """Yield the experiments in a database with their trials, and at last the trials that belong to none.

    Args:
        path: The database.
        renamed: ATGs that have another name where the records are going.

    Raises:
        InvalidInputError: It cannot be read, or a record in it is not as it should be.
    """
    for experiment in read_stored_experiments(path):
        trials = read_stored_trials(path, experiment.number)
        yield replace(experiment, number=0), [_renamed(trial, renamed or {}) for trial in trials]
    alone = [_renamed(trial, renamed or {}) for trial in read_stored_trials(path, alone=True)]
    if alone:
        yield None, alone


def records_in_log(path: Path) -> tuple[Experiment, list[TrialSummary]]:
    """Return the test in a log of trials (``….jsonl.gz``), and its trials.

    Raises:
        InvalidInputError: It cannot be read, or is not such a log.
    """
    header, lines = read_log(path)
    seed = whole_number(header.get("seed"), f"{path}: seed")
    _, assumptions = read_header(header, str(path))
    trials = [from_line(line, f"{path}: trial {number}", assumptions) for number, line in enumerate(lines)]
    del header["seed"]
    return Experiment(TEST_KIND, header, seed, __version__), trials


def add_records(
    connection: sqlite3.Connection, place: str, records: Iterable[tuple[Experiment | None, list[TrialSummary]]]
) -> tuple[int, int]:
    """Write experiments and trials, but for experiments that are there with the same trials. Inside of a transaction.

    Args:
        connection: To the database.
        place: For error messages.
        records: As ``records_in`` and ``records_in_log`` return them.

    Returns:
        How many experiments and trials were written.

    Raises:
        InvalidInputError: A record in the database is not as it should be, afterwards.
    """
    there = {
        (_content(each), _digest(trial_rows.read_trials(connection, place, each.number)))
        for each in list(trial_rows.read_experiments(connection, place))
    }
    n_experiments = n_trials = 0
    for experiment, trials in records:
        if experiment is not None and (_content(experiment), _digest(trials)) in there:
            continue
        number = None if experiment is None else trial_rows.add_experiment(connection, experiment)
        n_experiments += experiment is not None
        for trial in trials:
            trial_rows.add_trial(connection, trial, number)
            n_trials += 1
    # What is in the database from here on must be readable: another program may have written the records.
    assumptions, unsound = assumptions_of_tests(connection, place)
    trials_there = trial_rows.trials_or_faults(connection, place, assumptions)
    for fault in (*unsound.values(), *(found for _, found in trials_there if isinstance(found, InvalidInputError))):
        raise InvalidInputError(f"{fault}; nothing was imported")
    return n_experiments, n_trials


def _renamed(trial: TrialSummary, renamed: Mapping[str, str]) -> TrialSummary:
    """Return a trial with the new names; the ATGs of one that this memory did not learn from are others."""
    if trial.learned is None:
        return trial
    matched = None if trial.matched is None else renamed.get(trial.matched, trial.matched)
    return replace(trial, matched=matched, learned=renamed.get(trial.learned, trial.learned))


def _content(experiment: Experiment) -> tuple[str, str, int | None]:
    return experiment.kind, trial_rows.canonical(experiment.parameters), experiment.seed


def _digest(trials: Iterable[TrialSummary]) -> str:
    """Return a text that two experiments share only if their trials went the same way."""
    return trial_rows.canonical([to_line(trial) for trial in trials])
