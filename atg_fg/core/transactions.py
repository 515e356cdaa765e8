"""A memory that may be kept in a file while it learns: each change of it is one transaction."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from functools import wraps
from typing import Any, Concatenate, ParamSpec, Protocol, Self, TypeVar

from atg_fg.core.records import Experiment, TrialRecord, TrialSummary

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")
_Memory = TypeVar("_Memory", bound="Persistent")


class Keeper(Protocol):
    """Keeps a memory and its file in step."""

    def transaction(self, memory: Any) -> AbstractContextManager[None]:
        """Write what changes inside, all of it or nothing."""

    def refresh(self, memory: Any) -> None:
        """Take over what others have written."""

    def begin_experiment(self, kind: str, parameters: Mapping[str, Any], seed: int | None) -> None:
        """Say what the trials from here on belong to."""

    def add_record(self, record: TrialRecord, learned: str | None) -> None:
        """Write the record of a trial, inside of a transaction."""

    def experiments(self) -> Iterator[Experiment]:
        """Yield the experiments in the file."""

    def trials(self, experiment: int | None) -> Iterator[TrialSummary]:
        """Yield the trials in the file."""

    def close(self) -> None:
        """Let go of the file."""


class Persistent:
    """What a memory that was opened from a file can do; without a file, transactions and records do nothing.

    It is a context manager that closes the file.
    """

    _keeper: Keeper | None = None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_keeper": None}  # a copy is in no file

    @property
    def is_kept(self) -> bool:
        """Whether there is a file that keeps what this memory learns."""
        return self._keeper is not None

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Take all that is learned inside for one change: the file has all of it afterwards, or nothing.

        If there is an error inside, or the file cannot be written, the memory is as it is in the file. Transactions
        inside of another one belong to it.

        Raises:
            BusyMemoryError: Another process was writing all the time that this one waited.
            InvalidInputError: The file cannot be written, or was opened to be read.
        """
        if self._keeper is None:
            yield
        else:
            with self._keeper.transaction(self):
                yield

    def refresh(self) -> None:
        """Take over what other processes have written since; each transaction does so when it begins."""
        if self._keeper is not None:
            self._keeper.refresh(self)

    def begin_experiment(self, kind: str, parameters: Mapping[str, Any], seed: int | None = None) -> None:
        """Say what the records from here on belong to.

        Args:
            kind: Such as ``"trial"``.
            parameters: All that it is run with, as JSON knows it.
            seed: Of the experiment.
        """
        if self._keeper is not None:
            self._keeper.begin_experiment(kind, parameters, seed)

    def add_record(self, record: TrialRecord, learned: str | None) -> None:
        """Keep the record of a trial in the file, if there is one.

        Args:
            record: Of the trial.
            learned: Name of the ATG that it went to, ``None`` if nothing was learned from it.
        """
        if self._keeper is not None:
            with self.transaction():
                self._keeper.add_record(record, learned)

    def experiments(self) -> Iterator[Experiment]:
        """Yield the experiments in the file, in their order; none if there is no file."""
        return iter(()) if self._keeper is None else self._keeper.experiments()

    def trials(self, experiment: int | None = None) -> Iterator[TrialSummary]:
        """Yield the records of trials in the file, in their order, a few in RAM at a time; none if there is no file.

        Args:
            experiment: Number of the experiment whose trials they are; all if not given.
        """
        return iter(()) if self._keeper is None else self._keeper.trials(experiment)

    def close(self) -> None:
        """Let go of the file; the memory stays, as one that is in no file."""
        if self._keeper is not None:
            self._keeper.close()
            self._keeper = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def one_transaction(
    method: Callable[Concatenate[_Memory, _Arguments], _Result],
) -> Callable[Concatenate[_Memory, _Arguments], _Result]:
    """Make each call of a memory's method a transaction, or a part of one that has begun."""

    @wraps(method)
    def kept(memory: _Memory, /, *args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        with memory.transaction():
            return method(memory, *args, **kwargs)

    return kept
