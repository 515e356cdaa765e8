"""No command writes over a file that it reads, writes twice to one, or works for what cannot be written in the end.

An option or argument of type ``Path`` is read, unless ``writable=True`` says that it is written to, as
``options.written`` does. What refuses a path that cannot be written, such as ``check_writable``, stands beside the
option, as one more annotation of the parameter. So this is done once, for all commands, from how they are declared.
"""

from __future__ import annotations

import inspect
import os
import re
import stat
from collections.abc import Callable, Iterator
from functools import wraps
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple, get_args, get_origin, get_type_hints

from typer.models import ParameterInfo

from atg_fg.core.errors import InvalidInputError

#: Pairs of parameters that may be of one file: a memory that goes on learning, and tests beside their memory.
IN_PLACE: Final = (frozenset({"memory", "save_memory"}), frozenset({"records", "save_memories"}))

#: What commands call the files in a folder that they are given.
IN_FOLDERS: Final = re.compile(
    r"(test|run|memory)-\d+\.(json|jsonl|db|npz)(\.gz)?|look-\d+\.png|"
    r"film\.gif|(frame|belief|entropy)\.png|trial\.jsonl|memory\.json"
)

#: The files that SQLite keeps beside a database.
_BESIDE: Final = ("-wal", "-shm", "-journal")
#: What is printed has the tags beside it, in a file of the same name that ends in ``.json``.
_PRINTED: Final = (".pdf", ".3mf", ".stl")


class Parameter(NamedTuple):
    """A parameter of a command that is a path.

    Attributes:
        name: In the command's function.
        written: Whether the command writes to it.
        check: Refuses a path that cannot be written; ``None`` if the command sees to that itself.
    """

    name: str
    written: bool
    check: Callable[[str], object] | None = None


class _Given(NamedTuple):
    """A path as it was given, and what for."""

    parameter: Parameter
    path: Path


def parameters_of(command: Callable[..., Any]) -> list[Parameter]:
    """Return the parameters of a command's function that are paths."""
    found = []
    for name, hint in get_type_hints(inspect.unwrap(command), include_extras=True).items():
        if get_origin(hint) is not Annotated:
            continue
        kind, *extras = get_args(hint)
        written = any(isinstance(extra, ParameterInfo) and extra.writable for extra in extras)
        if written or _is_path(kind) or name == "preset":
            checks = [extra for extra in extras if not isinstance(extra, ParameterInfo)]
            found.append(Parameter(name, written, *checks))
    return found


def _is_path(kind: Any) -> bool:
    return kind is Path or any(map(_is_path, get_args(kind)))


def guarded(command: Callable[..., Any], label: Callable[[str], str]) -> Callable[..., Any]:
    """Return a command's function that first refuses an output over an input or another output, or that has no place.

    Args:
        command: The function.
        label: Returns what the user calls a parameter.
    """
    parameters = parameters_of(command)

    @wraps(command)
    def checked(**given: Any) -> Any:
        paths = [_Given(each, path) for each in parameters for path in _paths(each, given.get(each.name))]
        for one, other in combinations(paths, 2):
            if {one.parameter.name, other.parameter.name} not in IN_PLACE and _collide(one, other):
                output, spared = (one, other) if one.parameter.written else (other, one)
                raise InvalidInputError(
                    f"{label(output.parameter.name)}: {output.path} is the file of {label(spared.parameter.name)} too, "
                    "and would be overwritten; expected another file"
                )
        for each in paths:
            if each.parameter.check is not None:
                each.parameter.check(str(each.path))
        return command(**given)

    return checked


def _paths(parameter: Parameter, value: Any) -> Iterator[Path]:
    for each in value if isinstance(value, (list, tuple)) else [value]:
        if isinstance(each, Path):
            yield each
        elif isinstance(each, str) and each != "-" and (parameter.written or each.endswith(".json")):
            yield Path(each)


def _collide(one: _Given, other: _Given) -> bool:
    """Return whether one is written to, and the other one is the same file, or a file that it makes or keeps."""
    if not (one.parameter.written or other.parameter.written):
        return False
    if same_file(one.path, other.path):
        return True
    for first, second in ((one, other), (other, one)):
        if second.parameter.written and any(same_file(Path(f"{first.path}{end}"), second.path) for end in _BESIDE):
            return True
        printed = first.parameter.written and first.path.suffix.lower() in _PRINTED
        if printed and same_file(first.path.with_suffix(".json"), second.path):
            return True
        made = first.parameter.written and os.path.isdir(first.path) and IN_FOLDERS.fullmatch(second.path.name)
        if made and same_file(first.path, second.path.parent):
            return True
    return False


def same_file(one: Path, other: Path) -> bool:
    """Return whether two paths lead to one file, links of both kinds followed; devices and pipes are no files."""
    try:
        first, second = os.stat(one), os.stat(other)
    except (OSError, ValueError):
        try:
            return os.path.realpath(one) == os.path.realpath(other)
        except (OSError, ValueError):
            return False
    plain = stat.S_ISREG(first.st_mode) or stat.S_ISDIR(first.st_mode)
    return plain and os.path.samestat(first, second)
