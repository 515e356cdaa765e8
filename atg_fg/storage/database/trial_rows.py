"""Trials and experiments, written to a database and read from it."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final, get_args

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.records import Experiment, StoredStep, StoredTrial, Verdict
from atg_fg.storage.checked_json import parse_json, plain_json, read_integer, read_list, read_object, read_text

#: Rows that are read at once: no more than these are in RAM, and no writer waits for a reader.
_PAGE: Final = 200


_NUMBERS: Final = ("unseen", "entropy")


def add_experiment(connection: sqlite3.Connection, experiment: Experiment) -> int:
    """Write an experiment and return its number. Inside of a transaction."""
    row = connection.execute(
        "INSERT INTO experiments (kind, seed, parameters, version) VALUES (?, ?, ?, ?)",
        (experiment.kind, _seed(experiment.seed), canonical(experiment.parameters), experiment.version),
    )
    return int(row.lastrowid or 0)


def add_trial(connection: sqlite3.Connection, trial: StoredTrial, experiment: int | None) -> int:
    """Write a trial as the next one of an experiment; return its number there. Inside of a transaction."""
    (number,) = connection.execute(
        "SELECT coalesce(max(number) + 1, 0) FROM trials WHERE experiment IS ?", (experiment,)
    ).fetchone()
    row = connection.execute(
        "INSERT INTO trials (experiment, number, verdict, matched, learned, learned_patterns, lost_truth)"
        " VALUES (?, ?, ?, ?, ?, ?, ?)",
        (
            experiment,
            number,
            trial.verdict,
            trial.matched,
            trial.learned,
            _optional(trial.learned_patterns),
            _optional(trial.lost_truth),
        ),
    )
    rows = (
        (
            row.lastrowid,
            index,
            canonical(step.observed),
            step.pattern,
            step.unseen,
            step.entropy,
            step.log_evidence,
            _optional(step.expected_entropy),
            step.action,
            step.purpose,
            canonical(step.truth),
        )
        for index, step in enumerate(trial.steps)
    )
    connection.executemany("INSERT INTO steps VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", rows)
    return int(number)


def added(connection: sqlite3.Connection, experiment: Experiment | None, trial: StoredTrial) -> Experiment | None:
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
    for number, kind, seed, parameters, version in connection.execute(
        "SELECT id, kind, seed, parameters, version FROM experiments ORDER BY id"
    ):
        where = f"{place}: experiment {number}"
        given = _json(parameters, f"{where}: parameters")
        if not isinstance(given, dict):
            raise InvalidInputError(f"{where}: parameters: {given!r}; expected an object")
        if seed is not None and not (isinstance(seed, str) and seed.isascii() and seed.isdigit() and len(seed) < 4000):
            raise InvalidInputError(f"{where}: seed: {seed!r}; expected a whole number")
        text = read_text(version, f"{where}: version")
        yield Experiment(read_text(kind, f"{where}: kind"), given, None if seed is None else int(seed), text, number)


def read_trials(connection: sqlite3.Connection, place: str, experiment: int | None = None) -> Iterator[StoredTrial]:
    """Yield trials in the order in which they were written, a few in RAM at a time.

    Args:
        connection: To the database.
        place: For error messages.
        experiment: Number of the experiment whose trials they are; all trials if not given.

    Raises:
        InvalidInputError: One that is not as it should be.
    """
    last = 0
    columns = "id, experiment, number, verdict, matched, learned, learned_patterns, lost_truth"
    while True:
        page = connection.execute(
            f"SELECT {columns} FROM trials WHERE id > ? AND (? OR experiment = ?) ORDER BY id LIMIT ?",
            (last, experiment is None, experiment, _PAGE),
        ).fetchall()
        for row in page:
            yield _trial(connection, row, f"{place}: trial {row[0]!r}")
        if len(page) < _PAGE:
            return
        if page[-1][0] <= last:  # only in a damaged file; there it would go on for ever
            raise InvalidInputError(f"{place}: trial {page[-1][0]}; expected trials in ascending order")
        last = page[-1][0]


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
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"record: {error}; expected values that JSON knows") from error


def _trial(connection: sqlite3.Connection, row: Sequence[Any], place: str) -> StoredTrial:
    key, experiment, number, verdict, matched, learned, patterns, lost = row
    if verdict not in get_args(Verdict):
        raise InvalidInputError(f"{place}: verdict: {verdict!r}; expected one of: {', '.join(get_args(Verdict))}")
    names = [
        None if name is None else read_text(name, f"{place}: {what}")
        for name, what in ((matched, "matched"), (learned, "learned"))
    ]
    steps = [
        _step(step, index, f"{place}: step {index}")
        for index, step in enumerate(
            connection.execute(
                "SELECT number, observed, pattern, unseen, entropy, log_evidence, expected_entropy, action, purpose,"
                " truth FROM steps WHERE trial = ? ORDER BY number",
                (key,),
            )
        )
    ]
    if not steps:
        raise InvalidInputError(f"{place}: no steps; expected at least one look")
    return StoredTrial(
        None if experiment is None else read_integer(experiment, f"{place}: experiment", least=1),
        read_integer(number, f"{place}: number", least=0),
        verdict,
        names[0],
        names[1],
        None if patterns is None else tuple(_symbols(patterns, f"{place}: learned_patterns")),
        None if lost is None else _info(lost, f"{place}: lost_truth"),
        tuple(steps),
    )


def _step(row: Sequence[Any], index: int, place: str) -> StoredStep:
    number, observed, pattern, unseen, entropy, log_evidence, expected, action, purpose, truth = row
    if number != index:
        raise InvalidInputError(f"{place}: number {number!r}; expected {index}")
    for name, value in zip(_NUMBERS, (unseen, entropy), strict=True):
        if not isinstance(value, float):
            raise InvalidInputError(f"{place}: {name}: {value!r}; expected a number")
    if not (log_evidence is None or isinstance(log_evidence, float)):
        raise InvalidInputError(f"{place}: log_evidence: {log_evidence!r}; expected a number")
    return StoredStep(
        tuple(_symbols(observed, f"{place}: observed")),
        None if pattern is None else read_integer(pattern, f"{place}: pattern", least=0),
        unseen,
        entropy,
        log_evidence,
        None if expected is None else _info(expected, f"{place}: expected_entropy"),
        None if action is None else read_text(action, f"{place}: action"),
        None if purpose is None else read_text(purpose, f"{place}: purpose"),
        _info(truth, f"{place}: truth"),
    )


def _symbols(text: Any, place: str) -> list[int | None]:
    entries = read_list(_json(text, place), place)
    return [None if entry is None else read_integer(entry, place, least=0) for entry in entries]


def _info(text: Any, place: str) -> dict[str, Any]:
    value = _json(text, place)
    return read_object(value, place, (), optional=tuple(value) if isinstance(value, dict) else ())


def _json(text: Any, place: str) -> Any:
    return parse_json(read_text(text, place), place)


def _optional(value: Any) -> str | None:
    return None if value is None else canonical(value)


def _seed(seed: int | None) -> str | None:
    return None if seed is None else str(seed)
