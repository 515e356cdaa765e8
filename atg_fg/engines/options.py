"""Keyword options of engines: which there are, and whether a value is what was expected."""

from __future__ import annotations

import inspect
from collections.abc import Iterable

from atg_fg.core.errors import InvalidInputError


def options_of(engine: type) -> list[str]:
    """Return the names of the options of an engine: the keyword-only parameters of its constructor."""
    parameters = inspect.signature(engine).parameters.values()
    return sorted(parameter.name for parameter in parameters if parameter.kind is parameter.KEYWORD_ONLY)


def check_known(engine: type, name: str, options: Iterable[str]) -> None:
    """Raise ``InvalidInputError`` if the engine named ``name`` lacks one of ``options``."""
    for option in options:
        known = options_of(engine)
        if option not in known:
            expected = f"one of: {', '.join(known)}" if known else "none, this engine has no options"
            raise InvalidInputError(f"engine {name!r}: unknown option {option!r}; expected {expected}")
