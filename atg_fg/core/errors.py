"""The errors a user can cause; each message names the place, the value and what was expected."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

#: A longer message loses its middle: its beginning says the place, its end what was expected.
MAX_MESSAGE = 2000


class AtgError(Exception):
    """Any error of this project that a user can cause and mend."""

    def __init__(self, message: str = "") -> None:
        half = MAX_MESSAGE // 2
        super().__init__(message if len(message) <= MAX_MESSAGE else f"{message[:half]} … {message[-half:]}")


class InvalidInputError(AtgError, ValueError):
    """A value, file or option that is not what was expected."""


class UnknownNameError(AtgError, LookupError):
    """A name that is in no registry, or a graph that is not in the memory."""


class ImpossibleEvidenceError(AtgError, ValueError):
    """Evidence that has probability zero under the model."""


class TooLargeError(AtgError, ValueError):
    """A computation refused before it takes memory, because of its size."""


class BusyMemoryError(AtgError, TimeoutError):
    """A memory database that another process was writing to for longer than this one waited."""


class CameraError(AtgError, OSError):
    """A camera, a video or a folder of images that gives no frames, or none in time."""


class MissingDependencyError(AtgError, ImportError):
    """An optional package that is not installed; the message names the extra that brings it."""


@contextmanager
def placed(place: str) -> Iterator[None]:
    """Put a place in front of the message of an error about input or a name that is raised inside."""
    try:
        yield
    except (InvalidInputError, UnknownNameError) as error:
        raise type(error)(f"{place}: {error}") from error


@contextmanager
def needed_by(what: str, package: str, extra: str) -> Iterator[None]:
    """Say what needs a package, and which extra brings it, where what is imported inside is not installed.

    Raises:
        MissingDependencyError: It is not.
    """
    try:
        yield
    except ImportError as error:
        raise MissingDependencyError(
            f'{what}: {package} is not installed; expected it from: pip install "atg-fg[{extra}]"'
        ) from error


class WorkerLostError(AtgError, RuntimeError):
    """Work that was given up because every worker that ran it died."""


def unknown_name(kind: str, name: object, known: Iterable[object]) -> UnknownNameError:
    """Return the error for ``name`` missing from a registry, listing the names ``known`` there."""
    # No other name is long: a number may have too many digits to be written at all.
    told = repr(name if isinstance(name, str) else type(name))
    told = told if len(told) <= 200 else f"{told[:197]}..."
    names = ", ".join(sorted(map(str, known)))
    return UnknownNameError(f"{kind}: unknown name {told}; expected one of: {names}")
