"""Trials and experiments, written to a database and read from it."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import plain_text, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.records import Experiment, StepSummary, TrialSummary
from atg_fg.storage.checked_json import parse_json, plain_json, read_info
from atg_fg.storage.trial_log import read_step, summary_of

#: Rows that are read at once: no more than these are in RAM, and no writer waits for a reader.
_PAGE: Final = 200

#: Columns of a step, but for its number; those that hold JSON; columns of a trial.
_STEP: Final = (
    "observed", "pattern", "unseen", "entropy", "log_evidence", "expected_entropy", "action", "purpose", "truth",
)  # fmt: skip
_DOCUMENTS: Final = ("observed", "expected_entropy", "truth")
_TRIAL: Final = "experiment, number, verdict, matched, learned, learned_patterns, lost_truth, mistakes, mended"


def add_experiment(connection: sqlite3.Connection, experiment: Experiment) -> int:
    """Write an experiment and return its number. Inside of a transaction."""
    row = connection.execute(
        "INSERT INTO experiments (kind, seed, parameters, version) VALUES (?, ?, ?, ?)",
        (experiment.kind, _seed(experiment.seed), canonical(experiment.parameters), experiment.version),
    )
    return int(row.lastrowid or 0)


def add_trial(connection: sqlite3.Connection, trial: TrialSummary, experiment: int | None) -> int:
    """Write a trial as the next one of an experiment; return its number there. Inside of a transaction."""
    (number,) = connection.execute(
        "SELECT coalesce(max(number) + 1, 0) FROM trials WHERE experiment IS ?", (experiment,)
    ).fetchone()
    documents = (trial.learned_patterns, trial.lost_truth, trial.mistakes or None, trial.mended or None)
    row = connection.execute(
        f"INSERT INTO trials ({_TRIAL}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
        (experiment, number, trial.verdict, trial.matched, trial.learned, *map(_optional, documents)),
    )
    rows = ((row.lastrowid, index, *_values_of(step)) for index, step in enumerate(trial.steps))
    connection.executemany("INSERT INTO steps VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", rows)
    return int(number)


def _values_of(step: StepSummary) -> Iterator[Any]:
    """Yield what stands in the columns of a step."""
    for name in _STEP:
        value = getattr(step, name)
        yield _optional(value) if name in _DOCUMENTS else value


def added(connection: sqlite3.Connection, experiment: Experiment | None, trial: TrialSummary) -> Experiment | None:
    """Write a trial, and its experiment if that is not in the database yet; return the experiment as it is there."""
    if experiment is not None and experiment.number == 0:
        experiment = replace(experiment, number=add_experiment(connection, experiment))
    add_trial(connection, trial, None if experiment is None else experiment.number)
    return experiment


def read_experiments(connection: sqlite3.Connection, place: str) -> Iterator[Experiment]:
    """Yield all experiments in their order.

    Raises:
        InvalidInputError: One that is not as it should be; the message names ``place``.
    """
    for _, found in experiments_or_faults(connection, place):
        if isinstance(found, InvalidInputError):
            raise found
        yield found


def experiments_or_faults(
    connection: sqlite3.Connection, place: str
) -> Iterator[tuple[int, Experiment | InvalidInputError]]:
    """Yield the number of each experiment, with the experiment, or with what is wrong with it."""
    for (number,) in connection.execute("SELECT id FROM experiments ORDER BY id").fetchall():
        where = f"{place}: experiment {number}"
        try:
            kind, seed, parameters, version = _row(
                connection, "SELECT kind, seed, parameters, version FROM experiments WHERE id = ?", number, where
            )
            given = read_info(_document(parameters, f"{where}: parameters"), f"{where}: parameters")
            is_seed = isinstance(seed, str) and seed.isascii() and seed.isdigit() and len(seed) < 4000
            if seed is not None and not is_seed:
                raise InvalidInputError(f"{where}: seed: {seed!r:.60}; expected a whole number")
            text = plain_text(version, f"{where}: version")
            seed = None if seed is None else int(seed)
            yield number, Experiment(plain_text(kind, f"{where}: kind"), given, seed, text, number)
        except InvalidInputError as error:
            yield number, error


def read_trials(
    connection: sqlite3.Connection,
    place: str,
    experiment: int | None = None,
    assumptions: Assumptions | None = None,
    *,
    alone: bool = False,
) -> Iterator[TrialSummary]:
    """Yield trials in the order in which they were written, a few in RAM at a time.

    Args:
        connection: To the database.
        place: For error messages.
        experiment: Number of the experiment whose trials they are; all trials if not given.
        assumptions: Of the trials, as for ``trial_log.from_line``.
        alone: Whether only those are asked for that belong to no experiment.

    Raises:
        InvalidInputError: One that is not as it should be.
    """
    for key in _keys(connection, place, experiment, alone=alone):
        yield _trial(connection, key, f"{place}: trial {key!r}", assumptions)


def trials_or_faults(
    connection: sqlite3.Connection, place: str, assumptions: Mapping[int | None, Assumptions | None]
) -> Iterator[tuple[int, TrialSummary | InvalidInputError]]:
    """Yield the number of each row of trials, with the trial, or with what is wrong with it.

    Args:
        connection: To the database.
        place: For error messages.
        assumptions: Of the trials of each experiment, where they are known.
    """
    for key in _keys(connection, place):
        where = f"{place}: trial {key!r}"
        try:
            (experiment,) = _row(connection, "SELECT experiment FROM trials WHERE id = ?", key, where)
            yield key, _trial(connection, key, where, assumptions.get(experiment))
        except InvalidInputError as error:
            yield key, error


def _keys(
    connection: sqlite3.Connection, place: str, experiment: int | None = None, *, alone: bool = False
) -> Iterator[int]:
    last, all_of_them = 0, experiment is None and not alone
    while True:
        page = connection.execute(
            "SELECT id FROM trials WHERE id > ? AND (? OR experiment IS ?) ORDER BY id LIMIT ?",
            (last, all_of_them, experiment, _PAGE),
        ).fetchall()
        yield from (key for (key,) in page)
        if len(page) < _PAGE:
            return
        if page[-1][0] <= last:  # only in a damaged file; there it would go on for ever
            raise InvalidInputError(f"{place}: trial {page[-1][0]}; expected trials in ascending order")
        last = page[-1][0]


def _row(connection: sqlite3.Connection, question: str, key: int, place: str) -> Sequence[Any]:
    """Return the one row that a question is answered by, or raise ``InvalidInputError`` if it is no text of UTF-8."""
    rows = _rows(connection, question, key, place)
    if len(rows) != 1:
        raise InvalidInputError(f"{place}: {len(rows)} rows; expected one")
    return rows[0]


def _rows(connection: sqlite3.Connection, question: str, key: int, place: str) -> list[Sequence[Any]]:
    try:
        return list(connection.execute(question, (key,)))
    except sqlite3.OperationalError as error:
        if "decode" not in str(error):
            raise
        raise InvalidInputError(f"{place}: {str(error).splitlines()[0]:.80}; expected texts in UTF-8") from error


def find_experiment(connection: sqlite3.Connection, wanted: Experiment) -> int | None:
    """Return the number of the experiment of this kind, seed and parameters, whatever version ran it."""
    row = connection.execute(
        "SELECT id FROM experiments WHERE kind = ? AND seed IS ? AND parameters = ?",
        (wanted.kind, _seed(wanted.seed), canonical(wanted.parameters)),
    ).fetchone()
    return None if row is None else int(row[0])


def canonical(value: Any) -> str:
    """Return a value as JSON; equal values give equal texts.

    Raises:
        InvalidInputError: JSON knows no such value.
    """
    try:
        return json.dumps(value, default=plain_json, allow_nan=False, sort_keys=True, separators=(",", ":"))
    except (TypeError, ValueError, RecursionError) as error:
        raise InvalidInputError(f"record: {error}; expected values that JSON knows") from error


def _trial(connection: sqlite3.Connection, key: int, place: str, assumptions: Assumptions | None) -> TrialSummary:
    row = _row(connection, f"SELECT {_TRIAL} FROM trials WHERE id = ?", key, place)
    experiment, number, verdict, matched, learned, patterns, lost, mistakes, mended = row
    steps = []
    question = f"SELECT number, {', '.join(_STEP)} FROM steps WHERE trial = ? ORDER BY number"
    for index, step in enumerate(_rows(connection, question, key, place)):
        where = f"{place}: step {index}"
        if step[0] != index:
            raise InvalidInputError(f"{where}: number {step[0]!r}; expected {index}")
        fields = dict(zip(_STEP, step[1:], strict=True))
        fields |= {name: _document(fields[name], f"{where}: {name}") for name in _DOCUMENTS}
        steps.append(read_step(fields, where, assumptions))
    trial = summary_of(
        {
            "verdict": verdict,
            "matched": matched,
            "learned": _document(patterns, f"{place}: learned_patterns"),
            "lost_truth": _document(lost, f"{place}: lost_truth"),
            **({} if mistakes is None else {"mistakes": _document(mistakes, f"{place}: mistakes")}),
            **({} if mended is None else {"mended": _document(mended, f"{place}: mended")}),
        },
        steps,
        place,
        assumptions,
    )
    return replace(
        trial,
        learned=None if learned is None else plain_text(learned, f"{place}: learned"),
        experiment=None if experiment is None else whole_number(experiment, f"{place}: experiment", least=1),
        number=whole_number(number, f"{place}: number"),
    )


def _document(text: Any, place: str) -> Any:
    return None if text is None else parse_json(plain_text(text, place), place)


def _optional(value: Any) -> str | None:
    return None if value is None else canonical(value)


def _seed(seed: int | None) -> str | None:
    return None if seed is None else str(seed)
