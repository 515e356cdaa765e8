"""Keyword options of engines: which there are, how they are written, and whether an engine has them."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterable
from typing import Any

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


def named_engines(text: str) -> list[str]:
    """Return the engines in a list such as ``gtsam,particle(n_particles=500,seed=1)``."""
    return [each.strip() for each in re.split(r",(?![^(]*\))", text)]


def name_and_options(text: str) -> tuple[str, dict[str, Any]]:
    """Return the name and the options of an engine written as ``particle(n_particles=500)``.

    Raises:
        InvalidInputError: What is in the brackets is not ``option=value``, with values such as 500, 0.5 or "text".
    """
    name, bracket, rest = text.partition("(")
    if not bracket:
        return text, {}
    try:
        call = ast.parse(f"_({rest}", mode="eval").body
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and not call.args:
            return name, {str(option.arg): ast.literal_eval(option.value) for option in call.keywords}
    except (SyntaxError, ValueError, TypeError, RecursionError, MemoryError):
        pass
    raise InvalidInputError(f"engine {text!r}: cannot be read; expected name(option=value), such as particle(seed=1)")
