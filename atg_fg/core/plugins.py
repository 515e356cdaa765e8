"""Code of a user's own by name: ``module:object`` on Python's path, or what an installed package registers.

A name that comes here is one that a user typed. Nothing is imported because a file names it.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from atg_fg.core.errors import InvalidInputError


def imported(kind: str, name: str) -> Any:
    """Return the object named ``module:object``; the module is imported.

    Args:
        kind: What it is to be, for error messages.
        name: Words with dots between them, a colon, and the name of an object in that module.

    Raises:
        InvalidInputError: There is no such module, it fails when it is imported, or there is no such object in it.
    """
    place, expected = f"{kind} {name!r}", "expected module:object, on Python's path"
    module, _, attribute = name.partition(":")
    if not all(word.isidentifier() for word in module.split(".")):
        raise InvalidInputError(f"{place}: cannot be imported: no name of a module; {expected}")
    try:
        found = import_module(module)
    except (Exception, SystemExit) as error:  # whatever a user's module does
        raise InvalidInputError(f"{place}: cannot be imported: {told(error)}; {expected}") from error
    for part in attribute.split("."):
        if not hasattr(found, part):
            raise InvalidInputError(f"{place}: {module} has no {attribute!r}; expected module:object")
        found = getattr(found, part)
    return found


@cache
def registered(group: str) -> dict[str, EntryPoint]:
    """Return what installed packages register under an entry point's group, by name; nothing is imported yet."""
    return {entry.name: entry for entry in entry_points(group=group)}


def loaded(kind: str, entry: EntryPoint) -> Any:
    """Return the object that an installed package registers.

    Raises:
        InvalidInputError: It cannot be imported.
    """
    try:
        return entry.load()
    except (Exception, SystemExit) as error:
        raise InvalidInputError(
            f"{kind} {entry.name!r}: cannot be imported from {entry.value}: {told(error)}; expected an object there"
        ) from error


def told(error: BaseException) -> str:
    """Return in one line what went wrong in code of a user's own."""
    what = " ".join(str(error).split())
    return what if isinstance(error, ImportError) else f"{type(error).__name__}{what and f': {what}'}"
