"""Tests that were recorded, in a log or a database: what they were of, and their trials."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.storage.database.connection import is_database
from atg_fg.storage.database.trial_log import TEST_KIND, read_stored_experiments, read_stored_trials
from atg_fg.storage.recorded_header import read_header
from atg_fg.storage.trial_log import from_line, read_log


@dataclass(frozen=True)
class RecordedTest:
    """A test that was recorded.

    Attributes:
        header: Its seed, and what its plan has other than usual, checked.
        parameters: Of the model.
        assumptions: What was taken for granted.
        trials: In their order.
        place: Where it comes from, for messages.
    """

    header: Mapping[str, Any]
    parameters: ModelParameters
    assumptions: Assumptions
    trials: tuple[TrialSummary, ...]
    place: str


def recorded_tests(path: Path, assumptions: Assumptions | None = None) -> list[RecordedTest]:
    """Return the test in a log of trials, or the tests in a database.

    Args:
        path: What ``table1 --records`` wrote.
        assumptions: What was taken for granted where the world is a user's own.

    Raises:
        InvalidInputError: It cannot be read, or anything in it is not as it should be.
    """
    if is_database(path):
        return [
            stored_test(path, each, assumptions) for each in read_stored_experiments(path) if each.kind == TEST_KIND
        ]
    header, lines = read_log(path)
    parameters, found = _of_known_world(header, str(path), assumptions)
    trials = tuple(from_line(line, f"{path}: trial {index}", found) for index, line in enumerate(lines))
    return [RecordedTest(header, parameters, found, trials, str(path))]


def stored_test(path: Path, experiment: Experiment, assumptions: Assumptions | None = None) -> RecordedTest:
    """Return the test that is an experiment in a database; errors are those of ``recorded_tests``."""
    place = f"{path}: experiment {experiment.number}"
    header = {"seed": experiment.seed, **experiment.parameters}
    parameters, found = _of_known_world(header, place, assumptions)
    trials = tuple(read_stored_trials(path, experiment.number, found))
    return RecordedTest(header, parameters, found, trials, place)


def _of_known_world(
    header: Mapping[str, Any], place: str, assumptions: Assumptions | None
) -> tuple[ModelParameters, Assumptions]:
    parameters, found = read_header(header, place, assumptions)
    if found is None:
        raise InvalidInputError(
            f"{place}: world {header['world']!r} is no world of this package; expected --memory FILE of such a world"
        )
    return parameters, found
