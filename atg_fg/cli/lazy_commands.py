"""Commands that are imported when they are called; what the list of commands says of them is read from their source."""

from __future__ import annotations

import ast
import os
import signal
import threading
from collections.abc import Callable
from importlib import import_module
from importlib.abc import InspectLoader
from importlib.util import find_spec
from types import FrameType
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup


class LazyCommand(TyperCommand):
    """A command, or a group of them, that is known by its place until it is called."""

    def __init__(self, name: str, place: str, panel: str | None = None, before: str | None = None) -> None:
        """Name a command that is at ``place``, written ``module:attribute``: a function, or a ``typer.Typer``.

        Args:
            name: The word that calls it.
            place: Where it is.
            panel: The panel of the list of commands that it stands in.
            before: The place of a function that is called with the command's arguments before it is imported.
        """
        self._before = before
        super().__init__(name, rich_help_panel=panel)
        self._module, _, self._attribute = place.partition(":")

    def load(self) -> Any:
        """Import the command and return it, as Typer makes it."""
        found: typer.Typer | Callable[..., Any] = getattr(import_module(self._module), self._attribute)
        if isinstance(found, typer.Typer):
            return _guarded(typer.main.get_group(found))
        only = typer.Typer(add_completion=False)
        only.command(self.name)(found)
        return _guarded(typer.main.get_command(only))

    def read_help(self) -> None:
        """Find the help without importing the command; import it where its source does not tell."""
        self.help = _help_in_source(self._module, self._attribute) or self.load().help

    def make_context(self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any) -> Any:
        """Hand over to the command itself; from now on Ctrl-C is ``KeyboardInterrupt`` to it."""
        if self._before is not None:
            module, _, function = self._before.partition(":")
            getattr(import_module(module), function)(args)
        command = self.load()
        if callable(signal.getsignal(signal.SIGINT)) and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, _interrupt)
        return command.make_context(info_name, args, parent, **extra)


class LazyGroup(TyperGroup):
    """A group whose list of commands imports none of them."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help page."""
        for command in self.commands.values():
            if isinstance(command, LazyCommand):
                command.read_help()
        super().format_help(ctx, formatter)


def _interrupt(signal_number: int, frame: FrameType | None) -> None:
    """Answer Ctrl-C with ``KeyboardInterrupt``, but leave at once where a library is being loaded.

    Commands load libraries when they need them, and libraries turn the exception into errors of their own.
    """
    while frame is not None:
        if frame.f_code.co_filename == "<frozen importlib._bootstrap>":
            os._exit(130)
        frame = frame.f_back
    raise KeyboardInterrupt


def _guarded(command: Any) -> Any:
    """Return a command, or a group with all of its commands, that writes over nothing that it reads."""
    from atg_fg.cli.paths import guarded  # not needed for the list of commands

    commands: list[Any] = list(command.commands.values()) if isinstance(command, TyperGroup) else [command]
    for each in commands:
        labels = {
            given.name: given.name.upper() if given.param_type_name == "argument" else given.opts[0]
            for given in each.params
        }
        each.callback = guarded(each.callback, labels.__getitem__)
    return command


def _help_in_source(module: str, attribute: str) -> str | None:
    """Return the docstring of a function, or the text ``help`` of ``attribute = typer.Typer(help=...)``."""
    spec = find_spec(module)
    source = spec.loader.get_source(module) if spec and isinstance(spec.loader, InspectLoader) else None
    for node in ast.parse(source or "").body:
        match node:
            case ast.FunctionDef(name=name) if name == attribute:
                return ast.get_docstring(node)
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Call(keywords=keywords)) if name == attribute:
                return next((ast.literal_eval(each.value) for each in keywords if each.arg == "help"), None)
    return None
